//! Writes a transition system in the format AIGER 1.9, as text (`aag`) or binary (`aig`).
//!
//! For certificates: any model checker of the field reads it. Source: A. Biere, K. Heljanko,
//! S. Wieringa: AIGER 1.9 and beyond (FMV report 11/2). Nothing here reads the format.

use super::{GateGraph, GateNode, Literal};
use std::fmt::Write;

/// A latch, its name for the symbol table.
#[derive(Clone, Debug)]
pub struct NamedLatch {
    /// Its literal.
    pub literal: Literal,
    /// Its value in the next step.
    pub next: Literal,
    /// Its value in the first step; `None`: any.
    pub initial: Option<bool>,
    /// Its name: one line.
    pub name: String,
}

/// A literal and its name for the symbol table.
#[derive(Clone, Debug)]
pub struct NamedLiteral {
    /// The literal.
    pub literal: Literal,
    /// Its name: one line.
    pub name: String,
}

/// A transition system with questions.
#[derive(Clone, Debug)]
pub struct AigerSystem<'g> {
    /// The gates.
    pub graph: &'g GateGraph,
    /// All inputs that a gate reads.
    pub inputs: Vec<NamedLiteral>,
    /// All latches that a gate reads.
    pub latches: Vec<NamedLatch>,
    /// Is one of these ever ON?
    pub bad: Vec<NamedLiteral>,
    /// These are ON in every step.
    pub constraints: Vec<NamedLiteral>,
    /// Lines for the end of the file.
    pub comment: String,
}

/// A system with the variables of AIGER: inputs, then latches, then gates.
struct Numbered<'s> {
    system: &'s AigerSystem<'s>,
    /// The variable of each node of the graph; 0 for a node that is left out.
    variables: Vec<u32>,
    /// The nodes of the gates, in order.
    gates: Vec<u32>,
}

impl AigerSystem<'_> {
    /// The system in the text format.
    pub fn ascii(&self) -> String {
        let numbered = Numbered::of(self);
        let mut text = numbered.header("aag");
        for input in &self.inputs {
            let _ = writeln!(text, "{}", numbered.number(input.literal));
        }
        for latch in &self.latches {
            let _ = writeln!(text, "{} {}", numbered.number(latch.literal), numbered.next(latch));
        }
        numbered.questions(&mut text);
        for node in &numbered.gates {
            let [left, a, b] = numbered.gate(*node);
            let _ = writeln!(text, "{left} {a} {b}");
        }
        numbered.symbols(&mut text);
        text
    }

    /// The system in the binary format.
    pub fn binary(&self) -> Vec<u8> {
        let numbered = Numbered::of(self);
        let mut head = numbered.header("aig");
        for latch in &self.latches {
            let _ = writeln!(head, "{}", numbered.next(latch));
        }
        numbered.questions(&mut head);
        let mut bytes = head.into_bytes();
        for node in &numbered.gates {
            let [left, a, b] = numbered.gate(*node);
            put_delta(&mut bytes, left - a);
            put_delta(&mut bytes, a - b);
        }
        let mut symbols = String::new();
        numbered.symbols(&mut symbols);
        bytes.extend(symbols.into_bytes());
        bytes
    }
}

/// A number in groups of seven bits, the lowest first; the highest bit says that more follow.
fn put_delta(bytes: &mut Vec<u8>, mut delta: u32) {
    while delta > 0x7F {
        bytes.push(delta as u8 & 0x7F | 0x80);
        delta >>= 7;
    }
    bytes.push(delta as u8);
}

impl<'s> Numbered<'s> {
    fn of(system: &'s AigerSystem<'s>) -> Numbered<'s> {
        let graph = system.graph;
        let questions = system.bad.iter().chain(&system.constraints).map(|named| named.literal);
        let roots: Vec<Literal> =
            questions.chain(system.latches.iter().map(|latch| latch.next)).collect();
        let is_inside = super::cone(graph, &roots, |_| None);
        let mut variables = vec![0; graph.nodes().len()];
        let leaves = system.inputs.iter().map(|input| input.literal);
        let leaves = leaves.chain(system.latches.iter().map(|latch| latch.literal));
        let mut last = 0;
        for leaf in leaves {
            last += 1;
            variables[leaf.node() as usize] = last;
        }
        let is_gate = |node: &u32| matches!(graph.nodes()[*node as usize], GateNode::And(..));
        let all = (0..graph.nodes().len() as u32).filter(|node| is_inside[*node as usize]);
        let gates: Vec<u32> = all.filter(is_gate).collect();
        for node in &gates {
            last += 1;
            variables[*node as usize] = last;
        }
        Numbered { system, variables, gates }
    }

    fn number(&self, literal: Literal) -> u32 {
        Literal::of_node(self.variables[literal.node() as usize])
            .inverted_if(literal.is_inverted())
            .0
    }

    fn header(&self, format: &str) -> String {
        let AigerSystem { inputs, latches, bad, constraints, .. } = self.system;
        let (i, l, a) = (inputs.len(), latches.len(), self.gates.len());
        let (all, bad, constraints) = (i + l + a, bad.len(), constraints.len());
        format!("{format} {all} {i} {l} 0 {a} {bad} {constraints}\n")
    }

    /// The next literal of a latch and its reset value, which is left out if it is 0.
    fn next(&self, latch: &NamedLatch) -> String {
        let next = self.number(latch.next);
        match latch.initial {
            Some(false) => next.to_string(),
            Some(true) => format!("{next} 1"),
            None => format!("{next} {}", self.number(latch.literal)),
        }
    }

    fn questions(&self, text: &mut String) {
        for named in self.system.bad.iter().chain(&self.system.constraints) {
            let _ = writeln!(text, "{}", self.number(named.literal));
        }
    }

    /// A gate and its operands, the greater one first.
    fn gate(&self, node: u32) -> [u32; 3] {
        let GateNode::And(a, b) = self.system.graph.nodes()[node as usize] else {
            unreachable!("a gate is an AND")
        };
        let (a, b) = (self.number(a), self.number(b));
        [self.number(Literal::of_node(node)), a.max(b), a.min(b)]
    }

    fn symbols(&self, text: &mut String) {
        let AigerSystem { inputs, latches, bad, constraints, comment, .. } = self.system;
        let all = inputs.iter().map(|input| &input.name).enumerate().map(|named| ('i', named));
        let all = all.chain(latches.iter().map(|latch| &latch.name).enumerate().map(|n| ('l', n)));
        let all = all.chain(bad.iter().map(|bad| &bad.name).enumerate().map(|n| ('b', n)));
        let all = all.chain(constraints.iter().map(|c| &c.name).enumerate().map(|n| ('c', n)));
        for (kind, (number, name)) in all {
            let _ = writeln!(text, "{kind}{number} {name}");
        }
        if !comment.is_empty() {
            let _ = writeln!(text, "c\n{}", comment.trim_end());
        }
    }
}
