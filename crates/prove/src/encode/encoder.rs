//! A scan that is being encoded: the state of all encoders.

use super::acc_forms::{AccForm, acc_forms};
use super::calls;
use super::held::{Elapsed, EventLiteral, OwnNumber, OwnedLatch};
use super::number::Number;
use super::start::Start;
use super::written::{WordRange, WrittenCells};
use crate::aig::{GateGraph, Literal};
use crate::gates::{GateCut, GateInput, Held, InputOf};
use crate::model::{FreeInput, ProofModel};
use rungd_engine::isa::{Bit, BlockId};
use rungd_engine::{BitCell, Cell, Element, EngineProgram, WordCell};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;

/// A scan that is being encoded.
pub(super) struct Encoder<'m> {
    pub model: &'m ProofModel,
    pub code: &'m EngineProgram,
    pub start: &'m Start,
    pub written: WrittenCells<'m>,
    /// Private cells that are no passing values.
    pub kept: &'m FxHashSet<Cell>,
    pub graph: GateGraph,
    /// The `.Acc` that are not held as the engine holds them.
    pub acc_forms: FxHashMap<u32, AccForm>,
    /// The values of cells in the first scan that are free there alone.
    pub at_start: FxHashMap<Cell, Number>,
    /// Whether the first turn of a Program is due before the first scan, where it is free there.
    pub first_turns: FxHashMap<BlockId, Literal>,
    /// The values of bits; `None`: not read or written yet.
    pub bits: Vec<Option<Literal>>,
    /// The values of words that were read or written.
    pub words: FxHashMap<u32, Number>,
    /// The states of blocks, Stages and subroutines.
    pub own: FxHashMap<Held, Literal>,
    pub own_numbers: FxHashMap<OwnNumber, Number>,
    pub latches: Vec<OwnedLatch>,
    pub inputs: Vec<GateInput>,
    pub constraints: Vec<Literal>,
    pub cuts: Vec<GateCut>,
    pub free: Vec<Vec<Literal>>,
    /// A STOP was executed, in this scan or before.
    pub stop_requested: Literal,
    /// The condition under which the engine executes what is encoded now.
    pub guard: Literal,
    /// The number of the execution of an element that is encoded now, and of all so far.
    pub execution: u32,
    pub executions: u32,
    /// Private cells whose value passes from one operation to another of the same execution, with
    /// that execution.
    pub passing: FxHashMap<Cell, u32>,
    /// Cells of which this was assumed although they last.
    pub lasting: FxHashSet<Cell>,
    /// The number of periods since the scan before, if scans may come late.
    pub late: Option<Number>,
    /// What may happen behind the scan.
    pub happens: Vec<EventLiteral>,
    /// The time since the last execution of the element, if its operations ask for it.
    pub elapsed: Option<Elapsed>,
    /// The ages that are counted, with their largest values.
    pub ages: BTreeMap<OwnNumber, i128>,
    /// By subroutine, by its index: the elements in whose turns it may be executed.
    pub callers: FxHashMap<u32, Vec<Element>>,
    /// The batches of the CALLs in whose subroutines it is, and the current batch.
    pub batches: Vec<u32>,
}

