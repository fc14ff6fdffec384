//! Checks a state and calls from outside against a program. A value that no execution can produce
//! is refused, so that no operation encounters it.
//!
//! `record` calls these checks before it executes a recording, which may come from anywhere.
//! `state` checks the shape of a state, `state_bytes` checks its bytes. The scan thread does not
//! need the checks.

use std::ops::Range;

use super::call::EngineCall;
use super::events::Element;
use super::image::{BitCell, WordCell};
use super::layout::{Cell, Layout};
use super::program::{BlockRole, EngineProgram};
use super::state::EngineState;
use crate::isa::space::SENSAPHONE_COUNT;
use crate::isa::{Structure, Word, WordSpace};

/// The upper limit of times, ns: 146 years after the start of the machine. So no sum of two times
/// overflows.
pub const TIME_END_NS: u64 = 1 << 62;

/// The longest interval of a Task, ns.
pub(super) const INTERVAL_MAX_NS: u64 = i32::MAX as u64 * 1_000_000;

impl EngineState {
    /// Whether it can be a state of a program: its shape and its constants are those of the
    /// program, only public cells are forced, and every word is within the range of its memory.
    pub(crate) fn is_of(&self, program: &EngineProgram) -> bool {
        let layout = &program.layout;
        let public = (layout.bit_count() as usize, layout.word_count() as usize);
        let constants =
            program.initial_words.iter().filter(|(cell, _)| cell.0 as usize >= public.1);
        self.fits(program)
            && self.callers.iter().flatten().all(|element| program.has_turn(*element))
            && !self.forced_bits[public.0..].contains(&true)
            && !self.forced_words[public.1..].contains(&true)
            && constants.clone().all(|(cell, value)| self.words[cell.0 as usize] == *value)
            && layout.narrow_words().iter().all(|(cells, (low, high))| {
                let words = &self.words[cells.start as usize..cells.end as usize];
                words.iter().all(|word| (low..=high).contains(&word))
            })
    }
}

impl EngineProgram {
    /// Whether an element can have a turn.
    fn has_turn(&self, element: Element) -> bool {
        match element {
            Element::Block(id) => {
                let block = self.blocks.get(id.0 as usize);
                block.is_some_and(|block| block.role != BlockRole::Subroutine)
            }
            Element::Stage(id) => (id.0 as usize) < self.stages.len(),
        }
    }

    /// Whether the scan thread could make this call: for a public cell, with a value in its range.
    pub fn has(&self, call: EngineCall) -> bool {
        let (cell, value) = match call {
            EngineCall::Write(cell, value) | EngineCall::Force(cell, value) => (cell, Some(value)),
            EngineCall::Release(cell) => (cell, None),
            EngineCall::Start { .. }
            | EngineCall::RequestStop
            | EngineCall::Begin { .. }
            | EngineCall::Execute
            | EngineCall::Terminate => return true,
        };
        match cell {
            Cell::Bit(BitCell(at)) => at < self.layout.bit_count(),
            // A bit of a word is never forced.
            Cell::WordBit(bit) => {
                let address = self.layout.address(cell);
                matches!(call, EngineCall::Write(..))
                    && address.and_then(|address| self.layout.cell(address)) == Some(cell)
                    && bit.word.0 < self.layout.word_count()
            }
            Cell::Word(WordCell(at)) => {
                let narrow = self.layout.narrow_words();
                let range = narrow.into_iter().find(|(cells, _)| cells.contains(&at));
                let fits =
                    |value: i32| range.is_none_or(|(_, (low, high))| (low..=high).contains(&value));
                at < self.layout.word_count() && value.is_none_or(fits)
            }
        }
    }
}

impl Layout {
    /// The words whose range is smaller than 32 bits, with their least and greatest content.
    fn narrow_words(&self) -> [(Range<u32>, (i32, i32)); 6] {
        let run = |first: Word, count: u32| {
            let WordCell(at) = self.word(first);
            (at..at + count, first.range())
        };
        let space =
            |space: WordSpace| run(Word::Space(space, space.first()), space.count(self.sizes()));
        [
            space(WordSpace::V),
            space(WordSpace::R),
            space(WordSpace::Mhr),
            space(WordSpace::Mir),
            run(Word::Acc(Structure::Sensaphone(0)), SENSAPHONE_COUNT),
            run(Word::Pre(0), SENSAPHONE_COUNT),
        ]
    }
}
