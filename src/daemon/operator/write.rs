//! Writes a bit or a word for an operator, or for a user of a page.
//!
//! Called by `desk`. A page writes only what `[web] write` lists, in the program that the scan
//! executes when it takes the write: a write of a page is for the program with whose list it was
//! checked, and a reload that comes before the scan refuses it.

use std::time::Duration;

use tokio::time::timeout;

use super::desk::Desk;
use super::peer::Asker;
use super::refused::{denied, no_answer, not_after_reload, not_for_pages, not_taken, tell_refused};
use super::told_change::{ToldChange, WaitingWrite, Was};
use rungd_client::operator::deadline::NEVER_NS;
use rungd_client::operator::operand::Variable;
use rungd_client::operator::protocol::{Answered, Change, GivenValue, Refusal, RefusalKind};
use rungd_engine::Cell;
use rungd_runtime::Origin;
use rungd_runtime::command::Denial;
use rungd_runtime::events;
use rungd_runtime::exchange::{BatchTerms, Refused, Snapshot, Ticket, Write};

/// The longest period at which a write is answered only after the scan that sees it.
const PERIOD_AWAITED_MAX: Duration = Duration::from_secs(1);

impl Desk {
    pub(super) async fn write(
        &self,
        asker: &Asker,
        text: &str,
        (given, from_page): (&GivenValue, bool),
    ) -> Answered<Change> {
        let (before, view) = self.seen();
        let operand = view.names.find_one(text)?;
        // The list of the image's program, so that no page writes by a list of before a reload.
        if from_page && !view.pages_write.contains(&operand.what) {
            return Err(not_for_pages(text));
        }
        operand.may_write()?;
        let value = view.names.number(&operand, given)?;
        refuse_forced(text, &operand, &before)?;
        let period = Duration::from_nanos(self.port.tempo().period_ns);
        let is_long = period > PERIOD_AWAITED_MAX;
        // A write whose scan is far away is answered before it: from then on it is agreed.
        let until_ns = if is_long { NEVER_NS } else { self.until_ns(asker) };
        let terms = BatchTerms { generation: before.generation, is_bound: from_page, until_ns };
        let write = write_of(&operand, value);
        let ticket = self.port.submit_by(terms, vec![write]);
        let ticket = ticket.map_err(|why| not_taken(why, &self.port))?;
        self.port.sign(Origin::Batch(ticket), asker.peer.to_string());
        let (was, written) = (Was::of(&operand, &before), operand.held(value));
        let told = ToldChange::new(&asker.peer, &operand, was);
        let seen = match self.taken(ticket, is_long).await? {
            Taken::Overtaken if from_page => return Err(not_after_reload(text)),
            Taken::Overtaken => None,
            Taken::Seen => Some(true),
            Taken::Waits => Some(false),
        };
        let Some((seen, sight)) = seen.zip(self.sight(&operand)) else {
            // A scan may have taken the write before the reload, unless the batch was refused.
            let asked = format!("asked to write {written} to {operand}");
            told.tell_gone(&events::OPERATOR_WRITE, &asked);
            return Err(denied(Denial::Gone));
        };
        let note = if seen {
            let did = format!("wrote {written} to {operand}");
            told.tell(&events::OPERATOR_WRITE, &did, sight.shown().value);
            sight.note(written, &before)
        } else {
            let write = WaitingWrite { written, period };
            told.tell_waiting(write);
            self.tell_if_lost(ticket, asker, &operand);
            Some(write.note())
        };
        Ok(Change { note, ..sight.change(was) })
    }

    /// Waits for the scan that takes a write, or for a moment if its scan is far away.
    async fn taken(&self, ticket: Ticket, is_long: bool) -> Answered<Taken> {
        let patience = if is_long { PERIOD_AWAITED_MAX } else { self.wait() };
        match timeout(patience, self.port.done(ticket)).await {
            Ok(Ok(())) => Ok(Taken::Seen),
            Ok(Err(Refused::Overtaken)) => Ok(Taken::Overtaken),
            Ok(Err(why)) => Err(not_taken(why, &self.port)),
            Err(_) if is_long => Ok(Taken::Waits),
            Err(_) => Err(no_answer()),
        }
    }

    /// Logs if the scan that was far away does not take a write after all.
    fn tell_if_lost(&self, ticket: Ticket, asker: &Asker, operand: &Variable) {
        let (port, done) = (self.port.clone(), self.port.done(ticket));
        let (peer, what) = (asker.peer.clone(), operand.operand.clone());
        tokio::spawn(async move {
            let Err(why) = done.await else { return };
            let why = match why == Refused::Overtaken {
                true => not_after_reload(&what),
                false => not_taken(why, &port),
            };
            let how = format!(" by the scan that it waited for: {}", why.message);
            tell_refused(&peer, &what, &how);
        });
    }
}

/// What became of a write.
enum Taken {
    /// A scan has seen it.
    Seen,
    /// A reload came first.
    Overtaken,
    /// Its scan is still to come.
    Waits,
}

fn refuse_forced(text: &str, operand: &Variable, before: &Snapshot) -> Answered<()> {
    if !before.forces.has(operand.cell) {
        return Ok(());
    }
    let message = format!(
        "`{text}` is forced to {}, and a write to it is discarded: unforce it first",
        operand.held(before.value(operand.cell))
    );
    Err(Refusal::new(RefusalKind::Refused, message))
}

fn write_of(operand: &Variable, value: i32) -> Write {
    match (operand.input(), operand.cell) {
        (Some(x), _) => Write::Input(x, value != 0),
        (None, Cell::Bit(cell)) => Write::Bit(cell, value != 0),
        (None, Cell::Word(cell)) => Write::Word(cell, value),
    }
}
