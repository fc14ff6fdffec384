//! A model as gates: what `encode` makes and the solvers read.
//!
//! One step of the gates is one scan. A path ends where a constraint is OFF: inputs that are not
//! allowed, or the end of the scans after a stop. Its cells have names nowhere here; latches,
//! inputs and cuts say of which cells they are.

use crate::aig::simulator::NodeValues;
use crate::aig::{GateGraph, GateNode, Literal, cone};
use rungd_engine::isa::{BlockId, StageId};
use rungd_engine::{BitCell, Cell, Element, WordCell};

/// What a latch holds between two scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Held {
    /// A bit.
    Bit(BitCell),
    /// A bit of the content of a word, 0 is the lowest. The highest latch of a word that may be
    /// negative is its sign.
    WordBit(WordCell, u8),
    /// A bit of the number of scans whose time the `.Acc` of a timer has.
    TimerScans(WordCell, u8),
    /// A pass of a block is due.
    PassDue(BlockId),
    /// The first turn of a block has still to come.
    FirstTurn(BlockId),
    /// A block has executed since its last pass.
    Executed(BlockId),
    /// A Task is enabled recurrently.
    Recurrent(BlockId),
    /// A bit of the interval of a recurrent Task, ms.
    Interval(BlockId, u8),
    /// A bit of the time in the current interval of a recurrent Task.
    Phase(BlockId, u8),
    /// A bit of the number of scans since the last execution of a block's own rungs.
    Age(BlockId, u8),
    /// A pass of a Stage is due.
    StagePassDue(StageId),
    /// A Stage has executed since its last pass.
    StageExecuted(StageId),
    /// A bit of the number of scans since the last execution of a Stage.
    StageAge(StageId, u8),
    /// A subroutine, by its index, was executed last in the turn of an element.
    Caller(u32, Element),
    /// The first scan.
    FirstScan,
    /// The last scan: a stop was requested.
    LastScan,
    /// The last scan is over.
    Stopped,
    /// The first scan of the path, if RUN may begin again.
    Beginning,
    /// A bit in the image of retained memory that was kept last.
    ImageBit(BitCell),
    /// A bit of the content of a word in that image.
    ImageWordBit(WordCell, u8),
    /// That image has the passes of a stop.
    ImageIsFinal,
    /// A bit of the time in the current period of a clock bit.
    Clock(BitCell, u8),
}

/// A latch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Latch {
    /// Its literal: the value at the start of a scan.
    pub literal: Literal,
    /// The value at the start of the next scan.
    pub next: Literal,
    /// The value at the start of the first scan; `None`: any.
    pub initial: Option<bool>,
    /// What it holds.
    pub holds: Held,
}

/// What an input is part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum InputOf {
    /// Of one of the model's inputs, by its index, and the bit in the content of its cell.
    Free(u32, u8),
    /// Of a cut, by its index, and the bit in the content of its cell.
    Cut(u32, u8),
}

/// An input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GateInput {
    /// Its literal.
    pub literal: Literal,
    /// What it is part of.
    pub of: InputOf,
}

/// A result that has no gates: any value within the limits of its cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GateCut {
    /// The cell that the result is written to; for an array, its first element.
    pub cell: Cell,
    /// For an element of an array: the word with its index.
    pub index: Option<WordCell>,
    /// The kind of operation.
    pub what: &'static str,
    /// The smallest value.
    pub low: i32,
    /// The largest value.
    pub high: i32,
    /// The content of the cell, the lowest bit first; the highest is the sign.
    pub value: Vec<Literal>,
    /// The step of the scan, in an engine with the same batches: the batches of the CALLs in whose
    /// subroutines it is, then its own.
    pub batches: Vec<u32>,
}

/// A model as gates.
#[derive(Clone, Debug, Default)]
pub struct Gates {
    /// The gates of one scan.
    pub graph: GateGraph,
    /// What a scan hands to the next one.
    pub latches: Vec<Latch>,
    /// What is free in every scan.
    pub inputs: Vec<GateInput>,
    /// These are ON in every scan.
    pub constraints: Vec<Literal>,
    /// The model's judged bits, in the same order.
    pub judged: Vec<Literal>,
    /// By input of the model: the content of its cell, the lowest bit first; the highest is the
    /// sign. Bits that no value within its limits has are constants.
    pub free: Vec<Vec<Literal>>,
    /// The results that have no gates.
    pub cuts: Vec<GateCut>,
}

