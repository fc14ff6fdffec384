//! The lines in the log about an operand that an operator has changed.
//!
//! Called by `service` after the change. It changes nothing itself.

use std::fmt::Display;
use std::time::Duration;

use super::peer::OperatorPeer;
use rungd_base::duration_text::period_text;
use rungd_client::operator::operand::Variable;
use rungd_client::operator::protocol::BitOrNumber;
use rungd_runtime::command::StateBefore;
use rungd_runtime::events::{self, Event};
use rungd_runtime::exchange::Snapshot;
use rungd_runtime::say::say;

/// A change of an operand, and the user who made it.
#[derive(Clone, Copy)]
pub(super) struct LoggedOperandChange<'a> {
    peer: &'a OperatorPeer,
    operand: &'a Variable,
    was: PreviousState,
    reason: Option<&'a str>,
}

/// The state of an operand before a change.
#[derive(Clone, Copy, Debug)]
pub(super) struct PreviousState {
    pub value: BitOrNumber,
    pub forced: bool,
}

/// A write that no scan has seen yet.
#[derive(Clone, Copy)]
pub(super) struct WaitingWrite {
    pub written: BitOrNumber,
    /// The scan period.
    pub period: Duration,
}

impl PreviousState {
    /// The state of an operand in an image of its own program.
    pub fn of(operand: &Variable, image: &Snapshot) -> PreviousState {
        let value = operand.held(image.value(operand.cell));
        PreviousState { value, forced: image.forces.has(operand.cell) }
    }

    /// The state of an operand that the scan thread found before a command.
    pub fn found(operand: &Variable, before: StateBefore) -> PreviousState {
        PreviousState { value: operand.held(before.value), forced: before.forced }
    }
}

impl<'a> LoggedOperandChange<'a> {
    pub fn new(
        peer: &'a OperatorPeer,
        operand: &'a Variable,
        was: PreviousState,
    ) -> LoggedOperandChange<'a> {
        LoggedOperandChange { peer, operand, was, reason: None }
    }

    /// The same with the reason that was given.
    pub fn because(self, reason: Option<&'a str>) -> LoggedOperandChange<'a> {
        LoggedOperandChange { reason, ..self }
    }

    pub fn operand(self) -> &'a Variable {
        self.operand
    }

    /// Logs the change. `now`: the value after it.
    pub fn log(self, event: &Event, did: &str, now: BitOrNumber) {
        let PreviousState { value, forced } = self.was;
        let forced = if forced { ", forced" } else { "" };
        let [was, is] = [value, now].map(|value| self.operand.say_value(value));
        let words = format!("{did}: it was {was}{forced}, and is {is}");
        self.line(event, now, &words);
    }

    /// Logs a change of an operand that a reload has removed meanwhile: there is no value after it.
    pub fn log_removed(self, event: &Event, did: &str) {
        let value = self.operand.say_value(self.was.value);
        let words = format!("{did}: it was {value}; a reload has removed it meanwhile");
        self.line(event, "gone", &words);
    }

    /// Logs a write that no scan has seen yet. A further line follows only if none takes it.
    pub fn tell_waiting(self, write: WaitingWrite) {
        let (operand, note) = (self.operand, write.note());
        let before = operand.say_value(self.was.value);
        let words = format!("asked to write to {operand}: {note}; until then it is {before}");
        self.line(&events::OPERATOR_WRITE, write.written, &words);
    }

    /// Logs a line with these words, and with the values before and after.
    fn line(self, event: &Event, after: impl Display, words: &str) {
        let (peer, address, before) = (self.peer, &self.operand.address, self.was.value);
        let (reason, because) = (self.reason, because(self.reason));
        say!(
            *event at Info,
            who = %peer.name,
            uid = peer.uid,
            pid = peer.pid,
            what = %self.operand.tag.as_ref().unwrap_or(address),
            %address,
            %before,
            %after,
            reason,
            "{peer} {words}{because}"
        );
    }
}

/// The end of a sentence with the reason of a change.
pub(super) fn because(reason: Option<&str>) -> String {
    reason.map_or(String::new(), |reason| format!("; reason: {reason}"))
}

impl WaitingWrite {
    /// The note of a write that waits for the next scan.
    pub fn note(self) -> String {
        let (written, period) = (self.written, period_text(self.period.as_nanos() as u64));
        format!("{written} is written with the next scan; a scan comes every {period}")
    }
}
