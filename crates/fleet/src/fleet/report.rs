//! The fleet at one moment, for people and programs: one row per node.
//!
//! The report is made from a [`FleetView`]; `cli::fleet_page` draws it, and `--json` writes it as
//! it is. The names of times end in their unit.

use serde::Serialize;

use super::alarms::{FleetAlarmList, UnknownAlarms};
use super::expect::{ExpectedLadders, LadderVerdict};
use super::heard::NodeName;
use super::limits::{FleetCounts, cut};
use super::node::{NodeSession, NodeView};
use super::view::FleetView;
use rungd_client::operator::protocol::is_run;
use rungd_net::sparkplug::{HostState, MetricValue, vocabulary};

/// An edge node of rungd publishes its scan every 10 s. It is silent if three of these messages are
/// missing.
const SILENT_MS: u64 = 30_000;

/// The fleet at one moment.
#[derive(Debug, Serialize)]
pub struct FleetReport {
    /// This machine's clock, ms since 1970.
    pub(crate) now_ms: u64,
    /// The nodes, by group and name.
    pub nodes: Vec<NodeReport>,
    /// The folder's nodes from which no message came (`--expect`).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<MissingNode>,
    /// The host applications that publish their state.
    pub hosts: Vec<HostReport>,
    /// The counts of messages, and of messages that were left out.
    pub counts: FleetCounts,
}

/// A node. Facts that it has not published are absent.
#[derive(Debug, Default, Serialize)]
pub struct NodeReport {
    /// Its group and name.
    #[serde(flatten)]
    pub name: NodeName,
    /// `online`, `stale`, `silent`, `offline` or `unborn`.
    pub state: &'static str,
    /// The reason of the state, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// The time since its last message, ms.
    pub age_ms: u64,
    /// The time since a birth was last requested (`--rebirth`), ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub asked_ms: Option<u64>,
    /// The lead of its clock over this machine's clock, ms, less the time that the message took.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clock_ahead_ms: Option<i64>,
    /// The time since its last birth, ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub born_ms: Option<u64>,
    /// Whether it is an edge node of rungd.
    pub is_rungd: bool,
    /// What it publishes about its controller.
    #[serde(flatten)]
    pub told: ControllerReport,
    /// The result of the comparison with a folder (`--expect`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ladder_verdict: Option<LadderVerdict>,
    /// The number of its metrics.
    pub metrics: usize,
    /// The number of its messages.
    pub messages: u64,
    /// The number of its births.
    pub births: u64,
    /// The number of gaps in its messages.
    pub gaps: u64,
    /// The number of deaths of earlier sessions.
    pub old_deaths: u64,
    /// The number of values of the past.
    pub historical_values: u64,
    /// The number of metrics beyond the limits.
    pub metrics_refused: u64,
    /// The number of values that are not of their type, metrics without a name, and metrics that a
    /// birth has twice.
    pub values_refused: u64,
}

/// The facts that a node of rungd publishes about its controller.
#[derive(Debug, Default, Serialize)]
pub struct ControllerReport {
    /// The version of rungd.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<String>,
    /// Whether the controller answers its edge node.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controller: Option<bool>,
    /// The mode: `run`, `stop` or `fault`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<String>,
    /// The reason of the mode.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode_reason: Option<String>,
    /// The name of the ladder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ladder: Option<String>,
    /// The sum over its files, as `rungd status` shows it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ladder_sha256: Option<String>,
    /// The number of forced elements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forces: Option<i64>,
    /// The number of skipped scan points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overruns: Option<i64>,
    /// The number of alarms that are ON.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alarms: Option<i64>,
    /// The number of alarms that nobody has acknowledged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alarms_unacknowledged: Option<i64>,
    /// The number of the last scan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scan: Option<i64>,
    /// The number of scans that the scan log has lost.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub history_lost: Option<i64>,
    /// Whether it publishes values of the past.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub history_replaying: Option<bool>,
}

/// A node of the folder from which no message came.
#[derive(Debug, Serialize)]
pub struct MissingNode {
    /// Its group, if the file's path has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// Its name.
    pub node: String,
    /// The result of the comparison with the folder.
    pub ladder_verdict: LadderVerdict,
}

