//! The line in the log about a change: the writes of one operator that one scan has taken.
//!
//! Called by `write`. A change of one operand has the line of every change of an operand; a change
//! of several has one line too, whose fields are lists.

use std::time::Duration;

use super::logged_change::{LoggedOperandChange, PreviousState, WaitingWrite, because};
use super::peer::OperatorPeer;
use rungd_base::duration_text::period_text;
use rungd_client::operator::operand::Variable;
use rungd_client::operator::protocol::BitOrNumber;
use rungd_runtime::events;
use rungd_runtime::say::say;

/// The most writes that a line names. The scan log has all of them.
const NAMED_MAX: usize = 32;

/// A write of a change.
#[derive(Clone, Copy)]
pub(super) struct LoggedWrite<'a> {
    pub operand: &'a Variable,
    pub was: PreviousState,
    pub written: BitOrNumber,
}

impl LoggedWrite<'_> {
    /// The written value, with its text.
    fn said(&self) -> String {
        self.operand.say_value(self.written)
    }
}

/// The writes of a change, and the user who made it.
pub(super) struct LoggedWrites<'a> {
    peer: &'a OperatorPeer,
    writes: Vec<LoggedWrite<'a>>,
    reason: Option<&'a str>,
}

impl<'a> LoggedWrites<'a> {
    pub fn new(
        peer: &'a OperatorPeer,
        writes: impl Iterator<Item = LoggedWrite<'a>>,
    ) -> LoggedWrites<'a> {
        LoggedWrites { peer, writes: writes.collect(), reason: None }
    }

    /// The same with the reason that was given.
    pub fn because(self, reason: Option<&'a str>) -> LoggedWrites<'a> {
        LoggedWrites { reason, ..self }
    }

    /// The operands in a few words.
    pub fn what(&self) -> String {
        match self.writes.as_slice() {
            [] => String::new(),
            [one] => one.operand.operand.clone(),
            [first, rest @ ..] => format!("{} and {} more", first.operand.operand, rest.len()),
        }
    }

    /// Logs that a scan has taken the writes. `now`: the values after it, in the order of the
    /// writes.
    pub fn log(&self, now: impl Iterator<Item = BitOrNumber>) {
        let now: Vec<BitOrNumber> = now.collect();
        if let ([write], [now]) = (self.writes.as_slice(), now.as_slice()) {
            let did = format!("wrote {} to {}", write.said(), write.operand);
            return self.of_one(write).log(&events::OPERATOR_WRITE, &did, *now);
        }
        let each = |(write, now): (&LoggedWrite<'_>, &BitOrNumber)| {
            let operand = write.operand;
            let [was, is] = [write.was.value, *now].map(|value| operand.say_value(value));
            format!("{} to {operand} (it was {was}, and is {is})", write.said())
        };
        let did = listed(self.writes.iter().zip(&now).map(each), self.writes.len());
        let after: Vec<String> = now.iter().map(BitOrNumber::to_string).collect();
        self.line(&format!("wrote in one change {did}"), &after);
    }

    /// Logs that a reload came first, or has removed an operand.
    pub fn log_removed(&self) {
        if let [write] = self.writes.as_slice() {
            let asked = format!("asked to write {} to {}", write.said(), write.operand);
            return self.of_one(write).log_removed(&events::OPERATOR_WRITE, &asked);
        }
        let asked = self.asked();
        self.line(&format!("{asked}; a reload has removed an operand meanwhile"), &["gone".into()]);
    }

    /// Logs writes that no scan has seen yet. A further line follows only if none takes them.
    pub fn log_waiting(&self, period: Duration) {
        if let [write] = self.writes.as_slice() {
            let write_of_one = WaitingWrite { written: write.written, period };
            return self.of_one(write).tell_waiting(write_of_one);
        }
        let (asked, period) = (self.asked(), period_text(period.as_nanos() as u64));
        let words =
            format!("{asked}: they are written with the next scan; a scan comes every {period}");
        let after: Vec<String> =
            self.writes.iter().map(|write| write.written.to_string()).collect();
        self.line(&words, &after);
    }

    fn asked(&self) -> String {
        let each = |write: &LoggedWrite<'_>| format!("{} to {}", write.said(), write.operand);
        let asked = listed(self.writes.iter().map(each), self.writes.len());
        format!("asked to write in one change {asked}")
    }

    fn of_one(&self, write: &LoggedWrite<'a>) -> LoggedOperandChange<'a> {
        LoggedOperandChange::new(self.peer, write.operand, write.was).because(self.reason)
    }

    /// Logs a line with these words, and with the values before and after.
    fn line(&self, words: &str, after: &[String]) {
        let (peer, count) = (self.peer, self.writes.len());
        let list =
            |text: &dyn Fn(&LoggedWrite<'_>) -> String| listed(self.writes.iter().map(text), count);
        let what = list(&|write| {
            let Variable { tag, address, .. } = write.operand;
            tag.as_ref().unwrap_or(address).clone()
        });
        let address = list(&|write| write.operand.address.clone());
        let before = list(&|write| write.was.value.to_string());
        let after = listed(after.iter().cloned(), after.len());
        let (reason, because) = (self.reason, because(self.reason));
        say!(
            OPERATOR_WRITE,
            who = %peer.name,
            uid = peer.uid,
            pid = peer.pid,
            what,
            address,
            before,
            after,
            reason,
            "{peer} {words}{because}"
        );
    }
}

/// The first texts of a list, and how many more there are.
fn listed(texts: impl Iterator<Item = String>, count: usize) -> String {
    let mut list = texts.take(NAMED_MAX).collect::<Vec<_>>().join(", ");
    if count > NAMED_MAX {
        list.push_str(&format!(", and {} more", count - NAMED_MAX));
    }
    list
}
