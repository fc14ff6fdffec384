//! Checks that a cross-reference lists the same readers as the engine's operations have. The test
//! is in `draw::xref`, with every shipped ladder.

use std::collections::BTreeSet;

use crate::observe::Subject;
use rungd_engine::isa::OperandRole;
use rungd_engine::{BitCell, Cell, Stretches, WordCell};
use rungd_language::lower::sites::Site;

fn cells(of: &Stretches) -> impl Iterator<Item = Cell> + '_ {
    let bits = of.bits.iter().flat_map(|(first, count)| *first..first + count);
    let words = of.words.iter().flat_map(|(first, count)| *first..first + count);
    bits.map(|at| Cell::Bit(BitCell(at))).chain(words.map(|at| Cell::Word(WordCell(at))))
}

/// Compares, for each named cell, the parts of rungs whose operations read it with the listed
/// parts. Two kinds of reads are no uses: an operation may read the cell that it writes, to keep
/// its value, and a reset reads the preset of its counter.
pub(crate) fn compare(subject: &Subject, name: &str) -> usize {
    let uses = subject.uses();
    let read = subject.code().read_by_batches();
    let mut compared = 0;
    for named in subject.program().named(usize::MAX) {
        // Operations read `$On` and `$Off` in place of a missing leg.
        let Ok(cell) = subject.cell(&named.name) else { continue };
        if matches!(named.name.as_str(), "$On" | "$Off") {
            continue;
        }
        let listed: BTreeSet<u32> = uses.reading_parts(cell).into_iter().collect();
        let mut by_engine = BTreeSet::new();
        for (at, (read, written)) in read.iter().zip(&subject.batches).enumerate() {
            let Site { part, instruction } = subject.sites.batches[at];
            let instruction = instruction.and_then(|number| subject.instruction(part, number));
            let is_reset =
                instruction.is_some_and(|of| of.acting_role() == Some(OperandRole::Resets));
            if cells(read).any(|of| of == cell) && !written.has(cell) && !is_reset {
                by_engine.insert(part);
            }
        }
        let missing: Vec<&u32> = by_engine.difference(&listed).collect();
        assert!(missing.is_empty(), "{name}: {}: parts {missing:?} read it, too", named.name);
        compared += by_engine.len();
    }
    compared
}
