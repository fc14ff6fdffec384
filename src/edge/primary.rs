//! The primary host, as its STATE tells of it: which words count, and which are old.
//!
//! Pure, and without the node's state: `node` decides what follows. A broker of several hosts, or a
//! stranger, may say anything: the time of a state orders them.

use crate::sparkplug::HostState;

/// What a state tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HostNews {
    /// It is older than what is known.
    Old,
    /// It is there, as was known.
    Still,
    /// It is there, for the first time or anew.
    Came,
    /// It is gone.
    Gone,
}

/// The host at one broker.
#[derive(Debug, Default)]
pub(super) struct PrimaryHost {
    /// The time of its last birth.
    born_ms: Option<u64>,
    /// It came while the node was born, and has no birth yet.
    pub is_owed: bool,
}

impl PrimaryHost {
    /// At another broker it has a time of its own.
    pub fn forget(&mut self) {
        *self = PrimaryHost::default();
    }

    /// Takes a state.
    pub fn hear(&mut self, HostState { online, timestamp }: HostState) -> HostNews {
        if self.born_ms.is_some_and(|known| timestamp < known) {
            return HostNews::Old;
        }
        let is_new = self.born_ms != Some(timestamp);
        self.born_ms = Some(timestamp);
        match (online, is_new) {
            (false, _) => HostNews::Gone,
            (true, true) => HostNews::Came,
            (true, false) => HostNews::Still,
        }
    }
}
