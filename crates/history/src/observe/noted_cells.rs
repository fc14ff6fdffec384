//! Memory as a run of a slice has last noted it: the cells that change, and the batches that are
//! due for that reason. Used by `slice_run`. Cells are numbered as in the wiring: bits first.

use rungd_engine::{BitCell, Cell, EngineState, Image, Layout, ScanStep, SliceCells, WordCell};

/// The cells that are compared at once with those of a state.
const COMPARED: usize = 64;

/// A change of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CellChange {
    /// The entry of the call.
    pub entry: u32,
    /// The number of the step; 0: the call itself.
    pub step: u32,
    /// The cell.
    pub cell: Cell,
    /// The step that made it; `None`: the call itself.
    pub by: Option<ScanStep>,
    /// The value before.
    pub before: i32,
    /// The value after.
    pub after: i32,
}

impl CellChange {
    /// The change of a cell; `None` if this is of a different cell. A change of a word may be one
    /// of its bit.
    pub fn cell_change(&self, cell: Cell) -> Option<CellChange> {
        let Cell::WordBit(bit) = cell else { return (self.cell == cell).then_some(*self) };
        let [before, after] = [self.before, self.after].map(|held| i32::from(bit.is_on(held)));
        let is_change = self.cell == Cell::Word(bit.word) && before != after;
        is_change.then_some(CellChange { cell, before, after, ..*self })
    }
}

/// The step of a call that may change cells.
#[derive(Clone, Copy)]
pub(super) struct ChangingStep {
    /// Its number; 0: the call itself.
    pub number: u32,
    /// The step; `None`: the call itself.
    pub by: Option<ScanStep>,
}

impl ChangingStep {
    /// The call itself.
    pub const CALL: ChangingStep = ChangingStep { number: 0, by: None };

    /// A step of a call.
    pub fn new(number: u32, by: ScanStep) -> ChangingStep {
        ChangingStep { number, by: Some(by) }
    }
}

/// Memory, and what changes in it.
pub(super) struct NotedCells {
    bits: Vec<u8>,
    words: Vec<i32>,
    /// One bit for each batch that may change something.
    pub due: Vec<u64>,
    /// By cell: whether its changes are reported.
    told: Vec<bool>,
    /// The reported changes of the call.
    pub changes: Vec<CellChange>,
    /// All cells that have changed in the call.
    pub numbers: Vec<u32>,
    /// Whether a cell may be forced.
    pub is_forced: bool,
    entry: u32,
}

impl NotedCells {
    /// The cells of a state. All of so many batches are due.
    pub fn new(state: &EngineState, batches: usize) -> NotedCells {
        let (bits, words) = (state.bits().to_vec(), state.words().to_vec());
        let told = vec![false; bits.len() + words.len()];
        let due = vec![u64::MAX; batches.div_ceil(64)];
        let (changes, numbers) = (Vec::new(), Vec::new());
        NotedCells { bits, words, due, told, changes, numbers, is_forced: false, entry: 0 }
    }

    /// Reports the changes of a cell.
    pub fn tell(&mut self, number: u32) {
        self.told[number as usize] = true;
    }

    /// Reports the changes of all public cells.
    pub fn tell_public(&mut self, layout: &Layout) {
        self.told[..layout.bit_count() as usize].fill(true);
        self.told[self.bits.len()..][..layout.word_count() as usize].fill(true);
    }

    /// Begins a call.
    pub fn begin(&mut self, entry: u32) {
        self.changes.clear();
        self.numbers.clear();
        self.entry = entry;
    }

    /// Continues from an image: the batches whose cells differ are due. A forced cell keeps its
    /// value whatever is written to it, so with forces all batches are due.
    pub fn resume(&mut self, wiring: &SliceCells, image: &Image) {
        self.begin(0);
        let mut differing = Vec::new();
        let bits = self.bits.chunks(COMPARED).zip(image.bits().chunks(COMPARED));
        for (at, _) in bits.enumerate().filter(|(_, (known, now))| known != now) {
            let first = at * COMPARED;
            differing.extend(first..self.bits.len().min(first + COMPARED));
        }
        let words = self.words.chunks(COMPARED).zip(image.words().chunks(COMPARED));
        for (at, _) in words.enumerate().filter(|(_, (known, now))| known != now) {
            let first = at * COMPARED;
            let end = self.words.len().min(first + COMPARED);
            differing.extend((first..end).map(|word| self.bits.len() + word));
        }
        for number in differing {
            self.note(number as u32, wiring, image, ChangingStep::CALL);
        }
        self.changes.clear();
        let is_forced = image.forces() > 0;
        if std::mem::replace(&mut self.is_forced, is_forced) || is_forced {
            self.due.fill(u64::MAX);
        }
    }

    /// The number of a cell; of a bit of a word, that of the word.
    pub fn number(&self, cell: Cell) -> u32 {
        match cell {
            Cell::Bit(BitCell(at)) => at,
            Cell::Word(WordCell(at)) => self.bits.len() as u32 + at,
            Cell::WordBit(bit) => self.number(Cell::Word(bit.word)),
        }
    }

    /// Notes a cell, if it has changed.
    pub fn note(&mut self, number: u32, wiring: &SliceCells, image: &Image, step: ChangingStep) {
        let at = number as usize;
        let (cell, before, after) = match at.checked_sub(self.bits.len()) {
            None => {
                let after = image.bits()[at];
                let before = std::mem::replace(&mut self.bits[at], after);
                (Cell::Bit(BitCell(number)), i32::from(before), i32::from(after))
            }
            Some(at) => {
                let after = image.words()[at];
                let before = std::mem::replace(&mut self.words[at], after);
                (Cell::Word(WordCell(at as u32)), before, after)
            }
        };
        if before == after {
            return;
        }
        self.touched(number, wiring);
        self.numbers.push(number);
        if self.told[at] {
            let (entry, ChangingStep { number: step, by }) = (self.entry, step);
            self.changes.push(CellChange { entry, step, cell, by, before, after });
        }
    }

    /// Marks all batches that touch a cell as due.
    pub fn touched(&mut self, number: u32, wiring: &SliceCells) {
        for batch in wiring.touching(number) {
            self.due[batch as usize / 64] |= 1 << (batch % 64);
        }
    }

    /// A batch executes.
    pub fn executes(&mut self, batch: u32) {
        self.due[batch as usize / 64] &= !(1 << (batch % 64));
    }
}
