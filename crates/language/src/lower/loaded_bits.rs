//! The bits of words that were copied to private bits and are still the same: the next contact on
//! such a bit reads the copy, so one operation serves all of them.
//!
//! `values` asks for a copy and keeps new ones, `assembler` reports every operation that follows. A
//! copy is valid within one element, which is a straight line of operations: up to an operation
//! that may write the word, and up to a control instruction, because CALL and the passes of HALT
//! write words of their own.

use std::collections::HashMap;

use rungd_engine::ops::{CellRange, Formulas, Op, TouchedCells};

/// The copies that are valid now.
#[derive(Debug, Default)]
pub(super) struct LoadedBits {
    /// By the cell of the word and the mask of the bit: the private bit.
    copies: HashMap<WordAndMask, u32>,
}

/// A bit of a word: the cell of the word, and the mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct WordAndMask {
    pub word: u32,
    pub mask: i32,
}

impl LoadedBits {
    /// The private bit with the present state of a bit of a word.
    pub fn copy(&self, bit: WordAndMask) -> Option<u32> {
        self.copies.get(&bit).copied()
    }

    /// Keeps a copy that was just made.
    pub fn keep(&mut self, bit: WordAndMask, cell: u32) {
        self.copies.insert(bit, cell);
    }

    /// Forgets the copies that an operation may make invalid.
    pub fn follow(&mut self, op: &Op, formulas: Formulas<'_>) {
        if self.copies.is_empty() {
            return;
        }
        if matches!(op, Op::Control(_)) {
            return self.clear();
        }
        let mut touches = TouchedCells { formulas, ..TouchedCells::default() };
        op.touches(&mut touches);
        let TouchedCells { words_written, word_arrays_written, .. } = touches;
        if words_written.is_empty() && word_arrays_written.is_empty() {
            return;
        }
        let is_in = |array: &CellRange, word: u32| word.wrapping_sub(array.first) < array.count;
        self.copies.retain(|bit, _| {
            !words_written.contains(&bit.word)
                && !word_arrays_written.iter().any(|array| is_in(array, bit.word))
        });
    }

    /// Forgets all copies: another element begins.
    pub fn clear(&mut self) {
        self.copies.clear();
    }
}

#[cfg(test)]
mod tests {
    use crate::lower::lower;
    use crate::resolve::{LoadOptions, load_ladders};
    use crate::source::span::SourceFile;

    /// The number of operations that load a bit of a word, in a ladder with these rungs.
    fn loads(rungs: &str) -> usize {
        let text = format!(
            "[tags]\nrow = {{ at = \"D20\", count = 4 }}\n[[program]]\nname = \"Main\"\nrung = [\n\
             {rungs}\n]\n[[subroutine]]\nname = \"Sub\"\nrung = [\n\
             {{ when = [\"D0.1\", \"D0.1\"], do = [\"MOVE 3 to=D0\"] }} ]\n"
        );
        let file = SourceFile { name: "a.toml".to_owned(), text };
        let (program, findings) = load_ladders(&[file], &LoadOptions::default());
        let program = program.unwrap_or_else(|| panic!("{findings:?}"));
        // The subroutine has one.
        lower(&program).0.tables.ops.load_word_bit.len() - 1
    }

    fn rung(when: &str, text: &str) -> String {
        format!("{{ when = [\"{when}\"], do = [\"{text}\"] }},\n")
    }

    #[test]
    fn a_bit_of_a_word_is_loaded_once_until_the_word_may_change() {
        let (first, again) = (rung("D0.1 & !D0.2", "OUT Y0"), rung("!D0.1 | D0.2", "OUT Y1"));
        let call = rung("X9", "CALL Sub");
        assert_eq!(loads(&(first.clone() + &again + &call)), 2);
        for (between, loaded) in [
            ("OUT C5", 2),
            ("MOVE 7 to=D1", 2),
            ("MOVE 7 to=row[D5]", 2),
            ("MATH D3 = D0 + 1", 2),
            ("MOVE 7 to=D0", 4),
            ("OUT D0.9", 4),
            ("MATH D0 = D3 + 1", 4),
            ("MATH D0.4 = X7 + 0", 4),
            ("COPY row to=D0..D3", 4),
            ("CALL Sub", 4),
        ] {
            let more = if between == "CALL Sub" { "" } else { &call };
            let all = first.clone() + &rung("X0", between) + &again + more;
            assert_eq!(loads(&all), loaded, "{between}");
        }
        let own = rung("row[1].3 & row[2].3", "MOVE 1 to=row[D5]") + &rung("row[1].3", "OUT Y2");
        assert_eq!(loads(&(own + &call)), 3);
    }
}
