//! The walk of a scan: the steps of the engine as steps of the program.
//!
//! Executes one call of an engine and tells a [`Witness`] of each rung part when its contacts are
//! evaluated, and of each step before and after. `why` watches a cell with it; coverage and a live
//! picture of the ladder can use it as it is. The engine executes a slice of the program, which may
//! be all of it; a witness gets the steps of the whole program. The steps of a call have numbers,
//! the same whenever the call is executed from the same state.

use super::step_numbers::StepNumbers;
use super::subject::Subject;
use crate::engine::{Deed, Engine, EngineCall, Eye, Image, Slice};

/// Sees a scan rung by rung. What a witness does not want to see has an empty method.
pub(crate) trait Witness {
    /// Whether it wants to see contacts.
    const PARTS: bool = true;

    /// The contacts of a part of a rung are evaluated; its instructions execute next.
    fn part(&mut self, _part: u32, _number: u32, _image: &Image) {}

    /// A step begins.
    fn before(&mut self, _deed: Deed, _number: u32, _image: &Image) {}

    /// A step has ended. A turn and a block's or Stage's execution end with a new number.
    fn after(&mut self, _deed: Deed, _number: u32, _image: &Image) {}
}

/// The eye of a witness.
struct Walk<'a, W> {
    subject: &'a Subject,
    slice: &'a Slice,
    witness: &'a mut W,
    numbers: StepNumbers,
}

/// Makes a call of an engine of a slice; a scan and the passes are seen.
pub(crate) fn walk(
    (subject, slice): (&Subject, &Slice),
    engine: &mut Engine,
    call: EngineCall,
    witness: &mut impl Witness,
) {
    engine.apply_seen(call, &mut Walk { subject, slice, witness, numbers: StepNumbers::default() });
}

impl<W: Witness> Eye for Walk<'_, W> {
    fn before(&mut self, deed: Deed, image: &Image) {
        let number = self.numbers.before(deed, self.slice);
        if let Deed::Batch(at) = deed
            && W::PARTS
        {
            for part in self.subject.ready_at(self.slice.places[at as usize].clone()) {
                self.witness.part(part, number, image);
            }
        }
        self.witness.before(self.slice.whole(deed), number, image);
    }

    fn after(&mut self, deed: Deed, image: &Image) {
        let number = self.numbers.after(deed);
        self.witness.after(self.slice.whole(deed), number, image);
    }
}
