//! Scan after scan as one formula: is what is looked for ON in scan k, from a cold start or from
//! any memory?
//!
//! `induction` uses it for both. A bit that has the same value in all runs is folded: from a cold
//! start, most of the first scans are.

use super::solver::{SatLit, Solver};
use super::system::{System, on};
use crate::aig::Literal;

/// The value of a bit in a scan: known, or a variable of the solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Value {
    Known(bool),
    Open(SatLit),
}

impl Value {
    fn opposite_if(self, is_opposite: bool) -> Value {
        match self {
            Value::Known(value) => Value::Known(value != is_opposite),
            Value::Open(lit) => Value::Open(lit.opposite_if(is_opposite)),
        }
    }
}

/// The scans of a system in a solver.
pub(super) struct Unrolled<'s, S> {
    system: &'s System,
    pub solver: S,
    /// By scan: the values of all bits.
    scans: Vec<Vec<Value>>,
    is_cold: bool,
}

impl<'s, S: Solver> Unrolled<'s, S> {
    /// No scan yet. `is_cold`: the first one has memory as started, else any.
    pub fn new(system: &'s System, solver: S, is_cold: bool) -> Unrolled<'s, S> {
        Unrolled { system, solver, scans: Vec::new(), is_cold }
    }

    /// Adds the next scan, which is allowed.
    pub fn add_scan(&mut self) {
        let mut values = vec![Value::Known(false); self.system.bits];
        for input in &self.system.inputs {
            values[*input as usize] = Value::Open(self.solver.new_var());
        }
        for latch in &self.system.kept {
            values[latch.bit as usize] = match (self.scans.last(), latch.init) {
                (Some(before), _) => value(before, latch.next),
                (None, Some(init)) if self.is_cold => Value::Known(init),
                (None, _) => Value::Open(self.solver.new_var()),
            };
        }
        for gate in &self.system.gates {
            let [a, b] = gate.reads.map(|bit| value(&values, bit));
            values[gate.bit as usize] = self.both(a, b);
        }
        match value(&values, self.system.allowed) {
            Value::Known(true) => {}
            Value::Known(false) => self.solver.add(&[]),
            Value::Open(lit) => self.solver.add(&[lit]),
        }
        self.scans.push(values);
    }

    fn both(&mut self, a: Value, b: Value) -> Value {
        match (a, b) {
            (Value::Known(false), _) | (_, Value::Known(false)) => Value::Known(false),
            (Value::Known(true), other) | (other, Value::Known(true)) => other,
            (Value::Open(a), Value::Open(b)) if a == b => Value::Open(a),
            (Value::Open(a), Value::Open(b)) if a == b.opposite() => Value::Known(false),
            (Value::Open(a), Value::Open(b)) => {
                let both = self.solver.new_var();
                self.solver.add(&[both.opposite(), a]);
                self.solver.add(&[both.opposite(), b]);
                self.solver.add(&[both, a.opposite(), b.opposite()]);
                Value::Open(both)
            }
        }
    }

    /// What is looked for in a scan: known, or a literal.
    pub fn found(&self, scan: usize) -> Result<bool, SatLit> {
        match value(&self.scans[scan], self.system.found) {
            Value::Known(known) => Ok(known),
            Value::Open(lit) => Err(lit),
        }
    }

    /// From now on it is not so in a scan.
    pub fn exclude(&mut self, scan: usize) {
        match self.found(scan) {
            Ok(true) => self.solver.add(&[]),
            Ok(false) => {}
            Err(lit) => self.solver.add(&[lit.opposite()]),
        }
    }

    /// From now on the memory of two scans is different.
    pub fn differ(&mut self, a: usize, b: usize) {
        let mut some = Vec::new();
        for latch in &self.system.kept {
            let bit = Literal(latch.bit << 1);
            match (value(&self.scans[a], bit), value(&self.scans[b], bit)) {
                (Value::Known(a), Value::Known(b)) if a == b => {}
                (Value::Open(a), Value::Open(b)) if a == b => {}
                (a, b) => match self.different(a, b) {
                    Value::Known(true) => return,
                    Value::Known(false) => {}
                    Value::Open(lit) => some.push(lit),
                },
            }
        }
        self.solver.add(&some);
    }

    fn different(&mut self, a: Value, b: Value) -> Value {
        let both = self.both(a, b);
        let none = self.both(a.opposite_if(true), b.opposite_if(true));
        self.both(both.opposite_if(true), none.opposite_if(true))
    }

    /// The values of the inputs in the solution, by scan, in the order of [`System::inputs`].
    pub fn inputs(&self) -> Vec<Vec<bool>> {
        let of_scan = |values: &Vec<Value>| {
            let inputs = self.system.inputs.iter();
            inputs
                .map(|input| match values[*input as usize] {
                    Value::Known(known) => known,
                    Value::Open(lit) => self.solver.is_on(lit),
                })
                .collect()
        };
        self.scans.iter().map(of_scan).collect()
    }
}

fn value(values: &[Value], bit: Literal) -> Value {
    values[bit.node() as usize].opposite_if(bit.is_inverted())
}

/// Whether inputs, from a cold start, lead to what is looked for in their last scan, and to nothing
/// that is not allowed.
pub(super) fn leads(system: &System, inputs: &[Vec<bool>]) -> bool {
    let mut values = vec![false; system.bits];
    let init = |latch: &super::system::KeptBit| latch.init.unwrap_or(false);
    let mut kept: Vec<bool> = system.kept.iter().map(init).collect();
    let mut is_found = false;
    for scan in inputs {
        for (latch, value) in system.kept.iter().zip(&kept) {
            values[latch.bit as usize] = *value;
        }
        for (input, value) in system.inputs.iter().zip(scan) {
            values[*input as usize] = *value;
        }
        system.evaluate(&mut values);
        if !on(&values, system.allowed) {
            return false;
        }
        is_found = on(&values, system.found);
        kept = system.kept.iter().map(|latch| on(&values, latch.next)).collect();
    }
    is_found
}
