//! The fleet according to a broker's messages: a state machine without a clock or a socket.
//!
//! `listen` passes in every message and the time; commands make a [`super::FleetReport`] of the
//! view, or print the changes that each message causes. The view trusts nobody: a message is
//! counted and left out if it is too large, no payload, retained by the broker, or from a node
//! beyond the limits.

use std::collections::BTreeMap;

use super::heard::{NodeName, ReceivedMessage};
use super::limits::{FleetCounts, FleetLimits, NodeRoom};
use super::news::{FleetChange, FleetNews};
use super::node::{NodeSession, NodeView, StaleReason};
use rungd_net::mqtt::LongMessage;
use rungd_net::sparkplug::{HostState, MessageKind, Payload, Topic};

/// The maximum number of hosts whose state is kept.
pub(super) const HOSTS_MAX: usize = 100;
/// The time after which a missing birth is requested again, ms.
const ASK_AGAIN_MS: u64 = 10_000;
/// The maximum number of births that are requested at once.
const ASK_AT_ONCE: usize = 20;

/// All known nodes.
#[derive(Clone, Debug, Default)]
pub struct FleetView {
    limits: FleetLimits,
    group: Option<String>,
    pub(super) nodes: BTreeMap<NodeName, NodeView>,
    pub(super) hosts: BTreeMap<String, HostState>,
    pub(super) counts: FleetCounts,
    bytes: usize,
}

impl FleetView {
    /// A view before the first message. With a group, the other groups are left out.
    pub fn new(limits: FleetLimits, group: Option<String>) -> FleetView {
        FleetView { limits, group, ..FleetView::default() }
    }

    /// Takes a message. `now_ms`: this machine's clock, ms since 1970.
    pub fn hear(&mut self, message: ReceivedMessage, now_ms: u64) -> Vec<FleetChange> {
        self.counts.messages += 1;
        match Topic::read(message.topic) {
            None => self.counts.foreign_topics += 1,
            Some(Topic::HostState { host }) => self.hear_host(host, message.payload),
            Some(Topic::Node { group, .. }) if self.is_other(&group) => {}
            Some(Topic::Node { .. }) if message.is_retained => self.counts.kept_by_broker += 1,
            Some(Topic::Node { group, kind, node, .. }) => {
                return self.hear_node(NodeName { group, node }, kind, message.payload, now_ms);
            }
        }
        Vec::new()
    }

    /// Notes a message that was too long to be received. If it is from a known node, the node's
    /// values may be old from now on.
    pub fn miss(&mut self, message: &LongMessage, now_ms: u64) -> Vec<FleetChange> {
        self.counts.messages += 1;
        self.counts.too_large += 1;
        let Some(Topic::Node { group, kind, node, .. }) = Topic::read(&message.topic) else {
            return Vec::new();
        };
        let is_command = matches!(kind, MessageKind::NodeCommand | MessageKind::DeviceCommand);
        let name = NodeName { group, node };
        let Some(node) = self.nodes.get_mut(&name).filter(|_| !message.retained && !is_command)
        else {
            return Vec::new();
        };
        node.hear(None, now_ms);
        let news = node.doubt(StaleReason::TooLarge).into_iter();
        news.map(|news| change(&name, news, now_ms)).collect()
    }

    /// Notes that the link to the broker is down: messages from now on are missed.
    pub fn lose_link(&mut self, now_ms: u64) -> Vec<FleetChange> {
        let mut changes = Vec::new();
        for (name, node) in &mut self.nodes {
            let news = node.doubt(StaleReason::LinkLost);
            changes.extend(news.into_iter().map(|news| change(name, news, now_ms)));
        }
        changes
    }

    /// The nodes from which a birth is to be requested now. Each request is repeated after a while.
    pub fn wants_birth(&mut self, now_ms: u64) -> Vec<NodeName> {
        let is_due = |node: &NodeView| match node.standing {
            NodeSession::Unborn | NodeSession::Stale(_) => {
                node.asked_ms.is_none_or(|asked| now_ms.saturating_sub(asked) >= ASK_AGAIN_MS)
            }
            NodeSession::Online | NodeSession::Offline => false,
        };
        let mut due: Vec<(&NodeName, &mut NodeView)> =
            self.nodes.iter_mut().filter(|(_, node)| is_due(node)).collect();
        // The nodes that have waited longest come first, so that names that never answer do not
        // hold up the others.
        due.sort_by_key(|(_, node)| node.asked_ms);
        due.truncate(ASK_AT_ONCE);
        let ask = |(name, node): (&NodeName, &mut NodeView)| {
            node.asked_ms = Some(now_ms);
            name.clone()
        };
        due.into_iter().map(ask).collect()
    }

