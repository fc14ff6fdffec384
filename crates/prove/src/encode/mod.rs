//! The operations of a model's scan as gates.
//!
//! Executes the scan order as the engine does, with literals in place of values: each element and
//! each operation is executed under a guard, the condition under which the engine executes it, and
//! a write becomes a choice between the new and the old value. The files mirror those of the
//! engine. A cell gets a latch when it is read before it is written in the scan; a cell that
//! nothing writes is a constant. What has no gates is a [cut](crate::gates::GateCut): any value.
//!
//! Every `match` over kinds of operations names them all: a new operation does not compile until it
//! has gates or is a cut.

mod acc_forms;
mod arrays;
mod blocks;
mod calls;
mod control;
mod counters;
mod encoder;
mod evaluation;
mod events;
mod formula;
mod held;
mod latches;
mod logic;
mod machine;
mod math;
mod memory;
mod number;
mod operators;
mod ops;
mod sensaphone;
mod start;
mod status;
mod termination;
mod timers;
mod value;
mod written;

use crate::aig::Literal;
use crate::gates::{Gates, Latch};
use crate::model::{ProofModel, UNEVEN_PERIOD};
pub use acc_forms::AccForm;
use encoder::Encoder;
use held::{Next, OwnedLatch};
use rungd_engine::{BitCell, Cell, Engine, EngineProgram, Image, WordCell};
use rustc_hash::FxHashSet;
use start::Start;
use written::WrittenCells;

/// A model as gates, with the values of all cells.
#[derive(Clone, Debug, Default)]
pub struct Encoding {
    /// The gates.
    pub gates: Gates,
    /// The bits that the scan reads or writes, with their values at its end.
    pub bits: Vec<(BitCell, Literal)>,
    /// The words that the scan reads or writes, with their contents at its end, the lowest bit
    /// first; the highest is the sign.
    pub words: Vec<(WordCell, Vec<Literal>)>,
    /// The words that are not held as the engine holds them.
    pub acc_forms: Vec<(WordCell, AccForm)>,
}

/// The gates of one scan of a model.
pub fn encode(model: &ProofModel) -> Gates {
    encode_cells(model).gates.without_constants()
}

/// The least and the greatest value that operations write to a word, and its value before them;
/// `None`: nothing writes it.
pub(crate) fn written_limits(
    code: &EngineProgram,
    start: &Image,
    word: WordCell,
) -> Option<[i32; 2]> {
    let limits = WrittenCells::of(code, start).word(word)?.with(start.word(word));
    Some([limits.low, limits.high])
}

/// Why the start of a model has no gates; `None`: it has.
pub(crate) fn obstacle(model: &ProofModel) -> Option<&'static str> {
    match model.period.whole_ms() {
        Some(_) => Start::of(model).obstacle(),
        None => Some(UNEVEN_PERIOD),
    }
}

/// Whether an operation of a program may write each bit.
pub(crate) fn written_bits(code: &EngineProgram) -> Vec<bool> {
    let engine = Engine::new(code.clone());
    let written = WrittenCells::of(code, engine.image());
    (0..code.bit_count).map(|bit| written.has_bit(BitCell(bit))).collect()
}

/// The gates of one scan of a model, with the values of all cells.
pub fn encode_cells(model: &ProofModel) -> Encoding {
    let start = Start::of(model);
    // Private cells that hold a value from one scan to the next; found by trial.
    let mut kept = FxHashSet::default();
    loop {
        let mut encoder = Encoder::new(model, &start, &kept);
        encoder.scan();
        let (encoding, lasting) = encoder.finish();
        if lasting.is_empty() {
            return encoding;
        }
        kept.extend(lasting);
    }
}

impl Encoder<'_> {
    /// Encodes one scan.
    fn scan(&mut self) {
        let last = self.begin_last_scan();
        self.turns(last);
        for bit in &self.model.assumed {
            let assumed = self.bit(bit.0);
            self.constrain(assumed);
        }
    }

    /// The encoding, and the private cells that were wrongly taken for passing values.
    fn finish(mut self) -> (Encoding, FxHashSet<Cell>) {
        self.guard = Literal::TRUE;
        self.execution = 0;
        let judged: Vec<BitCell> = self.model.judged.clone();
        let judged: Vec<Literal> = judged.iter().map(|bit| self.bit(bit.0)).collect();
        self.end_ages();
        let shown = self.shown();
        self.end_events();
        self.end_last_scan();
        let mut latches = Vec::new();
        // The next value of a latch may be that of a cell whose latch is made here.
        while latches.len() < self.latches.len() {
            let made = self.latches[latches.len()];
            let next = self.next(made.next);
            let OwnedLatch { literal, initial, holds, .. } = made;
            latches.push(Latch { literal, next, initial: Some(initial), holds });
        }
        let mut acc_forms: Vec<(WordCell, AccForm)> =
            self.acc_forms.iter().map(|(word, form)| (WordCell(*word), *form)).collect();
        acc_forms.sort_unstable_by_key(|(word, _)| *word);
        let encoding = Encoding {
            acc_forms,
            gates: Gates {
                latches,
                inputs: self.inputs,
                constraints: self.constraints,
                judged,
                free: self.free,
                cuts: self.cuts,
                graph: self.graph,
            },
            ..shown
        };
        (encoding, self.lasting)
    }

    /// The values of all cells at the end of the scan.
    fn shown(&self) -> Encoding {
        let is_passing = |cell: &Cell| self.passing.contains_key(cell);
        let bits = (0..).map(BitCell).zip(&self.bits);
        let bits = bits.filter_map(|(cell, value)| value.map(|value| (cell, value)));
        let mut words: Vec<(WordCell, Vec<Literal>)> = (self.words.iter())
            .map(|(cell, number)| (WordCell(*cell), number.bits().to_vec()))
            .filter(|(cell, _)| !is_passing(&Cell::Word(*cell)))
            .collect();
        words.sort_unstable_by_key(|(cell, _)| *cell);
        let bits = bits.filter(|(cell, _)| !is_passing(&Cell::Bit(*cell))).collect();
        Encoding { bits, words, ..Encoding::default() }
    }

    fn next(&mut self, next: Next) -> Literal {
        match next {
            // Outside of every execution, the read finds a passing value that lasts.
            Next::Bit(BitCell(bit)) => self.bit(bit),
            Next::WordBit(WordCell(word), at) => self.word(word).bit(at.into()),
            Next::Own(held) => self.own(held),
            Next::OwnBit(number, at) => {
                let value = self.own_numbers.get(&number).expect("its latches were made");
                value.bit(at.into())
            }
            Next::Fixed(literal) => literal,
        }
    }
}
