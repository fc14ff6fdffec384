//! Evaluates the nodes of a graph for 64 patterns at once.
//!
//! Tests compare the gates with the engine; solvers may look for candidates. It knows nothing of
//! cells.

use super::{GateGraph, GateNode, Literal};

/// The values of all nodes: a bit of each word is one pattern.
#[derive(Clone, Debug, Default)]
pub struct NodeValues {
    values: Vec<u64>,
}

impl NodeValues {
    /// Evaluates a graph; `leaf` gives the values of inputs and latches, by the node's number.
    pub fn of(graph: &GateGraph, leaf: impl Fn(u32) -> u64) -> NodeValues {
        let mut nodes = NodeValues { values: Vec::with_capacity(graph.nodes().len()) };
        for (number, node) in (0..).zip(graph.nodes()) {
            let value = match *node {
                GateNode::Constant => 0,
                GateNode::Input | GateNode::Latch => leaf(number),
                GateNode::And(a, b) => nodes.of_literal(a) & nodes.of_literal(b),
            };
            nodes.values.push(value);
        }
        nodes
    }

    /// The values of a literal.
    pub fn of_literal(&self, literal: Literal) -> u64 {
        let inverted = if literal.is_inverted() { u64::MAX } else { 0 };
        self.values[literal.node() as usize] ^ inverted
    }
}
