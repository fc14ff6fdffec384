//! Writes bits and words for an operator, or for a user of a page.
//!
//! Called by `service`. A change is one batch of writes: they are checked whole, and one scan takes
//! all of them or none. A page writes only what `[web] write` lists, in the program that the scan
//! executes when it takes the write: a write of a page is for the program with whose list it was
//! checked, and a reload that comes before the scan refuses it.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::timeout;

use super::logged_change::{PreviousState, WaitingWrite};
use super::logged_writes::{LoggedWrite, LoggedWrites};
use super::page_rights::{WriteTerms, judge_reason, judge_right};
use super::peer::PeerRequest;
use super::refused::{denied, no_answer, not_after_reload, not_for_holds, not_taken, tell_refused};
use super::service::OperatorService;
use super::set_mistakes::{NamedPlaces, SetMistakes, wrong_count};
use super::status::ProgramView;
use rungd_client::operator::deadline::NEVER_NS;
use rungd_client::operator::operand::Variable;
use rungd_client::operator::protocol::{
    ChangedOperand, ChangedOperands, GivenValue, GivenWrite, RefusalKind, RequestRefusal,
    RequestResult, WRITES_MAX,
};
use rungd_engine::Cell;
use rungd_runtime::Origin;
use rungd_runtime::command::CommandDenial;
use rungd_runtime::exchange::{BatchRefusal, BatchTerms, OperandWrite, Snapshot, Ticket};
use rungd_runtime::hold_step::HoldStep;

/// The longest period at which a write is answered only after the scan that sees it.
const PERIOD_AWAITED_MAX: Duration = Duration::from_secs(1);

/// The writes of one change, checked.
struct CheckedWrites<'a> {
    /// The image whose program the writes belong to.
    before: Arc<Snapshot>,
    /// How it is asked for. The writes of a page are for this program only.
    terms: WriteTerms<'a>,
    writes: Vec<CheckedWrite>,
    hold: Option<HoldStep>,
}

/// A write that has begun a hold.
pub(super) struct HeldWrite {
    pub hold: Ticket,
    pub operand: Variable,
    pub change: ChangedOperand,
}

/// What became of the writes of a change.
struct CarriedWrites {
    ticket: Ticket,
    /// In the order of the writes.
    operands: Vec<ChangedOperand>,
}

/// A write whose operand takes the value.
struct CheckedWrite {
    operand: Variable,
    value: i32,
    was: PreviousState,
}

impl OperatorService {
    /// Writes one operand.
    pub(super) async fn write(
        &self,
        asker: &PeerRequest,
        write: &GivenWrite,
        terms: WriteTerms<'_>,
    ) -> RequestResult<ChangedOperand> {
        judge_reason(terms)?;
        let (before, view) = self.seen();
        let checked = checked(&view, &before, write, terms)?;
        let writes = vec![checked];
        let checked = CheckedWrites { before, terms, writes, hold: None };
        let mut changes = self.carry_out(asker, checked).await?.operands;
        changes.pop().ok_or_else(|| denied(CommandDenial::Gone))
    }

    /// Turns a bit ON, and holds it until the deadline of the request.
    pub(super) async fn write_hold(
        &self,
        asker: &PeerRequest,
        operand: &str,
        terms: WriteTerms<'_>,
    ) -> RequestResult<HeldWrite> {
        judge_reason(terms)?;
        let (before, view) = self.seen();
        let write = GivenWrite { operand: operand.to_owned(), value: GivenValue::Bit(true) };
        let checked = checked(&view, &before, &write, terms)?;
        let operand = checked.operand.clone();
        if !view.pages.hold.contains(&operand.what) {
            return Err(not_for_holds(&operand.operand));
        }
        let hold = Some(HoldStep::Begin { until_ns: asker.until_ns });
        let checked = CheckedWrites { before, terms, writes: vec![checked], hold };
        let CarriedWrites { ticket, mut operands } = self.carry_out(asker, checked).await?;
        let change = operands.pop().ok_or_else(|| denied(CommandDenial::Gone))?;
        Ok(HeldWrite { hold: ticket, operand, change })
    }

    /// Writes several operands before one scan: all of them or none.
    pub(super) async fn write_set(
        &self,
        asker: &PeerRequest,
        writes: &[GivenWrite],
        terms: WriteTerms<'_>,
    ) -> RequestResult<ChangedOperands> {
        judge_reason(terms)?;
        if !(1..=WRITES_MAX).contains(&writes.len()) {
            return Err(wrong_count(writes.len()));
        }
        let (before, view) = self.seen();
        let mut checked_writes: Vec<CheckedWrite> = Vec::new();
        let (mut mistakes, mut places) = (SetMistakes::default(), NamedPlaces::default());
        for write in writes {
            let checked = checked(&view, &before, write, terms).and_then(|checked| {
                places.add(checked.operand.cell, &write.operand).map(|()| checked)
            });
            match checked {
                Ok(checked) => checked_writes.push(checked),
                Err(_) if mistakes.is_full() => return Err(mistakes.refusal(true)),
                Err(refusal) => {
                    mistakes.add(&write.operand, refusal);
                    // A refusal may have compared many names: other clients are served first.
                    tokio::task::yield_now().await;
                }
            }
        }
        if !mistakes.is_empty() {
            return Err(mistakes.refusal(false));
        }
        let checked = CheckedWrites { before, terms, writes: checked_writes, hold: None };
        Ok(ChangedOperands { changes: self.carry_out(asker, checked).await?.operands })
    }

