//! The settings of an edge node, as `keys` reads them from EDGE.toml.

use std::path::PathBuf;
use std::time::Duration;

use rungd_net::sparkplug::fits;

/// The settings of an edge node.
#[derive(Clone, Debug)]
pub struct EdgeSettings {
    /// The group.
    pub group: String,
    /// The name of the node.
    pub name: String,
    /// The operator's socket of the controller; `None`: the usual places, searched each time.
    pub socket: Option<PathBuf>,
    /// The folder for the node's log position; `None`: `$STATE_DIRECTORY`, if that is set.
    pub state_dir: Option<PathBuf>,
    /// The brokers.
    pub broker: BrokerKeys,
    /// The primary host: nothing is sent while it is offline.
    pub primary_host: Option<String>,
    /// The time over which changes are collected.
    pub interval: Duration,
    /// The time before the confirmed log position whose changes are sent again.
    pub margin: Duration,
    /// The rules for publishing; the first rule that names a tag applies.
    pub publish: Vec<PublishRule>,
    /// The tags that commands may write.
    pub commands: Vec<String>,
}

/// `[broker]`.
#[derive(Clone, Debug)]
pub struct BrokerKeys {
    /// The addresses, as `mqtts://host:port`; tried in turn.
    pub addresses: Vec<String>,
    /// MQTT 5 rather than 3.1.1.
    pub is_v5: bool,
    /// The longest silence of the broker.
    pub keepalive: Duration,
    /// The user.
    pub user: Option<String>,
    /// The file with the password.
    pub password_file: Option<PathBuf>,
    /// The certificates that verify brokers, PEM; `None`: the system's.
    pub ca: Option<PathBuf>,
    /// The node's own certificate and its key, PEM.
    pub certificate: Option<(PathBuf, PathBuf)>,
}

/// `[[publish]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishRule {
    /// The patterns of the tags' names.
    pub tags: Vec<String>,
    /// A number is sent if it differs by at least this from the last sent number.
    pub deadband: f64,
    /// At most one value of a tag is sent in this time.
    pub every: Duration,
}

impl EdgeSettings {
    /// The rule of a tag; `None`: it is not published.
    pub(super) fn rule(&self, name: &str) -> Option<&PublishRule> {
        self.publish.iter().find(|rule| rule.tags.iter().any(|pattern| fits(pattern, name)))
    }

    /// The whole margin, ns.
    pub(super) fn margin_ns(&self) -> i64 {
        i64::try_from(self.whole_margin().as_nanos()).unwrap_or(i64::MAX)
    }

    /// The margin, but at least the longest time for which a value may be held back.
    pub(super) fn whole_margin(&self) -> Duration {
        let longest = self.publish.iter().map(|rule| rule.every).max().unwrap_or_default();
        self.margin.max(longest)
    }
}