/// A host application.
#[derive(Debug, Serialize)]
pub struct HostReport {
    /// Its name.
    pub host: String,
    /// Its state.
    #[serde(flatten)]
    pub state: HostState,
}

impl FleetView {
    /// The fleet at the time `now_ms`: this machine's clock, ms since 1970.
    pub fn report(&self, now_ms: u64) -> FleetReport {
        let nodes = self.nodes.iter().map(|(name, node)| node_report(name, node, now_ms));
        let host =
            |(host, state): (&String, &HostState)| HostReport { host: host.clone(), state: *state };
        FleetReport {
            now_ms,
            nodes: nodes.collect(),
            missing: Vec::new(),
            hosts: self.hosts.iter().map(host).collect(),
            counts: self.counts,
        }
    }

    /// The messages and the parts of messages that were left out, for people.
    pub fn left_out(&self) -> Vec<String> {
        let sum = |count: fn(&NodeView) -> u64| self.nodes.values().map(count).sum::<u64>();
        let rows = [
            (sum(|node| node.counts.metrics_refused), "metrics beyond the limits"),
            (sum(|node| node.counts.values_refused), "values without a name or not of their type"),
        ];
        let parts = rows.into_iter().filter(|(count, _)| *count > 0);
        let parts = parts.map(|(count, what)| format!("{count} {what}"));
        self.counts.left_out().into_iter().chain(parts).collect()
    }

    /// The alarms of all nodes.
    pub fn alarms(&self, now_ms: u64) -> FleetAlarmList {
        let (nodes, counts) = (self.nodes.len(), self.counts);
        let mut list = FleetAlarmList { nodes, counts, ..FleetAlarmList::default() };
        for (name, node) in &self.nodes {
            let why = match (whole_text(node, vocabulary::ALARM_LIST), &node.standing) {
                (Some(text), _) => {
                    list.add(name, state_of(node, now_ms), text);
                    continue;
                }
                (None, NodeSession::Unborn) => "no birth was received",
                (None, NodeSession::Online | NodeSession::Stale(_) | NodeSession::Offline) => {
                    "it publishes no alarm list"
                }
            };
            list.unknown.push(UnknownAlarms { node: name.clone(), why });
        }
        list
    }
}

impl FleetReport {
    /// Compares the ladders with those of a folder.
    pub fn compare(&mut self, expected: &mut ExpectedLadders) {
        for node in &mut self.nodes {
            let runs = node.told.ladder_sha256.as_deref();
            let is_foreign = !node.is_rungd && node.state != "unborn";
            let verdict = expected.judge(&node.name, runs);
            let counts = !(is_foreign && verdict == LadderVerdict::Unlisted);
            node.ladder_verdict = counts.then_some(verdict);
        }
        let heard: Vec<NodeName> = self.nodes.iter().map(|node| node.name.clone()).collect();
        let missing = expected.missing(&heard).into_iter();
        let missing = missing.map(|(group, node, ladder_verdict)| MissingNode {
            group,
            node,
            ladder_verdict,
        });
        self.missing = missing.collect();
    }

    /// Whether each node is known to run the ladder of the folder, and none is missing.
    pub fn is_as_expected(&self) -> bool {
        let mut verdicts = self.nodes.iter().filter_map(|node| node.ladder_verdict.as_ref());
        self.missing.is_empty() && self.is_whole() && verdicts.all(LadderVerdict::is_same)
    }

    /// Whether no node is beyond the limit: the state of such a node is not known.
    fn is_whole(&self) -> bool {
        self.counts.nodes_refused == 0
    }

    /// Whether there is a node, all nodes are online, and each controller of rungd is known to be
    /// in RUN.
    pub fn all_run(&self) -> bool {
        let runs = |node: &NodeReport| {
            let is_there = node.state == "online" && node.told.controller != Some(false);
            let mode = node.told.mode.as_deref();
            is_there && mode.map_or(!node.is_rungd, is_run)
        };
        !self.nodes.is_empty() && self.is_whole() && self.nodes.iter().all(runs)
    }
}