/// Gates in which some nodes were replaced.
pub(crate) struct ReplacedGates {
    pub gates: Gates,
    /// By latch of the gates before: its next value, here.
    pub next: Vec<Literal>,
}

/// The number whose bits are these, the lowest first; the highest is the sign.
pub fn content(bits: &[Literal], is_on: impl Fn(Literal) -> bool) -> i32 {
    let sign = bits.last().is_some_and(|sign| is_on(*sign));
    let start = if sign { -1 << bits.len().min(31) } else { 0 };
    let on = (0..).zip(bits).filter(|(_, bit)| is_on(**bit));
    on.fold(start, |content, (at, _): (u32, _)| content | 1 << at.min(31))
}

impl Gates {
    /// The values of the model's inputs, from the values of literals.
    pub fn input_values(&self, is_on: impl Fn(Literal) -> bool) -> Vec<i32> {
        self.free.iter().map(|bits| content(bits, &is_on)).collect()
    }

    /// The cuts on which something depends.
    pub fn open_cuts(&self) -> Vec<GateCut> {
        let is_open = |cut: &&GateCut| cut.value.iter().any(|bit| bit.as_constant().is_none());
        self.cuts.iter().filter(is_open).cloned().collect()
    }

    /// The gates that a question about these judged bits depends on. The others are constants
    /// there: OFF. Cuts and inputs keep their numbers.
    pub fn reduced(&self, judged: &[usize]) -> Gates {
        let next = self.next_of_nodes();
        let asked = judged.iter().map(|at| self.judged[*at]);
        let roots: Vec<Literal> = asked.chain(self.constraints.iter().copied()).collect();
        let is_inside = cone(&self.graph, &roots, |node| next[node as usize]);
        self.rebuilt(|node| if is_inside[node as usize] { None } else { Some(Literal::FALSE) })
    }

    /// The same gates without the latches that keep their initial value, whatever the inputs are.
    pub fn without_constants(&self) -> Gates {
        let mut is_fixed: Vec<bool> =
            self.latches.iter().map(|latch| latch.initial.is_some()).collect();
        loop {
            let mut leaves = vec![Ternary::UNKNOWN; self.graph.nodes().len()];
            for (latch, is_fixed) in self.latches.iter().zip(&is_fixed) {
                if let (true, Some(initial)) = (*is_fixed, latch.initial) {
                    leaves[latch.literal.node() as usize] = Ternary::of(initial);
                }
            }
            let values = TernaryValues::of(&self.graph, &leaves);
            let mut changes = false;
            for (latch, is_fixed) in self.latches.iter().zip(&mut is_fixed) {
                let keeps = latch.initial.map(Ternary::of) == Some(values.of_literal(latch.next));
                changes |= *is_fixed && !keeps;
                *is_fixed &= keeps;
            }
            if !changes {
                break;
            }
        }
        let mut fixed = vec![None; self.graph.nodes().len()];
        for (latch, _) in self.latches.iter().zip(&is_fixed).filter(|(_, is_fixed)| **is_fixed) {
            fixed[latch.literal.node() as usize] = latch.initial.map(Literal::constant);
        }
        self.rebuilt(|node| fixed[node as usize])
    }

    /// The next literal of each node that is a latch.
    fn next_of_nodes(&self) -> Vec<Option<Literal>> {
        let mut next = vec![None; self.graph.nodes().len()];
        for latch in &self.latches {
            next[latch.literal.node() as usize] = Some(latch.next);
        }
        next
    }

    /// The same gates with other literals in place of some nodes: constants, or nodes before them.
    /// `instead`: by node.
    pub(crate) fn replaced(&self, instead: &[Option<Literal>]) -> ReplacedGates {
        self.replacing(|node| instead[node as usize])
    }

    /// The same gates with constants in place of some nodes.
    fn rebuilt(&self, constant: impl Fn(u32) -> Option<Literal>) -> Gates {
        self.replacing(constant).gates
    }

