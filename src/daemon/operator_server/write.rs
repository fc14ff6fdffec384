//! Writes a bit or a word for an operator, or for a user of a page.
//!
//! Called by `service`. A page writes only what `[web] write` lists, in the program that the scan
//! executes when it takes the write: a write of a page is for the program with whose list it was
//! checked, and a reload that comes before the scan refuses it.

use std::time::Duration;

use tokio::time::timeout;

use super::logged_change::{LoggedOperandChange, PreviousState, WaitingWrite};
use super::peer::PeerRequest;
use super::refused::{denied, no_answer, not_after_reload, not_for_pages, not_taken, tell_refused};
use super::service::OperatorService;
use rungd_client::operator::deadline::NEVER_NS;
use rungd_client::operator::operand::Variable;
use rungd_client::operator::protocol::{
    ChangedOperand, GivenValue, RefusalKind, RequestRefusal, RequestResult,
};
use rungd_engine::Cell;
use rungd_runtime::Origin;
use rungd_runtime::command::CommandDenial;
use rungd_runtime::events;
use rungd_runtime::exchange::{BatchRefusal, BatchTerms, OperandWrite, Snapshot, Ticket};

/// The longest period at which a write is answered only after the scan that sees it.
const PERIOD_AWAITED_MAX: Duration = Duration::from_secs(1);

impl OperatorService {
    pub(super) async fn write(
        &self,
        asker: &PeerRequest,
        text: &str,
        given: &GivenValue,
        from_page: bool,
    ) -> RequestResult<ChangedOperand> {
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
        let (was, written) = (PreviousState::of(&operand, &before), operand.held(value));
        let told = LoggedOperandChange::new(&asker.peer, &operand, was);
        let seen = match self.taken(ticket, is_long).await? {
            WriteResult::Overtaken if from_page => return Err(not_after_reload(text)),
            WriteResult::Overtaken => None,
            WriteResult::Seen => Some(true),
            WriteResult::Waits => Some(false),
        };
        let Some((seen, sight)) = seen.zip(self.sight(&operand)) else {
            // A scan may have taken the write before the reload, unless the batch was refused.
            let asked = format!("asked to write {written} to {operand}");
            told.log_removed(&events::OPERATOR_WRITE, &asked);
            return Err(denied(CommandDenial::Gone));
        };
        let note = if seen {
            let did = format!("wrote {written} to {operand}");
            told.log(&events::OPERATOR_WRITE, &did, sight.shown().value);
            sight.note(written, &before)
        } else {
            let write = WaitingWrite { written, period };
            told.tell_waiting(write);
            self.tell_if_lost(ticket, asker, &operand);
            Some(write.note())
        };
        Ok(ChangedOperand { note, ..sight.change(was) })
    }

    /// Waits for the scan that takes a write, or for a moment if its scan is far away.
    async fn taken(&self, ticket: Ticket, is_long: bool) -> RequestResult<WriteResult> {
        let patience = if is_long { PERIOD_AWAITED_MAX } else { self.wait() };
        match timeout(patience, self.port.done(ticket)).await {
            Ok(Ok(())) => Ok(WriteResult::Seen),
            Ok(Err(BatchRefusal::Overtaken)) => Ok(WriteResult::Overtaken),
            Ok(Err(why)) => Err(not_taken(why, &self.port)),
            Err(_) if is_long => Ok(WriteResult::Waits),
            Err(_) => Err(no_answer()),
        }
    }

    /// Logs if the scan that was far away does not take a write after all.
    fn tell_if_lost(&self, ticket: Ticket, asker: &PeerRequest, operand: &Variable) {
        let (port, done) = (self.port.clone(), self.port.done(ticket));
        let (peer, what) = (asker.peer.clone(), operand.operand.clone());
        tokio::spawn(async move {
            let Err(why) = done.await else { return };
            let why = match why == BatchRefusal::Overtaken {
                true => not_after_reload(&what),
                false => not_taken(why, &port),
            };
            let how = format!(" by the scan that it waited for: {}", why.message);
            tell_refused(&peer, &what, &how);
        });
    }
}

/// What became of a write.
enum WriteResult {
    /// A scan has seen it.
    Seen,
    /// A reload came first.
    Overtaken,
    /// Its scan is still to come.
    Waits,
}

fn refuse_forced(text: &str, operand: &Variable, before: &Snapshot) -> RequestResult<()> {
    if !before.forces.has(operand.cell) {
        return Ok(());
    }
    let message = format!(
        "`{text}` is forced to {}, and a write to it is discarded: unforce it first",
        operand.held(before.value(operand.cell))
    );
    Err(RequestRefusal::new(RefusalKind::Refused, message))
}

fn write_of(operand: &Variable, value: i32) -> OperandWrite {
    match (operand.input(), operand.cell) {
        (Some(x), _) => OperandWrite::Input(x, value != 0),
        (None, Cell::Bit(cell)) => OperandWrite::Bit(cell, value != 0),
        (None, Cell::Word(cell)) => OperandWrite::Word(cell, value),
    }
}