impl<'m> Encoder<'m> {
    pub fn new(model: &'m ProofModel, start: &'m Start, kept: &'m FxHashSet<Cell>) -> Encoder<'m> {
        let code = &model.code;
        let mut written = WrittenCells::of(code, &start.image);
        let at_start = model.inputs.iter().filter(|input| !input.is_of_every_scan());
        at_start.for_each(|input| written.starts_with(input));
        model.stage_starts.iter().for_each(|start| written.starts(start.chosen.program));
        if let Some(down) = model.events.down {
            written.starts_with(&FreeInput { cell: Cell::Word(down.word), ..down.input() });
        }
        let mut encoder = Encoder {
            model,
            code,
            start,
            acc_forms: acc_forms(model, &start.image, &written),
            written,
            kept,
            graph: GateGraph::default(),
            at_start: FxHashMap::default(),
            first_turns: FxHashMap::default(),
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
            late: None,
            happens: Vec::new(),
            elapsed: None,
            ages: BTreeMap::new(),
            callers: calls::callers(code),
            batches: Vec::new(),
        };
        for (at, input) in (0..).zip(&model.inputs) {
            encoder.free_input(at, *input);
        }
        encoder.begin_stages();
        encoder.free_lateness();
        encoder.free_event();
        encoder
    }

    /// Makes the literals of one of the model's inputs.
    fn free_input(&mut self, at: u32, input: FreeInput) {
        let of = |bit| InputOf::Free(at, bit);
        let value = self.any_number(input.low, input.high, of);
        self.constrain_real(input.cell, &value);
        if !input.is_of_every_scan() {
            self.free.push(value.bits().to_vec());
            self.at_start.insert(input.cell, value);
            return;
        }
        match input.cell {
            Cell::Bit(BitCell(bit)) => self.bits[bit as usize] = Some(value.bit(0)),
            Cell::Word(WordCell(word)) => {
                self.words.insert(word, value.clone());
            }
            Cell::WordBit(_) => unreachable!("an input is a whole cell"),
        }
        self.free.push(value.bits().to_vec());
    }

    /// Gives the Programs whose Stages are free before the first scan what was chosen for them.
    fn begin_stages(&mut self) {
        let code = self.code;
        for start in &self.model.stage_starts {
            let program = start.chosen.program;
            let chosen = |scan: &Self, bit| {
                let value = scan.at_start.get(&Cell::Bit(bit));
                value.map_or(Literal::FALSE, |value| value.bit(0))
            };
            let runs = Literal::constant(start.runs);
            let runs = self.graph.or(runs, chosen(self, start.chosen.running()));
            let begins = self.graph.and(runs, chosen(self, start.chosen.begins()));
            let is_kept = self.graph.and(runs, !begins);
            let running = Cell::Bit(code.layout.bit(Bit::Running(program)));
            self.at_start.insert(running, Number::of_bit(runs));
            self.first_turns.insert(program, begins);
            for n in 0..start.chosen.stages {
                let on = self.graph.and(is_kept, chosen(self, start.chosen.stage(n)));
                let stage = Cell::Bit(code.layout.bit(Bit::Stage(start.stage(code, n))));
                self.at_start.insert(stage, Number::of_bit(on));
            }
        }
    }

    /// Makes the literals of the time since the scan before.
    fn free_lateness(&mut self) {
        let (at, high) = (self.model.inputs.len() as u32, self.model.periods_max().cast_signed());
        if high > 1 {
            let periods = self.any_number(1, high, |bit| InputOf::Free(at, bit));
            self.free.push(periods.bits().to_vec());
            self.late = Some(periods);
        }
    }

    /// Makes the literals of the event that is chosen with a scan.
    fn free_event(&mut self) {
        let Some(place) = self.model.event_place() else { return };
        let (model, at) = (self.model, place as u32);
        let high = model.events.kinds.len() as i32;
        let number = self.any_number(0, high, |bit| InputOf::Free(at, bit));
        self.free.push(number.bits().to_vec());
        for (at, event) in (1..).zip(&model.events.kinds) {
            let happens = number.equal(&mut self.graph, &Number::constant(at));
            self.happens.push(EventLiteral { event: *event, happens });
        }
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

    /// Excludes the content of an R word that no real has: it would be -0.
    fn constrain_real(&mut self, cell: Cell, content: &Number) {
        let Cell::Word(word) = cell else { return };
        if self.code.layout.is_real(word) {
            let is_none = content.equal(&mut self.graph, &Number::constant(-1));
            self.constrain(!is_none);
        }
    }

    /// Keeps a literal ON in every scan.
    pub fn constrain(&mut self, constraint: Literal) {
        if constraint != Literal::TRUE {
            self.constraints.push(constraint);
        }
    }

    /// Any value within limits, in place of the result of an operation.
    pub fn cut(&mut self, cell: Cell, what: &'static str, limits: WordRange) -> Number {
        let at = self.cuts.len() as u32;
        let value = self.any_number(limits.low, limits.high, |bit| InputOf::Cut(at, bit));
        self.constrain_real(cell, &value);
        let batches = self.batches.clone();
        let bits = value.bits().to_vec();
        let WordRange { low, high } = limits;
        self.cuts.push(GateCut { cell, index: None, what, low, high, value: bits, batches });
        value
    }
}