    /// A latch or input that is replaced is left out.
    fn replacing(&self, instead: impl Fn(u32) -> Option<Literal>) -> ReplacedGates {
        let mut graph = GateGraph::default();
        let mut new: Vec<Literal> = Vec::with_capacity(self.graph.nodes().len());
        let of = |new: &[Literal], literal: Literal| {
            new[literal.node() as usize].inverted_if(literal.is_inverted())
        };
        for (number, node) in (0..).zip(self.graph.nodes()) {
            // GateNode 0 is the constant of every graph.
            let replaced = instead(number).filter(|_| number > 0);
            let literal = replaced.map(|literal| of(&new, literal));
            let literal = literal.unwrap_or_else(|| match *node {
                GateNode::Constant => Literal::FALSE,
                GateNode::Input => graph.input(),
                GateNode::Latch => graph.latch(),
                GateNode::And(a, b) => graph.and(of(&new, a), of(&new, b)),
            });
            new.push(literal);
        }
        let of = |literal: Literal| of(&new, literal);
        let all = |literals: &[Literal]| literals.iter().map(|literal| of(*literal)).collect();
        let stays = |literal: Literal| instead(literal.node()).is_none();
        let latches = self.latches.iter().filter(|latch| stays(latch.literal));
        let inputs = self.inputs.iter().filter(|input| stays(input.literal));
        let cuts = self.cuts.iter().map(|cut| GateCut { value: all(&cut.value), ..cut.clone() });
        let next = self.latches.iter().map(|latch| of(latch.next)).collect();
        let gates = Gates {
            latches: latches
                .map(|latch| Latch { literal: of(latch.literal), next: of(latch.next), ..*latch })
                .collect(),
            inputs: inputs
                .map(|input| GateInput { literal: of(input.literal), ..*input })
                .collect(),
            constraints: all(&self.constraints)
                .into_iter()
                .filter(|constraint: &Literal| *constraint != Literal::TRUE)
                .collect(),
            judged: all(&self.judged),
            free: self.free.iter().map(|bits| all(bits)).collect(),
            cuts: cuts.collect(),
            graph,
        };
        ReplacedGates { gates, next }
    }

    /// The values of all nodes in a scan, from those of the latches and inputs, in their order.
    pub fn evaluated(&self, latches: &[u64], inputs: &[u64]) -> NodeValues {
        let mut leaves = vec![0; self.graph.nodes().len()];
        for (latch, value) in self.latches.iter().zip(latches) {
            leaves[latch.literal.node() as usize] = *value;
        }
        for (input, value) in self.inputs.iter().zip(inputs) {
            leaves[input.literal.node() as usize] = *value;
        }
        NodeValues::of(&self.graph, |node| leaves[node as usize])
    }
}

/// ON, OFF, or either: whether it can be ON, and whether it can be OFF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Ternary {
    can_on: bool,
    can_off: bool,
}

impl Ternary {
    const UNKNOWN: Ternary = Ternary { can_on: true, can_off: true };

    fn of(on: bool) -> Ternary {
        Ternary { can_on: on, can_off: !on }
    }
}

/// The values of nodes.
struct TernaryValues {
    values: Vec<Ternary>,
}

impl TernaryValues {
    fn of(graph: &GateGraph, leaves: &[Ternary]) -> TernaryValues {
        let mut nodes = TernaryValues { values: Vec::with_capacity(leaves.len()) };
        for (leaf, node) in leaves.iter().zip(graph.nodes()) {
            let value = match *node {
                GateNode::Constant => Ternary::of(false),
                GateNode::Input | GateNode::Latch => *leaf,
                GateNode::And(a, b) => {
                    let (a, b) = (nodes.of_literal(a), nodes.of_literal(b));
                    Ternary { can_on: a.can_on && b.can_on, can_off: a.can_off || b.can_off }
                }
            };
            nodes.values.push(value);
        }
        nodes
    }

    fn of_literal(&self, literal: Literal) -> Ternary {
        let Ternary { can_on, can_off } = self.values[literal.node() as usize];
        if literal.is_inverted() {
            return Ternary { can_on: can_off, can_off: can_on };
        }
        Ternary { can_on, can_off }
    }
}