fn node_report(name: &NodeName, node: &NodeView, now_ms: u64) -> NodeReport {
    let counts = node.counts;
    let why = match &node.standing {
        NodeSession::Stale(why) => Some(why.text()),
        NodeSession::Unborn | NodeSession::Online | NodeSession::Offline => None,
    };
    let ahead = |(told, came): (u64, u64)| {
        i64::try_from(i128::from(told) - i128::from(came)).unwrap_or(i64::MAX)
    };
    NodeReport {
        name: name.clone(),
        state: state_of(node, now_ms),
        why,
        age_ms: now_ms.saturating_sub(node.heard_ms),
        asked_ms: node.asked_ms.map(|asked| now_ms.saturating_sub(asked)),
        clock_ahead_ms: node.told_ms.map(ahead),
        born_ms: node.born_ms.map(|born| now_ms.saturating_sub(born)),
        is_rungd: is_rungd(node),
        told: controller_report(node),
        ladder_verdict: None,
        metrics: node.metrics.len(),
        messages: counts.messages,
        births: counts.births,
        gaps: counts.gaps,
        old_deaths: counts.old_deaths,
        historical_values: counts.historical,
        metrics_refused: counts.metrics_refused,
        values_refused: counts.values_refused,
    }
}

/// The state of a node as a word.
fn state_of(node: &NodeView, now_ms: u64) -> &'static str {
    let is_silent = is_rungd(node) && now_ms.saturating_sub(node.heard_ms) > SILENT_MS;
    match node.standing {
        NodeSession::Unborn => "unborn",
        NodeSession::Online if is_silent => "silent",
        NodeSession::Online => "online",
        NodeSession::Stale(_) => "stale",
        NodeSession::Offline => "offline",
    }
}

/// Whether a node has the heartbeat of rungd.
fn is_rungd(node: &NodeView) -> bool {
    node.metrics.get(vocabulary::SCAN).is_some()
}

fn controller_report(node: &NodeView) -> ControllerReport {
    ControllerReport {
        version: text(node, vocabulary::VERSION),
        controller: flag(node, vocabulary::CONTROLLER),
        mode: text(node, vocabulary::MODE),
        mode_reason: text(node, vocabulary::MODE_REASON),
        ladder: text(node, vocabulary::LADDER),
        ladder_sha256: text(node, vocabulary::LADDER_SHA256),
        forces: number(node, vocabulary::FORCES),
        overruns: number(node, vocabulary::OVERRUNS),
        alarms: number(node, vocabulary::ALARMS),
        alarms_unacknowledged: number(node, vocabulary::ALARMS_UNACKNOWLEDGED),
        scan: number(node, vocabulary::SCAN),
        history_lost: number(node, vocabulary::HISTORY_LOST),
        history_replaying: flag(node, vocabulary::HISTORY_REPLAYING),
    }
}

fn text(node: &NodeView, name: &str) -> Option<String> {
    whole_text(node, name).map(cut)
}

fn whole_text<'n>(node: &'n NodeView, name: &str) -> Option<&'n str> {
    match node.metrics.get(name)?.value.as_ref()? {
        MetricValue::Text(text) => Some(text),
        MetricValue::Signed(_)
        | MetricValue::Unsigned(_)
        | MetricValue::Real(_)
        | MetricValue::Bool(_) => None,
    }
}

fn number(node: &NodeView, name: &str) -> Option<i64> {
    match node.metrics.get(name)?.value.as_ref()? {
        MetricValue::Signed(number) => Some(*number),
        MetricValue::Unsigned(number) => i64::try_from(*number).ok(),
        MetricValue::Real(_) | MetricValue::Bool(_) | MetricValue::Text(_) => None,
    }
}

fn flag(node: &NodeView, name: &str) -> Option<bool> {
    match node.metrics.get(name)?.value.as_ref()? {
        MetricValue::Bool(flag) => Some(*flag),
        MetricValue::Signed(_)
        | MetricValue::Unsigned(_)
        | MetricValue::Real(_)
        | MetricValue::Text(_) => None,
    }
}
