//! The lines in the log about an operand that an operator has changed.
//!
//! Called by `desk` after the change. It changes nothing itself.

use std::time::Duration;

use super::peer::Peer;
use crate::daemon::narration::span;
use crate::events::{self, Event};
use crate::operator::operand::Variable;
use crate::operator::protocol::{Change, Held};
use crate::say::say;

/// A change of an operand, and the user who made it.
#[derive(Clone, Copy)]
pub(super) struct ToldChange<'a> {
    peer: &'a Peer,
    operand: &'a Variable,
    change: &'a Change,
}

/// A write that no scan has seen yet.
#[derive(Clone, Copy)]
pub(super) struct WaitingWrite {
    pub written: Held,
    /// The scan period.
    pub period: Duration,
}

impl<'a> ToldChange<'a> {
    pub fn new(peer: &'a Peer, operand: &'a Variable, change: &'a Change) -> ToldChange<'a> {
        ToldChange { peer, operand, change }
    }

    /// Logs the change.
    pub fn tell(self, event: &Event, did: &str) {
        let Change { before, was_forced, now, .. } = self.change;
        let forced = if *was_forced { ", forced" } else { "" };
        let words = format!("{did}: it was {before}{forced}, and is {}", now.value);
        self.line(event, now.value, &words);
    }

    /// Logs a write that no scan has seen yet. No further line follows.
    pub fn tell_waiting(self, write: WaitingWrite) {
        let Change { before, now, .. } = self.change;
        let note = write.note();
        let words = format!("asked to write to {now}: {note}; until then it is {before}");
        self.line(&events::OPERATOR_WRITE, write.written, &words);
    }

    /// Logs a line with these words, and with the values before and after.
    fn line(self, event: &Event, after: Held, words: &str) {
        let (peer, address, before) = (self.peer, &self.operand.address, self.change.before);
        say!(
            *event at Info,
            who = %peer.name,
            uid = peer.uid,
            pid = peer.pid,
            what = %self.operand.tag.as_ref().unwrap_or(address),
            %address,
            %before,
            %after,
            "{peer} {words}"
        );
    }
}

impl WaitingWrite {
    /// The note of a write that waits for the next scan.
    pub fn note(self) -> String {
        let (written, period) = (self.written, span(self.period.as_nanos() as u64));
        format!("{written} is written with the next scan; a scan comes every {period}")
    }
}
