//! The operations of a model's scan as gates.
//!
//! Executes the scan order as the engine does, with literals in place of values: each element and
//! each operation is executed under a guard, the condition under which the engine executes it, and
//! a write becomes a choice between the new and the old value. The files mirror those of the
//! engine. A cell gets a latch when it is read before it is written in the scan; a cell that
//! nothing writes is a constant. What has no gates is a [`Cut`]: any value.
//!
//! Every `match` over kinds of operations names them all: a new operation does not compile until it
//! has gates or is a cut.

mod arrays;
mod blocks;
mod calls;
mod control;
mod counters;
mod formula;
mod latches;
mod logic;
mod math;
mod memory;
mod number;
mod operators;
mod ops;
mod sensaphone;
mod status;
mod termination;
mod timers;
mod value;
mod written;

use crate::aig::{Graph, Literal};
use crate::gates::{Cut, GateInput, Gates, Held, InputOf};
use crate::model::{FreeInput, Model};
use latches::{OwnNumber, OwnedLatch};
use number::Number;
use rungd_base::calendar::LocalTime;
use rungd_engine::isa::BlockId;
use rungd_engine::{BitCell, Cell, Element, Engine, EngineProgram, Image, ScanTimes, WordCell};
use rustc_hash::{FxHashMap, FxHashSet};
use written::{Limits, WrittenCells};

/// A model as gates, with the values of all cells.
#[derive(Clone, Debug)]
pub struct Encoding {
    /// The gates.
    pub gates: Gates,
    /// The bits that the scan reads or writes, with their values at its end.
    pub bits: Vec<(BitCell, Literal)>,
    /// The words that the scan reads or writes, with their contents at its end, the lowest bit
    /// first; the highest is the sign.
    pub words: Vec<(WordCell, Vec<Literal>)>,
}

/// The gates of one scan of a model.
pub fn encode(model: &Model) -> Gates {
    encode_cells(model).gates.without_constants()
}

/// The gates of one scan of a model, with the values of all cells.
pub fn encode_cells(model: &Model) -> Encoding {
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

/// What the first scan begins with.
struct Start {
    /// Memory, with the status words of step 1.
    image: Image,
    /// The blocks whose first turn is due.
    first_turns: FxHashSet<BlockId>,
}

impl Start {
    fn of(model: &Model) -> Start {
        let mut engine = Engine::new(model.code.clone());
        model.restored.iter().for_each(|(cell, value)| engine.restore(*cell, *value));
        engine.start(0);
        let blocks = (0..model.code.blocks.len() as u32).map(BlockId);
        let first_turns = blocks.filter(|block| engine.has_first_turn_due(*block)).collect();
        engine.begin_scan(0, &ScanTimes::default(), &LocalTime::default());
        Start { image: engine.image().clone(), first_turns }
    }
}

/// A scan that is being encoded.
struct Encoder<'m> {
    model: &'m Model,
    code: &'m EngineProgram,
    start: &'m Start,
    written: WrittenCells<'m>,
    /// Private cells that are no passing values.
    kept: &'m FxHashSet<Cell>,
    graph: Graph,
    /// The values of bits; `None`: not read or written yet.
    bits: Vec<Option<Literal>>,
    /// The values of words that were read or written.
    words: FxHashMap<u32, Number>,
    /// The states of blocks, Stages and subroutines.
    own: FxHashMap<Held, Literal>,
    own_numbers: FxHashMap<OwnNumber, Number>,
    latches: Vec<OwnedLatch>,
    inputs: Vec<GateInput>,
    constraints: Vec<Literal>,
    cuts: Vec<Cut>,
    free: Vec<Vec<Literal>>,
    /// A STOP was executed, in this scan or before.
    stop_requested: Literal,
    /// The condition under which the engine executes what is encoded now.
    guard: Literal,
    /// The number of the execution of an element that is encoded now, and of all so far.
    execution: u32,
    executions: u32,
    /// Private cells whose value passes from one operation to another of the same execution, with
    /// that execution.
    passing: FxHashMap<Cell, u32>,
    /// Cells of which this was assumed although they last.
    lasting: FxHashSet<Cell>,
    /// The time since the last execution of the element, ms, if its operations ask for it.
    elapsed_ms: Option<Number>,
    /// Whether the elements of which this can matter count the scans since their last execution.
    counts_ages: bool,
    /// By subroutine, by its index: the elements in whose turns it may be executed.
    callers: FxHashMap<u32, Vec<Element>>,
    /// The batches of the CALLs in whose subroutines it is, and the current batch.
    batches: Vec<u32>,
}