    /// Hands in the writes as one batch, waits for their scan, and logs them as one change.
    async fn carry_out(
        &self,
        asker: &PeerRequest,
        checked: CheckedWrites<'_>,
    ) -> RequestResult<CarriedWrites> {
        let CheckedWrites { before, terms: WriteTerms { from_page, reason, .. }, writes, hold } =
            checked;
        let period = Duration::from_nanos(self.port.tempo().period_ns);
        let is_long = period > PERIOD_AWAITED_MAX;
        // A write whose scan is far away is answered before it: from then on it is agreed.
        let until_ns = if is_long { NEVER_NS } else { self.until_ns(asker) };
        let generation = before.generation;
        let terms = BatchTerms { generation, is_bound: from_page, until_ns, hold };
        let ticket = self.port.submit_by(terms, writes.iter().map(CheckedWrite::write).collect());
        let ticket = ticket.map_err(|why| not_taken(why, &self.port))?;
        self.port.sign(Origin::Batch(ticket), asker.peer.to_string());
        let told = LoggedWrites::new(&asker.peer, writes.iter().map(CheckedWrite::logged));
        let told = told.because(reason.map(str::trim));
        let seen = match self.taken(ticket, is_long).await? {
            WriteResult::Overtaken if from_page => return Err(not_after_reload(&told.what())),
            WriteResult::Overtaken => None,
            WriteResult::Seen => Some(true),
            WriteResult::Waits => Some(false),
        };
        let sights = self.sights(writes.iter().map(|write| &write.operand));
        let Some(seen) = seen.filter(|_| sights.iter().all(Option::is_some)) else {
            // A scan may have taken the writes before the reload, unless the batch was refused.
            told.log_removed();
            return Err(denied(CommandDenial::Gone));
        };
        let sights = sights.iter().flatten();
        if seen {
            told.log(sights.clone().map(|sight| sight.shown().value));
        } else {
            told.log_waiting(period);
            self.tell_if_lost(ticket, asker, told.what());
        }
        let changes = writes.iter().zip(sights).map(|(write, sight)| {
            let written = write.operand.held(write.value);
            let taken = seen && sight.is_taken(written, &before);
            let note = match seen {
                true => sight.note(written, &before),
                false => Some(WaitingWrite { written, period }.note()),
            };
            ChangedOperand { taken, note, ..sight.change(write.was) }
        });
        Ok(CarriedWrites { ticket, operands: changes.collect() })
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
    fn tell_if_lost(&self, ticket: Ticket, asker: &PeerRequest, what: String) {
        let (port, done) = (self.port.clone(), self.port.done(ticket));
        let peer = asker.peer.clone();
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
    // A forced word discards a write of one of its bits.
    if !before.forces.has(operand.cell.whole()) {
        return Ok(());
    }
    let message = format!(
        "`{text}` is forced to {}, and a write to it is discarded: unforce it first",
        operand.say_value(operand.held(before.value(operand.cell)))
    );
    Err(RequestRefusal::new(RefusalKind::Refused, message))
}

/// Checks one write: the operand takes the value, and nothing holds it.
fn checked(
    view: &ProgramView,
    before: &Snapshot,
    write: &GivenWrite,
    terms: WriteTerms<'_>,
) -> RequestResult<CheckedWrite> {
    let text = &write.operand;
    let operand = view.names.find_one(text)?;
    // The list of the image's program, so that no page writes by a list of before a reload.
    if terms.from_page {
        judge_right(&view.pages, &operand, terms)?;
    }
    operand.may_write()?;
    let value = view.names.number(&operand, &write.value)?;
    refuse_forced(text, &operand, before)?;
    let was = PreviousState::of(&operand, before);
    Ok(CheckedWrite { operand, value, was })
}

impl CheckedWrite {
    fn write(&self) -> OperandWrite {
        match (self.operand.input(), self.operand.cell) {
            (Some(x), _) => OperandWrite::Input(x, self.value != 0),
            (None, Cell::Bit(cell)) => OperandWrite::Bit(cell, self.value != 0),
            (None, Cell::Word(cell)) => OperandWrite::Word(cell, self.value),
            (None, Cell::WordBit(bit)) => OperandWrite::WordBit(bit, self.value != 0),
        }
    }

    fn logged(&self) -> LoggedWrite<'_> {
        let CheckedWrite { operand, value, was } = self;
        LoggedWrite { operand, was: *was, written: operand.held(*value) }
    }
}
