//! Bits that are held ON while somebody presses a button.
//!
//! A batch that turns a bit ON may begin its hold, which has an end. Later batches put the end off.
//! They write nothing, so a bit that the ladder has turned OFF stays OFF. The first scan that
//! begins after the end turns the bit OFF before the ladder executes. So the end of a hold waits
//! for no process, no connection and no other thread. Used by `link` on the scan thread: nothing is
//! allocated, and the module has no clock.

use super::earlier::EarlierPrograms;
use super::exchange::{BatchRefusal, OperandWrite, WriteBatch};
use super::hold_step::{HOLDS_MAX, HoldStep};
use super::origin::Ticket;

/// The end of a hold: a write for the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EndedHold {
    /// The hold.
    pub hold: Ticket,
    /// Turns the bit OFF.
    pub off: OperandWrite,
}

/// All holds.
#[derive(Default)]
pub(super) struct Holds([Option<HeldBit>; HOLDS_MAX]);

/// A bit that is held, in the present program.
#[derive(Clone, Copy)]
struct HeldBit {
    hold: Ticket,
    off: OperandWrite,
    until_ns: u64,
}

impl Holds {
    /// Carries out the step of a batch in the scan of this moment. The writes of the batch have the
    /// cells of the present program.
    pub fn take(&mut self, batch: &WriteBatch, now_ns: u64) -> Result<(), BatchRefusal> {
        let Some(step) = batch.terms.hold else { return Ok(()) };
        match step {
            HoldStep::Begin { until_ns } => {
                let [write] = batch.writes.as_slice() else { return Err(BatchRefusal::NoHeldBit) };
                let off = turned_off(write).ok_or(BatchRefusal::NoHeldBit)?;
                let free = self.0.iter_mut().find(|place| place.is_none());
                *free.ok_or(BatchRefusal::HoldsFull)? =
                    Some(HeldBit { hold: batch.ticket, off, until_ns });
            }
            HoldStep::Keep { hold, until_ns } => {
                let held = self.held_bit(hold, now_ns).ok_or(BatchRefusal::HoldEnded)?;
                held.until_ns = held.until_ns.max(until_ns);
            }
            HoldStep::End { hold } => {
                self.held_bit(hold, now_ns).ok_or(BatchRefusal::HoldEnded)?.until_ns = 0;
            }
        }
        Ok(())
    }

    /// A hold that has not ended.
    fn held_bit(&mut self, hold: Ticket, now_ns: u64) -> Option<&mut HeldBit> {
        let mut all = self.0.iter_mut().flatten();
        all.find(|held| held.hold == hold && held.until_ns >= now_ns)
    }

    /// Takes a hold that has ended. A bit with a further hold stays ON.
    pub fn ended(&mut self, now_ns: u64) -> Option<EndedHold> {
        let is_over = |held: &HeldBit| held.until_ns < now_ns;
        loop {
            let place = self.0.iter_mut().find(|place| place.as_ref().is_some_and(is_over))?;
            let HeldBit { hold, off, .. } = place.take()?;
            if !self.0.iter().flatten().any(|other| other.off == off && !is_over(other)) {
                return Some(EndedHold { hold, off });
            }
        }
    }

    /// Ends all holds: a new RUN begins.
    pub fn end_all(&mut self) {
        self.0.iter_mut().flatten().for_each(|held| held.until_ns = 0);
    }

    /// Moves the holds into the program after that of this generation. A bit that it does not have
    /// is held no more.
    pub fn follow(&mut self, generation: u32, earlier: &EarlierPrograms) {
        for place in &mut self.0 {
            if let Some(held) = place
                && !earlier.is_renumbered(generation, &mut held.off)
            {
                *place = None;
            }
        }
    }
}

/// The write that turns the bit OFF again. `None`: the write turns no bit of memory ON.
fn turned_off(write: &OperandWrite) -> Option<OperandWrite> {
    match *write {
        OperandWrite::Bit(cell, true) => Some(OperandWrite::Bit(cell, false)),
        OperandWrite::WordBit(bit, true) => Some(OperandWrite::WordBit(bit, false)),
        OperandWrite::Bit(_, false)
        | OperandWrite::WordBit(_, false)
        | OperandWrite::Word(..)
        | OperandWrite::Masked { .. }
        | OperandWrite::Input(..) => None,
    }
}