    fn is_other(&self, group: &str) -> bool {
        self.group.as_ref().is_some_and(|own| own != group)
    }

    /// Takes the state of a host application.
    fn hear_host(&mut self, host: String, payload: &[u8]) {
        let is_new = !self.hosts.contains_key(&host);
        if is_new && self.hosts.len() >= HOSTS_MAX {
            self.counts.hosts_refused += 1;
            return;
        }
        match HostState::read(payload) {
            Ok(state) => drop(self.hosts.insert(host, state)),
            Err(_) => self.counts.garbage += 1,
        }
    }

    /// Takes a message from or to a node.
    fn hear_node(
        &mut self,
        name: NodeName,
        kind: MessageKind,
        bytes: &[u8],
        now_ms: u64,
    ) -> Vec<FleetChange> {
        if matches!(kind, MessageKind::NodeCommand | MessageKind::DeviceCommand) {
            self.counts.commands += 1;
            return Vec::new();
        }
        let is_new = !self.nodes.contains_key(&name);
        if is_new && self.nodes.len() >= self.limits.nodes_max {
            self.counts.nodes_refused += 1;
            return Vec::new();
        }
        let payload = self.payload(bytes);
        if is_new && payload.is_err() {
            // Garbage does not create a node.
            return Vec::new();
        }
        let limits = self.limits;
        let node = self.nodes.entry(name.clone()).or_insert_with(|| NodeView::new(now_ms));
        let own = node.metrics.bytes();
        let bytes = own + limits.bytes_max.saturating_sub(self.bytes);
        let room = NodeRoom { limits: &limits, bytes };
        let was = node.standing.clone();
        // A death has the time of its connection, which is unrelated to the present time of the
        // node's clock.
        let is_word = !matches!(kind, MessageKind::NodeDeath | MessageKind::DeviceDeath);
        node.hear(payload.as_ref().ok().filter(|_| is_word), now_ms);
        let mut news = match (payload, kind) {
            (Err(why), _) => node.doubt(why),
            (Ok(payload), MessageKind::NodeBirth) => node.born(&payload, now_ms, room),
            (Ok(payload), MessageKind::NodeDeath) => node.died(&payload),
            (Ok(payload), MessageKind::NodeData) => node.take_data(&payload, room),
            (
                Ok(payload),
                MessageKind::DeviceBirth | MessageKind::DeviceData | MessageKind::DeviceDeath,
            ) => node.device_told(&payload),
            (Ok(_), MessageKind::NodeCommand | MessageKind::DeviceCommand) => Vec::new(),
        };
        if is_new && was == node.standing {
            news.insert(0, FleetNews::Heard);
        }
        self.bytes = self.bytes - own + node.metrics.bytes();
        news.into_iter().map(|news| change(&name, news, now_ms)).collect()
    }

    /// The payload of a message, if it is within the limits and can be read.
    fn payload(&mut self, bytes: &[u8]) -> Result<Payload, StaleReason> {
        if bytes.len() > self.limits.payload_bytes_max {
            self.counts.too_large += 1;
            return Err(StaleReason::TooLarge);
        }
        Payload::read(bytes).map_err(|_| {
            self.counts.garbage += 1;
            StaleReason::Garbage
        })
    }
}

fn change(node: &NodeName, news: FleetNews, now_ms: u64) -> FleetChange {
    let at_ms = match &news {
        FleetNews::Value { told_ms, .. } => told_ms.unwrap_or(now_ms),
        FleetNews::Heard | FleetNews::Born { .. } | FleetNews::Died | FleetNews::Stale { .. } => {
            now_ms
        }
    };
    FleetChange { at_ms, node: node.clone(), news }
}
