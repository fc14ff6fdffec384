//! One scan as a transition of bits: what the solver's ways get of the gates.
//!
//! It has only what a question depends on, and one literal for what is allowed and for what is
//! looked for. Bits are numbered anew, in an order in which each gate comes after what it reads.

use crate::aig::{GateGraph, GateNode, Literal};
use crate::gates::Gates;

/// A gate: a bit that is ON if both of two others are.
#[derive(Clone, Copy, Debug)]
pub struct Gate {
    /// Its bit.
    pub bit: u32,
    /// What it reads.
    pub reads: [Literal; 2],
}

/// A bit that is kept from one scan to the next.
#[derive(Clone, Copy, Debug)]
pub struct KeptBit {
    /// Its bit.
    pub bit: u32,
    /// Its value in the next scan.
    pub next: Literal,
    /// Its value in the first scan; `None`: any.
    pub init: Option<bool>,
}

/// One scan.
#[derive(Clone, Debug, Default)]
pub struct ScanSystem {
    /// The number of all bits. Bit 0 is always OFF.
    pub bits: usize,
    /// Bits that have any value in each scan.
    pub inputs: Vec<u32>,
    /// What is kept.
    pub kept: Vec<KeptBit>,
    /// The gates, in order.
    pub gates: Vec<Gate>,
    /// There is a scan with these values only if this is ON.
    pub allowed: Literal,
    /// What is looked for: ON in a scan that is allowed.
    pub found: Literal,
}

impl ScanSystem {
    /// The scan of gates; `found`: what is looked for.
    pub fn of(gates: &Gates, found: Literal) -> ScanSystem {
        let mut graph: GateGraph = gates.graph.clone();
        let allowed = graph.all(gates.constraints.iter().copied());
        let mut system =
            ScanSystem { bits: graph.nodes().len(), allowed, found, ..ScanSystem::default() };
        for (bit, node) in (0..).zip(graph.nodes()) {
            match *node {
                GateNode::Constant | GateNode::Latch => {}
                GateNode::Input => system.inputs.push(bit),
                GateNode::And(a, b) => system.gates.push(Gate { bit, reads: [a, b] }),
            }
        }
        let kept = gates.latches.iter();
        system.kept = kept
            .map(|latch| KeptBit {
                bit: latch.literal.node(),
                next: latch.next,
                init: latch.initial,
            })
            .collect();
        system
    }

    /// The values of all bits in a scan. `values` has those of inputs and kept bits; the rest is
    /// filled in.
    pub fn evaluate(&self, values: &mut [bool]) {
        values[0] = false;
        for gate in &self.gates {
            let [a, b] = gate.reads.map(|literal| on(values, literal));
            values[gate.bit as usize] = a && b;
        }
    }
}

/// The value of a literal.
pub fn on(values: &[bool], literal: Literal) -> bool {
    values[literal.node() as usize] != literal.is_inverted()
}
