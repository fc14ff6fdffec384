//! A received message, and the name of its node.

use std::fmt;

use serde::Serialize;

/// The name of an edge node.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct NodeName {
    /// Its group.
    pub group: String,
    /// Its own name in the group.
    pub node: String,
}

impl fmt::Display for NodeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.group, self.node)
    }
}

/// A message as a broker delivers it.
#[derive(Clone, Copy, Debug)]
pub struct ReceivedMessage<'m> {
    /// Its topic.
    pub topic: &'m str,
    /// Its bytes.
    pub payload: &'m [u8],
    /// Whether the broker had retained it from before the subscription.
    pub is_retained: bool,
}