impl<'m> Encoder<'m> {
    fn new(model: &'m Model, start: &'m Start, kept: &'m FxHashSet<Cell>) -> Encoder<'m> {
        let code = &model.code;
        let mut encoder = Encoder {
            model,
            code,
            start,
            written: WrittenCells::of(code, &start.image),
            kept,
            graph: Graph::default(),
            bits: vec![None; code.bit_count as usize],
            words: FxHashMap::default(),
            own: FxHashMap::default(),
            own_numbers: FxHashMap::default(),
            latches: Vec::new(),
            inputs: Vec::new(),
            constraints: Vec::new(),
            cuts: Vec::new(),
            free: Vec::new(),
            stop_requested: Literal::FALSE,
            guard: Literal::TRUE,
            execution: 0,
            executions: 0,
            passing: FxHashMap::default(),
            lasting: FxHashSet::default(),
            elapsed_ms: None,
            counts_ages: timers::begins_running(code, &start.image),
            callers: calls::callers(code),
            batches: Vec::new(),
        };
        for (at, input) in (0..).zip(&model.inputs) {
            encoder.free_input(at, *input);
        }
        encoder
    }

    /// Makes the literals of one of the model's inputs.
    fn free_input(&mut self, at: u32, input: FreeInput) {
        let of = |bit| InputOf::Free(at, bit);
        let value = self.any_number(input.low, input.high, of);
        match input.cell {
            Cell::Bit(BitCell(bit)) => self.bits[bit as usize] = Some(value.bit(0)),
            Cell::Word(WordCell(word)) => {
                self.words.insert(word, value.clone());
            }
            Cell::WordBit(_) => unreachable!("an input is a whole cell"),
        }
        self.free.push(value.bits().to_vec());
    }

    /// A number within limits that is free in every scan.
    fn any_number(&mut self, low: i32, high: i32, of: impl Fn(u8) -> InputOf) -> Number {
        let (graph, inputs) = (&mut self.graph, &mut self.inputs);
        let number = Number::made(low.into(), high.into(), |bit| {
            let literal = graph.input();
            inputs.push(GateInput { literal, of: of(bit as u8) });
            literal
        });
        let unlimited = Number::of_bits(number.bits().to_vec());
        let outside = unlimited.is_outside(&mut self.graph, low, high);
        self.constrain(!outside);
        number
    }

    fn constrain(&mut self, constraint: Literal) {
        if constraint != Literal::TRUE {
            self.constraints.push(constraint);
        }
    }

    /// Any value within limits, in place of the result of an operation.
    fn cut(&mut self, cell: Cell, what: &'static str, limits: Limits) -> Number {
        let at = self.cuts.len() as u32;
        let value = self.any_number(limits.low, limits.high, |bit| InputOf::Cut(at, bit));
        let batches = self.batches.clone();
        let bits = value.bits().to_vec();
        self.cuts.push(Cut { cell, index: None, what, value: bits, batches });
        value
    }

    /// Encodes one scan.
    fn scan(&mut self) {
        let last = self.begin_last_scan();
        self.turns(last);
        for bit in &self.model.assumed {
            let assumed = self.bit(bit.0);
            self.constrain(assumed);
        }
    }
}
