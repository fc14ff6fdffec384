//! An index by cell: the things that may write, or read, each cell.

use std::collections::HashMap;

use rungd_engine::{BitCell, Cell, Stretches, WordCell};

/// The longest stretch whose cells are listed one by one.
const LISTED_MAX: u32 = 16;

/// Things, indexed by the cells that they touch.
#[derive(Debug)]
pub(super) struct CellIndex<T> {
    listed: HashMap<Cell, Vec<T>>,
    /// The things that touch whole arrays.
    wide: Vec<(T, Stretches)>,
}

impl<T: Copy + PartialEq> CellIndex<T> {
    /// Makes the index of all things, each with the cells that it touches.
    pub fn new<'s>(all: impl Iterator<Item = (T, &'s Stretches)>) -> CellIndex<T> {
        let mut index = CellIndex { listed: HashMap::new(), wide: Vec::new() };
        all.for_each(|(thing, touched)| index.add(thing, touched));
        index
    }

    fn add(&mut self, thing: T, touched: &Stretches) {
        let mut all = touched.bits.iter().chain(&touched.words);
        if all.any(|(_, count)| *count > LISTED_MAX) {
            return self.wide.push((thing, touched.clone()));
        }
        for (first, count) in &touched.bits {
            for at in *first..first + count {
                self.listed.entry(Cell::Bit(BitCell(at))).or_default().push(thing);
            }
        }
        for (first, count) in &touched.words {
            for at in *first..first + count {
                self.listed.entry(Cell::Word(WordCell(at))).or_default().push(thing);
            }
        }
    }

    /// The things that touch a cell.
    pub fn of(&self, cell: Cell) -> Vec<T> {
        let listed = self.listed.get(&cell).into_iter().flatten().copied();
        let wide =
            self.wide.iter().filter(|(_, touched)| touched.has(cell)).map(|(thing, _)| *thing);
        let mut all: Vec<T> = listed.chain(wide).collect();
        all.dedup();
        all
    }
}
