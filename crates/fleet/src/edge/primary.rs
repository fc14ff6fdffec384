//! The primary host and its STATE messages: which of them count, and which are old.
//!
//! This module is pure and does not use the node's state: `node` decides what follows from a state.
//! A broker with several hosts, or a stranger, may send any states in any order, so they are
//! ordered by their times.

use rungd_net::sparkplug::HostState;

/// What a state changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HostNews {
    /// The state is older than the known one.
    Old,
    /// The host is online, as was already known.
    Still,
    /// The host is online, for the first time or again.
    Came,
    /// The host is offline.
    Gone,
}

/// The host at one broker.
#[derive(Debug, Default)]
pub(super) struct PrimaryHost {
    /// The time of its last birth.
    born_ms: Option<u64>,
    /// The host came online while the node was born, and has no birth yet.
    pub is_owed: bool,
}

impl PrimaryHost {
    /// Forgets the known time: it is different at a different broker.
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
