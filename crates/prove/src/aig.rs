//! An and-inverter graph: every condition about a scan as ANDs of two literals.
//!
//! `encode` builds one from a model, the solvers read it, `aiger` writes it. Equal gates are made
//! once, and gates whose value follows from two levels of their operands are not made at all. A
//! node's operands come before it, so the numbers of the nodes are an order of evaluation.

pub mod aiger;
pub mod simulator;

use rustc_hash::FxHashMap;
use std::ops::Not;

/// A node of a graph, or its opposite: twice the node's number, plus 1 for the opposite.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Literal(pub u32);

impl Literal {
    /// Always OFF: node 0.
    pub const FALSE: Literal = Literal(0);
    /// Always ON.
    pub const TRUE: Literal = Literal(1);

    /// The literal of a node.
    pub fn of_node(node: u32) -> Literal {
        Literal(node << 1)
    }

    /// The literal that is always `on`.
    pub fn constant(on: bool) -> Literal {
        Literal(u32::from(on))
    }

    /// The number of its node.
    pub fn node(self) -> u32 {
        self.0 >> 1
    }

    /// Whether it is the opposite of its node.
    pub fn is_inverted(self) -> bool {
        self.0 & 1 == 1
    }

    /// Its value if it is constant.
    pub fn as_constant(self) -> Option<bool> {
        (self.node() == 0).then(|| self.is_inverted())
    }

    /// The same literal, or its opposite if `inverts`.
    pub fn inverted_if(self, inverts: bool) -> Literal {
        Literal(self.0 ^ u32::from(inverts))
    }
}

impl Not for Literal {
    type Output = Literal;

    fn not(self) -> Literal {
        Literal(self.0 ^ 1)
    }
}

/// A node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GateNode {
    /// Always OFF.
    Constant,
    /// An input: free in every step.
    Input,
    /// A latch: its value is that of its next literal in the step before.
    Latch,
    /// The AND of two literals of earlier nodes.
    And(Literal, Literal),
}

/// An and-inverter graph.
#[derive(Clone, Debug)]
pub struct GateGraph {
    nodes: Vec<GateNode>,
    ands: FxHashMap<(Literal, Literal), u32>,
}

impl Default for GateGraph {
    fn default() -> GateGraph {
        GateGraph { nodes: vec![GateNode::Constant], ands: FxHashMap::default() }
    }
}

/// The number of levels of operands that [`GateGraph::and`] looks at.
const LEVELS: u32 = 3;

impl GateGraph {
    /// All nodes, by number.
    pub fn nodes(&self) -> &[GateNode] {
        &self.nodes
    }

    /// The node of a literal.
    pub fn node(&self, literal: Literal) -> GateNode {
        self.nodes[literal.node() as usize]
    }

    fn push(&mut self, node: GateNode) -> u32 {
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }

    /// A new input.
    pub fn input(&mut self) -> Literal {
        Literal::of_node(self.push(GateNode::Input))
    }

    /// A new latch. Its next literal and its initial value are kept beside the graph.
    pub fn latch(&mut self) -> Literal {
        Literal::of_node(self.push(GateNode::Latch))
    }

    /// `a & b`.
    pub fn and(&mut self, a: Literal, b: Literal) -> Literal {
        let (mut a, mut b) = (a, b);
        loop {
            if a == Literal::FALSE || b == Literal::FALSE || a == !b {
                return Literal::FALSE;
            }
            if a == Literal::TRUE || a == b {
                return b;
            }
            if b == Literal::TRUE {
                return a;
            }
            let given = self.given(a, b, LEVELS);
            if given != b {
                b = given;
                continue;
            }
            let given = self.given(b, a, LEVELS);
            if given == a {
                break;
            }
            a = given;
        }
        let key = (a.min(b), a.max(b));
        if let Some(node) = self.ands.get(&key) {
            return Literal::of_node(*node);
        }
        let node = self.push(GateNode::And(key.0, key.1));
        self.ands.insert(key, node);
        Literal::of_node(node)
    }

    /// A literal that equals `literal` wherever `condition` is ON, without a new node.
    fn given(&self, condition: Literal, literal: Literal, levels: u32) -> Literal {
        if literal.node() == condition.node() {
            return Literal::constant(literal == condition);
        }
        let GateNode::And(a, b) = self.node(literal) else { return literal };
        if levels == 0 {
            return literal;
        }
        let (a_given, b_given) =
            (self.given(condition, a, levels - 1), self.given(condition, b, levels - 1));
        let joined = if a_given == Literal::FALSE || b_given == Literal::FALSE {
            Literal::FALSE
        } else if a_given == Literal::TRUE {
            b_given
        } else if b_given == Literal::TRUE {
            a_given
        } else {
            return literal;
        };
        joined.inverted_if(literal.is_inverted())
    }

    /// `a | b`.
    pub fn or(&mut self, a: Literal, b: Literal) -> Literal {
        !self.and(!a, !b)
    }

    /// Whether `a` and `b` differ.
    pub fn xor(&mut self, a: Literal, b: Literal) -> Literal {
        let inverts = a.is_inverted() != b.is_inverted();
        let (a, b) = (Literal::of_node(a.node()), Literal::of_node(b.node()));
        let (only_a, only_b) = (self.and(a, !b), self.and(!a, b));
        self.or(only_a, only_b).inverted_if(inverts)
    }

    /// `on` while `choice` is ON, else `off`.
    pub fn mux(&mut self, choice: Literal, on: Literal, off: Literal) -> Literal {
        if let Some(choice) = choice.as_constant() {
            return if choice { on } else { off };
        }
        let on = self.given(choice, on, LEVELS);
        let off = self.given(!choice, off, LEVELS);
        if on == off {
            return on;
        }
        if on == !off {
            return self.xor(choice, off);
        }
        let (on, off) = (self.and(choice, on), self.and(!choice, off));
        self.or(on, off)
    }

    /// Whether all are ON.
    pub fn all(&mut self, literals: impl IntoIterator<Item = Literal>) -> Literal {
        literals.into_iter().fold(Literal::TRUE, |all, literal| self.and(all, literal))
    }

    /// Whether any is ON.
    pub fn any(&mut self, literals: impl IntoIterator<Item = Literal>) -> Literal {
        literals.into_iter().fold(Literal::FALSE, |any, literal| self.or(any, literal))
    }
}

/// The cone of some roots in a graph: for each node whether a root depends on it. `next` gives the
/// next literal of a latch's node.
pub fn cone(
    graph: &GateGraph,
    roots: &[Literal],
    next: impl Fn(u32) -> Option<Literal>,
) -> Vec<bool> {
    let mut is_inside = vec![false; graph.nodes.len()];
    let mut open: Vec<u32> = roots.iter().map(|root| root.node()).collect();
    while let Some(node) = open.pop() {
        if std::mem::replace(&mut is_inside[node as usize], true) {
            continue;
        }
        match graph.nodes[node as usize] {
            GateNode::Constant | GateNode::Input => {}
            GateNode::Latch => open.extend(next(node).map(Literal::node)),
            GateNode::And(a, b) => open.extend([a.node(), b.node()]),
        }
    }
    is_inside
}
