//! An index by cell: the things that may write, or read, each cell.

use std::collections::HashMap;

use rungd_engine::{BitCell, Cell, Stretches, WordCell};

/// The longest stretch whose cells are listed one by one.
const LISTED_MAX: u32 = 16;

/// Things, indexed by the cells that they touch.
#[derive(Debug)]
pub(super) struct CellIndex<T> {
    /// The things that touch a cell, each with its number.
    listed: HashMap<Cell, Vec<(u32, T)>>,
    /// For each word, the things that touch one of its bits alone.
    bits: HashMap<WordCell, Vec<(u32, T)>>,
    /// The things that touch whole arrays.
    wide: Vec<(T, Stretches)>,
}

impl<T: Copy + PartialEq> CellIndex<T> {
    /// Makes the index of all things, each with the cells that it touches.
    pub fn new<'s>(all: impl Iterator<Item = (T, &'s Stretches)>) -> CellIndex<T> {
        let mut index =
            CellIndex { listed: HashMap::new(), bits: HashMap::new(), wide: Vec::new() };
        (0..).zip(all).for_each(|(number, (thing, touched))| index.add(number, thing, touched));
        index
    }

    fn add(&mut self, number: u32, thing: T, touched: &Stretches) {
        let mut all = touched.bits.iter().chain(&touched.words);
        if all.any(|(_, count)| *count > LISTED_MAX) {
            return self.wide.push((thing, touched.clone()));
        }
        for (first, count) in &touched.bits {
            for at in *first..first + count {
                self.listed.entry(Cell::Bit(BitCell(at))).or_default().push((number, thing));
            }
        }
        for (first, count) in &touched.words {
            for at in *first..first + count {
                self.listed.entry(Cell::Word(WordCell(at))).or_default().push((number, thing));
            }
        }
        for bit in &touched.word_bits {
            self.listed.entry(Cell::WordBit(*bit)).or_default().push((number, thing));
            self.bits.entry(bit.word).or_default().push((number, thing));
        }
    }

    /// The things that touch a cell: a word with its bits, and a bit with its word.
    pub fn entries(&self, cell: Cell) -> Vec<T> {
        let more = match cell {
            Cell::Bit(_) => None,
            Cell::Word(word) => self.bits.get(&word),
            Cell::WordBit(_) => self.listed.get(&cell.whole()),
        };
        let listed = self.listed.get(&cell).into_iter().chain(more);
        let mut listed: Vec<(u32, T)> = listed.flatten().copied().collect();
        listed.sort_by_key(|(number, _)| *number);
        let listed = listed.into_iter().map(|(_, thing)| thing);
        let wide =
            self.wide.iter().filter(|(_, touched)| touched.has(cell)).map(|(thing, _)| *thing);
        let mut all: Vec<T> = listed.chain(wide).collect();
        all.dedup();
        all
    }
}
