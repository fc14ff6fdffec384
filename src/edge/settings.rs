//! The settings of an edge node, as `keys` makes them of EDGE.toml.

use std::path::PathBuf;
use std::time::Duration;

use crate::sparkplug::fits;

/// The settings of an edge node.
#[derive(Clone, Debug)]
pub struct EdgeSettings {
    /// The group.
    pub group: String,
    /// The name of the node.
    pub name: String,
    /// The operator's socket of the controller; `None`: the usual places, looked at anew each time.
    pub socket: Option<PathBuf>,
    /// Where it keeps its place in the log; `None`: `$STATE_DIRECTORY`, if that is set.
    pub state_dir: Option<PathBuf>,
    /// The brokers.
    pub broker: BrokerKeys,
    /// The host that everything is for: nothing is sent while it is away.
    pub primary_host: Option<String>,
    /// Changes are collected so long.
    pub interval: Duration,
    /// So much before the confirmed place is sent again.
    pub margin: Duration,
    /// What is published; the first rule that names a tag counts.
    pub publish: Vec<PublishRule>,
    /// The tags that commands may write.
    pub commands: Vec<String>,
}

/// `[broker]`.
#[derive(Clone, Debug)]
pub struct BrokerKeys {
    /// As `mqtts://host:port`; tried in turn.
    pub addresses: Vec<String>,
    /// MQTT 5 rather than 3.1.1.
    pub is_v5: bool,
    /// The longest silence.
    pub keepalive: Duration,
    /// The user.
    pub user: Option<String>,
    /// The file with the password.
    pub password_file: Option<PathBuf>,
    /// The certificates by which brokers are known, PEM; `None`: the system's.
    pub ca: Option<PathBuf>,
    /// The node's own certificate and its key, PEM.
    pub certificate: Option<(PathBuf, PathBuf)>,
}

/// `[[publish]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishRule {
    /// Patterns of the names.
    pub tags: Vec<String>,
    /// A number is sent when it differs by so much from the one that was sent last.
    pub deadband: f64,
    /// At most one value of a tag in this time.
    pub every: Duration,
}

impl EdgeSettings {
    /// The rule of a tag; `None`: it is not published.
    pub(super) fn rule(&self, name: &str) -> Option<&PublishRule> {
        self.publish.iter().find(|rule| rule.tags.iter().any(|pattern| fits(pattern, name)))
    }

    /// So much before the confirmed place is sent again: a value that waits for its turn too.
    pub(super) fn margin_ns(&self) -> i64 {
        i64::try_from(self.whole_margin().as_nanos()).unwrap_or(i64::MAX)
    }

    /// The margin, at least as long as a value may be held back.
    pub(super) fn whole_margin(&self) -> Duration {
        let longest = self.publish.iter().map(|rule| rule.every).max().unwrap_or_default();
        self.margin.max(longest)
    }
}
