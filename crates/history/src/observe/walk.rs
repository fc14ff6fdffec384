//! The walk of a scan: turns the steps of the engine into steps of the program.
//!
//! Executes one call of an engine and calls a [`Witness`] when the contacts of a rung part have
//! been evaluated, and before and after each step. `why`, coverage and the live picture of a ladder
//! use it. The engine executes a slice of the program, which may be the whole program; a witness
//! receives the steps of the whole program. The steps of a call are numbered; the numbers are the
//! same whenever the call is executed from the same state.

use super::step_numbers::StepNumbers;
use super::subject::Subject;
use rungd_engine::{Engine, EngineCall, Image, ScanObserver, ScanStep, Slice};

/// Observes a scan rung by rung. The default methods do nothing.
pub(crate) trait Witness {
    /// Whether the witness needs the contacts.
    const PARTS: bool = true;

    /// The contacts of a part of a rung have been evaluated; its instructions execute next.
    fn part(&mut self, _part: u32, _number: u32, _image: &Image) {}

    /// A step begins.
    fn before(&mut self, _deed: ScanStep, _number: u32, _image: &Image) {}

    /// A step has ended. The end of a turn, block or Stage has a new number.
    fn after(&mut self, _deed: ScanStep, _number: u32, _image: &Image) {}
}

/// The engine's eye that calls a witness.
struct WitnessWalk<'a, W> {
    subject: &'a Subject,
    slice: &'a Slice,
    witness: &'a mut W,
    numbers: StepNumbers,
}

/// A program of which a slice is executed.
#[derive(Clone, Copy)]
pub(crate) struct WalkedProgram<'a> {
    pub subject: &'a Subject,
    pub slice: &'a Slice,
}

/// Makes a call of the engine of a slice; the witness observes a scan and the passes.
pub(crate) fn walk(
    WalkedProgram { subject, slice }: WalkedProgram<'_>,
    engine: &mut Engine,
    call: EngineCall,
    witness: &mut impl Witness,
) {
    engine.apply_seen(
        call,
        &mut WitnessWalk { subject, slice, witness, numbers: StepNumbers::default() },
    );
}

impl<W: Witness> ScanObserver for WitnessWalk<'_, W> {
    fn before(&mut self, deed: ScanStep, image: &Image) {
        let number = self.numbers.before(deed, self.slice);
        if let ScanStep::Batch(at) = deed
            && W::PARTS
        {
            for part in self.subject.ready_at(self.slice.places[at as usize].clone()) {
                self.witness.part(part, number, image);
            }
        }
        self.witness.before(self.slice.whole(deed), number, image);
    }

    fn after(&mut self, deed: ScanStep, image: &Image) {
        let number = self.numbers.after(deed);
        self.witness.after(self.slice.whole(deed), number, image);
    }
}
