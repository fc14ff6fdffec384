//! Several runs of a model on the engine, and the same runs as patterns of its gates.

use rungd_engine::{Cell, EngineCall, Image, ScanObserver, ScanStep, WordCell};
use rungd_prove::aig::simulator::NodeValues;
use rungd_prove::gates::{GateCut, Gates, InputOf};
use rungd_prove::model::{ProofModel, Run, ScanOutcome};
use std::collections::HashMap;

/// The number of runs.
pub const LANES: usize = 2;

/// The runs, with the values of the gates' latches and inputs.
pub struct Lanes<'m> {
    model: &'m ProofModel,
    cuts: Vec<GateCut>,
    runs: Vec<LaneRun<'m>>,
    latches: Vec<u64>,
}

struct LaneRun<'m> {
    run: Run<'m>,
    /// The values of the inputs in this scan.
    inputs: Vec<i32>,
    /// The values of the cuts in this scan.
    cuts: Vec<i32>,
    outcome: ScanOutcome,
    is_over: bool,
}

/// Sees the values behind the operations that are cuts.
struct CutEye<'c> {
    cuts: &'c [GateCut],
    open: Vec<u32>,
    indices: HashMap<usize, i32>,
    values: HashMap<usize, i32>,
}

/// The element of a cut.
fn element(cut: &GateCut, index: i32) -> Cell {
    match cut.cell {
        Cell::Word(WordCell(first)) => Cell::Word(WordCell(first.wrapping_add_signed(index))),
        Cell::Bit(bit) => Cell::Bit(rungd_engine::BitCell(bit.0.wrapping_add_signed(index))),
        Cell::WordBit(bit) => {
            let word = WordCell(bit.word.0.wrapping_add_signed(index));
            Cell::WordBit(rungd_engine::WordBitCell { word, ..bit })
        }
    }
}

impl CutEye<'_> {
    fn current(&self) -> Vec<usize> {
        let is_here = |(_, cut): &(usize, &GateCut)| cut.batches == self.open;
        self.cuts.iter().enumerate().filter(is_here).map(|(at, _)| at).collect()
    }
}

impl ScanObserver for CutEye<'_> {
    fn before(&mut self, step: ScanStep, image: &Image) {
        let ScanStep::Batch(batch) = step else { return };
        self.open.push(batch);
        for at in self.current() {
            let index = self.cuts[at].index.map_or(0, |index| image.word(index));
            self.indices.insert(at, index);
        }
    }

    fn after(&mut self, step: ScanStep, image: &Image) {
        let ScanStep::Batch(_) = step else { return };
        for at in self.current() {
            let cut = &self.cuts[at];
            let cell = element(cut, self.indices[&at]);
            let is_in = match cell {
                Cell::Bit(bit) => (bit.0 as usize) < image.bits().len(),
                Cell::Word(word) => (word.0 as usize) < image.words().len(),
                Cell::WordBit(bit) => (bit.word.0 as usize) < image.words().len(),
            };
            if is_in {
                self.values.insert(at, image.value(cell));
            }
        }
        self.open.pop();
    }
}

impl<'m> LaneRun<'m> {
    /// One scan, as `Run::scan` executes it, with an observer of the cuts.
    fn scan(&mut self, cuts: &[GateCut], inputs: &[i32]) {
        let mut eye =
            CutEye { cuts, open: Vec::new(), indices: HashMap::new(), values: HashMap::new() };
        self.outcome = self.run.scan_with(inputs, |engine| {
            // A STOP of this scan comes later.
            let is_last = engine.stops();
            engine.apply_seen(EngineCall::Execute, &mut eye);
            is_last
        });
        let cut_value = |at: usize| {
            // The value of an operation that writes nothing does not matter, but is within limits.
            let value = eye.values.get(&at).copied().unwrap_or(0);
            value.clamp(cuts[at].low, cuts[at].high)
        };
        self.cuts = (0..cuts.len()).map(cut_value).collect();
        self.inputs = inputs.to_vec();
    }
}

impl<'m> Lanes<'m> {
    pub fn new(model: &'m ProofModel, gates: &Gates) -> Lanes<'m> {
        let lane = |_| {
            let run = Run::new(model);
            LaneRun {
                run,
                inputs: Vec::new(),
                cuts: Vec::new(),
                outcome: ScanOutcome { is_allowed: true, judged: Vec::new(), is_last: false },
                is_over: false,
            }
        };
        Lanes { runs: (0..LANES).map(lane).collect(), ..Lanes::empty(model, gates) }
    }

    fn empty(model: &'m ProofModel, gates: &Gates) -> Lanes<'m> {
        let initial = |initial: Option<bool>| if initial == Some(true) { u64::MAX } else { 0 };
        let latches = gates.latches.iter().map(|latch| initial(latch.initial)).collect();
        Lanes { model, cuts: gates.cuts.clone(), runs: Vec::new(), latches }
    }

    /// The latches of other gates of the same model.
    pub fn of_gates(&self, gates: &Gates) -> Lanes<'m> {
        Lanes::empty(self.model, gates)
    }

    /// Executes a scan in each lane that is not over.
    pub fn scan(&mut self, inputs: &[Vec<i32>]) {
        for (lane, inputs) in self.runs.iter_mut().zip(inputs).filter(|(lane, _)| !lane.is_over) {
            lane.scan(&self.cuts, inputs);
        }
    }

    /// The lanes that are not over.
    pub fn active(&self) -> Vec<usize> {
        (0..LANES).filter(|lane| !self.runs[*lane].is_over).collect()
    }

    pub fn outcome(&self, lane: usize) -> &ScanOutcome {
        &self.runs[lane].outcome
    }

    pub fn image(&self, lane: usize) -> &Image {
        self.runs[lane].run.engine.image()
    }

    pub fn evaluate(&self, gates: &Gates) -> NodeValues {
        self.evaluate_with(gates, self)
    }

    /// Evaluates gates with the inputs of other lanes.
    pub fn evaluate_with(&self, gates: &Gates, lanes: &Lanes) -> NodeValues {
        gates.evaluated(&self.latches, &self.inputs(gates, lanes))
    }

    /// The values of gates' inputs, from those of other lanes.
    pub fn inputs(&self, gates: &Gates, lanes: &Lanes) -> Vec<u64> {
        let inputs = gates.inputs.iter().map(|input| {
            let bit = |run: &LaneRun| match input.of {
                InputOf::Free(at, bit) => run.inputs[at as usize] >> bit & 1,
                InputOf::Cut(at, bit) => run.cuts[at as usize] >> bit & 1,
            };
            let bits = lanes.runs.iter().map(bit).enumerate();
            bits.fold(0, |all, (lane, bit)| all | (bit as u64) << lane)
        });
        inputs.collect()
    }

    /// Goes on to the next scan. A lane whose inputs are not allowed, or that was stopped, is over.
    pub fn end(&mut self, values: &NodeValues, gates: &Gates) {
        self.latches = gates.latches.iter().map(|latch| values.of_literal(latch.next)).collect();
        for run in &mut self.runs {
            run.is_over |= run.outcome.is_last;
        }
    }
}
