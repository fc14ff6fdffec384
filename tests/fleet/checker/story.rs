//! The actions of a client at a broker, as the rules read them: connections in order, each with its
//! packets and the broker's deliveries in order.

use rungd_net::sparkplug::{MessageKind, Payload, Topic};

/// The connections of one client, in order.
#[derive(Clone, Debug, Default)]
pub struct Story {
    pub group: String,
    pub node: String,
    /// An edge node's configured primary host, or the host application itself.
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
    /// From MQTT 5; 0 if absent.
    pub session_expiry_s: u32,
    pub will: Option<Published>,
    /// The time of arrival, ms since 1970.
    pub at_ms: u64,
}

/// A message with its QoS, retain flag and time.
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
    /// A message that the broker delivered.
    Got(Published),
    /// With the reason of MQTT 5; 0 in MQTT 3.1.1.
    Disconnected(u8),
}

impl Story {
    /// All sent messages with their connections, without the wills.
    pub fn sent(&self) -> impl Iterator<Item = (&Connection, &Published)> {
        self.connections
            .iter()
            .flat_map(|connection| connection.sent().map(move |published| (connection, published)))
    }

    /// The sent messages of one kind.
    pub fn published(&self, kind: MessageKind) -> Vec<&Published> {
        self.sent().map(|(_, sent)| sent).filter(|sent| sent.kind() == Some(kind)).collect()
    }

    /// The topic of this node's messages of a kind.
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

    /// The index of the first step that fits.
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

    /// The Sparkplug payload. It is empty if the bytes are not a payload; a separate rule reports
    /// that.
    pub fn read(&self) -> Payload {
        Payload::read(&self.payload).unwrap_or_default()
    }

    /// Changes the payload.
    pub fn change(&mut self, change: impl FnOnce(&mut Payload)) {
        let mut payload = self.read();
        change(&mut payload);
        self.payload = payload.bytes();
    }
}
