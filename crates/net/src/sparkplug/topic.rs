//! Topics: `spBv1.0/GROUP/KIND/NODE[/DEVICE]`, and `spBv1.0/STATE/HOST` (specification, chapter 4).

use std::fmt;

/// The first level of each topic.
const NAMESPACE: &str = "spBv1.0";

/// The maximum length of the name of a group, node, device or host, in bytes.
const NAME_BYTES_MAX: usize = 256;

/// A topic.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Topic {
    /// The topic of an edge node, or of a device behind it.
    Node {
        /// Its group.
        group: String,
        /// The kind of message.
        kind: MessageKind,
        /// The edge node.
        node: String,
        /// The device, in messages of devices.
        device: Option<String>,
    },
    /// The topic of a host application.
    HostState {
        /// Its name.
        host: String,
    },
}

/// The kinds of message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum MessageKind {
    NodeBirth,
    NodeData,
    NodeDeath,
    NodeCommand,
    DeviceBirth,
    DeviceData,
    DeviceDeath,
    DeviceCommand,
}

const KINDS: [MessageKind; 8] = [
    MessageKind::NodeBirth,
    MessageKind::NodeData,
    MessageKind::NodeDeath,
    MessageKind::NodeCommand,
    MessageKind::DeviceBirth,
    MessageKind::DeviceData,
    MessageKind::DeviceDeath,
    MessageKind::DeviceCommand,
];

/// The reason why a text is no name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NameFault {
    /// It has no character.
    Empty,
    /// It has more than 256 bytes.
    TooLong,
    /// It has `/`, `+`, `#` or a control character.
    Character(char),
}

impl fmt::Display for NameFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NameFault::Empty => write!(f, "a name needs at least one character"),
            NameFault::TooLong => {
                write!(f, "a name of Sparkplug has at most {NAME_BYTES_MAX} bytes here")
            }
            NameFault::Character(found) => {
                let found = found.escape_debug();
                write!(f, "`{found}` is not allowed in a Sparkplug name: no `/`, `+`, `#`")
            }
        }
    }
}

/// Checks the name of a group, node, device or host.
///
/// # Errors
/// The fault of the name.
pub fn check_name(name: &str) -> Result<(), NameFault> {
    if name.is_empty() {
        return Err(NameFault::Empty);
    }
    if name.len() > NAME_BYTES_MAX {
        return Err(NameFault::TooLong);
    }
    let bad = name.chars().find(|c| matches!(c, '/' | '+' | '#') || c.is_control());
    bad.map_or(Ok(()), |c| Err(NameFault::Character(c)))
}

impl MessageKind {
    /// The name of this kind in a topic.
    pub const fn name(self) -> &'static str {
        match self {
            MessageKind::NodeBirth => "NBIRTH",
            MessageKind::NodeData => "NDATA",
            MessageKind::NodeDeath => "NDEATH",
            MessageKind::NodeCommand => "NCMD",
            MessageKind::DeviceBirth => "DBIRTH",
            MessageKind::DeviceData => "DDATA",
            MessageKind::DeviceDeath => "DDEATH",
            MessageKind::DeviceCommand => "DCMD",
        }
    }

    /// Whether its topic contains a device.
    pub const fn has_device(self) -> bool {
        match self {
            MessageKind::NodeBirth
            | MessageKind::NodeData
            | MessageKind::NodeDeath
            | MessageKind::NodeCommand => false,
            MessageKind::DeviceBirth
            | MessageKind::DeviceData
            | MessageKind::DeviceDeath
            | MessageKind::DeviceCommand => true,
        }
    }
}

impl Topic {
    /// The topic of a message of a node.
    pub fn of_node(group: &str, kind: MessageKind, node: &str) -> Topic {
        Topic::Node { group: group.to_owned(), kind, node: node.to_owned(), device: None }
    }

    /// The topic of a host's state.
    pub fn of_host(host: &str) -> Topic {
        Topic::HostState { host: host.to_owned() }
    }

    /// Reads a topic; `None`: the text is no topic of Sparkplug B 3.0.
    pub fn read(text: &str) -> Option<Topic> {
        let mut levels = text.split('/');
        let mut next = || levels.next().filter(|level| check_name(level).is_ok());
        if next()? != NAMESPACE {
            return None;
        }
        let (second, third) = (next()?, next()?);
        if second == "STATE" {
            return levels.next().is_none().then(|| Topic::of_host(third));
        }
        let kind = KINDS.into_iter().find(|kind| kind.name() == third)?;
        let node = next()?.to_owned();
        let device = levels.next().map(str::to_owned);
        let fits = device.is_some() == kind.has_device()
            && device.as_ref().is_none_or(|device| check_name(device).is_ok())
            && levels.next().is_none();
        fits.then(|| Topic::Node { group: second.to_owned(), kind, node, device })
    }
}

impl fmt::Display for Topic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Topic::Node { group, kind, node, device } => {
                write!(f, "{NAMESPACE}/{group}/{}/{node}", kind.name())?;
                device.as_ref().map_or(Ok(()), |device| write!(f, "/{device}"))
            }
            Topic::HostState { host } => write!(f, "{NAMESPACE}/STATE/{host}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_topic_is_read_back() {
        for text in [
            "spBv1.0/plant/NBIRTH/press-3",
            "spBv1.0/plant/NDATA/press 3",
            "spBv1.0/plant/NDEATH/p",
            "spBv1.0/plant/NCMD/p",
            "spBv1.0/plant/DBIRTH/p/io",
            "spBv1.0/plant/DCMD/p/io",
            "spBv1.0/STATE/scada",
        ] {
            assert_eq!(Topic::read(text).map(|topic| topic.to_string()).as_deref(), Some(text));
        }
    }

    #[test]
    fn invalid_topics_are_refused() {
        for text in [
            "",
            "spBv1.0",
            "spBv1.0/plant/NBIRTH",
            "spBv1.0/plant/NBIRTH/",
            "spBv1.0/plant/NBIRTH/p/d",
            "spBv1.0/plant/DBIRTH/p",
            "spBv1.0/plant/DBIRTH/p/d/e",
            "spBv1.0//NBIRTH/p",
            "spBv1.0/STATE/a/b",
            "spBv1.0/STATE/",
            "spAv1.0/plant/NBIRTH/p",
            "STATE/scada",
            "spBv1.0/plant/NOTHING/p",
        ] {
            assert_eq!(Topic::read(text), None, "{text}");
        }
    }

    #[test]
    fn names_of_groups_and_nodes_are_checked() {
        assert_eq!(check_name("Press 3 (north)"), Ok(()));
        assert_eq!(check_name(""), Err(NameFault::Empty));
        assert_eq!(check_name("a/b"), Err(NameFault::Character('/')));
        assert_eq!(check_name(&"x".repeat(257)), Err(NameFault::TooLong));
    }
}
