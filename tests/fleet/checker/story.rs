//! What a client did at a broker, as the rules read it: connections in order, and in each the
//! packets in order, with what the broker delivered in between.

use rungd::sparkplug::{MessageKind, Payload, Topic};

/// The connections of one client, in order.
#[derive(Clone, Debug, Default)]
pub struct Story {
    pub group: String,
    pub node: String,
    /// The primary host that an edge node was configured with; of a host application: itself.
    pub host: Option<String>,
    pub connections: Vec<Connection>,
}

/// One connection.
#[derive(Clone, Debug)]
pub struct Connection {
    pub connect: Connect,
    pub steps: Vec<Step>,
}

/// The CONNECT packet.
#[derive(Clone, Debug)]
pub struct Connect {
    /// 4 is MQTT 3.1.1, 5 is MQTT 5.
    pub version: u8,
    pub clean: bool,
    /// Of MQTT 5; 0 if it is absent.
    pub session_expiry_s: u32,
    pub will: Option<Published>,
    /// When it came: ms since 1970.
    pub at_ms: u64,
}

/// A message with how it was sent.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    pub topic: String,
    pub payload: Vec<u8>,
    pub qos: u8,
    pub retain: bool,
    pub at_ms: u64,
}

/// A packet after CONNECT.
#[derive(Clone, Debug)]
pub enum Step {
    Subscribed(Vec<(String, u8)>),
    Sent(Published),
    /// The broker delivered it.
    Got(Published),
    /// With the reason of MQTT 5; 0 by MQTT 3.1.1.
    Disconnected(u8),
}

impl Story {
    /// Everything that was sent, with its connection: not the wills.
    pub fn sent(&self) -> impl Iterator<Item = (&Connection, &Published)> {
        self.connections
            .iter()
            .flat_map(|connection| connection.sent().map(move |published| (connection, published)))
    }

    /// The sent messages of one kind.
    pub fn of(&self, kind: MessageKind) -> Vec<&Published> {
        self.sent().map(|(_, sent)| sent).filter(|sent| sent.kind() == Some(kind)).collect()
    }

    /// The topic that a kind of message of this node has.
    pub fn topic(&self, kind: MessageKind) -> String {
        Topic::of_node(&self.group, kind, &self.node).to_string()
    }
}

impl Connection {
    pub fn sent(&self) -> impl Iterator<Item = &Published> {
        self.steps.iter().filter_map(Step::sent)
    }

    pub fn subscribed(&self) -> impl Iterator<Item = &(String, u8)> {
        self.steps.iter().flat_map(|step| match step {
            Step::Subscribed(filters) => filters.as_slice(),
            Step::Sent(_) | Step::Got(_) | Step::Disconnected(_) => &[],
        })
    }

    /// The place of the first step that fits.
    pub fn place(&self, fits: impl Fn(&Step) -> bool) -> Option<usize> {
        self.steps.iter().position(fits)
    }
}

impl Step {
    pub fn sent(&self) -> Option<&Published> {
        match self {
            Step::Sent(published) => Some(published),
            Step::Subscribed(_) | Step::Got(_) | Step::Disconnected(_) => None,
        }
    }

    pub fn sent_mut(&mut self) -> Option<&mut Published> {
        match self {
            Step::Sent(published) => Some(published),
            Step::Subscribed(_) | Step::Got(_) | Step::Disconnected(_) => None,
        }
    }
}

impl Published {
    pub fn kind(&self) -> Option<MessageKind> {
        match Topic::read(&self.topic) {
            Some(Topic::Node { kind, .. }) => Some(kind),
            Some(Topic::HostState { .. }) | None => None,
        }
    }

    pub fn is_state(&self) -> bool {
        matches!(Topic::read(&self.topic), Some(Topic::HostState { .. }))
    }

    /// Its payload of Sparkplug; an empty one if it is none, which a rule of its own reports.
    pub fn read(&self) -> Payload {
        Payload::read(&self.payload).unwrap_or_default()
    }

    /// Changes its payload.
    pub fn change(&mut self, change: impl FnOnce(&mut Payload)) {
        let mut payload = self.read();
        change(&mut payload);
        self.payload = payload.bytes();
    }
}
