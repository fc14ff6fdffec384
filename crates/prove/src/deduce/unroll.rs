//! Scan after scan as one formula: is what is looked for ON in scan k, from a cold start or from
//! any memory?
//!
//! `induction` uses it for both. A bit that has the same value in all runs is folded: from a cold
//! start, most of the first scans are.

use super::solver::{SatLit, Solver};
use super::system::{ScanSystem, on};
use crate::aig::Literal;

/// The value of a bit in a scan: known, or a variable of the solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ScanValue {
    Known(bool),
    Open(SatLit),
}

impl ScanValue {
    fn opposite_if(self, is_opposite: bool) -> ScanValue {
        match self {
            ScanValue::Known(value) => ScanValue::Known(value != is_opposite),
            ScanValue::Open(lit) => ScanValue::Open(lit.opposite_if(is_opposite)),
        }
    }
}

/// The scans of a system in a solver.
pub(super) struct Unrolled<'s, S> {
    system: &'s ScanSystem,
    pub solver: S,
    /// By scan: the values of all bits.
    scans: Vec<Vec<ScanValue>>,
    is_cold: bool,
}

impl<'s, S: Solver> Unrolled<'s, S> {
    /// No scan yet. `is_cold`: the first one has memory as started, else any.
    pub fn new(system: &'s ScanSystem, solver: S, is_cold: bool) -> Unrolled<'s, S> {
        Unrolled { system, solver, scans: Vec::new(), is_cold }
    }

    /// Adds the next scan, which is allowed.
    pub fn add_scan(&mut self) {
        let mut values = vec![ScanValue::Known(false); self.system.bits];
        for input in &self.system.inputs {
            values[*input as usize] = ScanValue::Open(self.solver.new_var());
        }
        for latch in &self.system.kept {
            values[latch.bit as usize] = match (self.scans.last(), latch.init) {
                (Some(before), _) => value(before, latch.next),
                (None, Some(init)) if self.is_cold => ScanValue::Known(init),
                (None, _) => ScanValue::Open(self.solver.new_var()),
            };
        }
        for gate in &self.system.gates {
            let [a, b] = gate.reads.map(|bit| value(&values, bit));
            values[gate.bit as usize] = self.both(a, b);
        }
        match value(&values, self.system.allowed) {
            ScanValue::Known(true) => {}
            ScanValue::Known(false) => self.solver.add(&[]),
            ScanValue::Open(lit) => self.solver.add(&[lit]),
        }
        self.scans.push(values);
    }

    fn both(&mut self, a: ScanValue, b: ScanValue) -> ScanValue {
        match (a, b) {
            (ScanValue::Known(false), _) | (_, ScanValue::Known(false)) => ScanValue::Known(false),
            (ScanValue::Known(true), other) | (other, ScanValue::Known(true)) => other,
            (ScanValue::Open(a), ScanValue::Open(b)) if a == b => ScanValue::Open(a),
            (ScanValue::Open(a), ScanValue::Open(b)) if a == b.opposite() => {
                ScanValue::Known(false)
            }
            (ScanValue::Open(a), ScanValue::Open(b)) => {
                let both = self.solver.new_var();
                self.solver.add(&[both.opposite(), a]);
                self.solver.add(&[both.opposite(), b]);
                self.solver.add(&[both, a.opposite(), b.opposite()]);
                ScanValue::Open(both)
            }
        }
    }

    /// What is looked for in a scan: known, or a literal.
    pub fn found(&self, scan: usize) -> Result<bool, SatLit> {
        match value(&self.scans[scan], self.system.found) {
            ScanValue::Known(known) => Ok(known),
            ScanValue::Open(lit) => Err(lit),
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
                (ScanValue::Known(a), ScanValue::Known(b)) if a == b => {}
                (ScanValue::Open(a), ScanValue::Open(b)) if a == b => {}
                (a, b) => match self.different(a, b) {
                    ScanValue::Known(true) => return,
                    ScanValue::Known(false) => {}
                    ScanValue::Open(lit) => some.push(lit),
                },
            }
        }
        self.solver.add(&some);
    }

    fn different(&mut self, a: ScanValue, b: ScanValue) -> ScanValue {
        let both = self.both(a, b);
        let none = self.both(a.opposite_if(true), b.opposite_if(true));
        self.both(both.opposite_if(true), none.opposite_if(true))
    }

    /// The values of the inputs in the solution, by scan, in the order of [`ScanSystem::inputs`].
    pub fn inputs(&self) -> Vec<Vec<bool>> {
        let of_scan = |values: &Vec<ScanValue>| {
            let inputs = self.system.inputs.iter();
            inputs
                .map(|input| match values[*input as usize] {
                    ScanValue::Known(known) => known,
                    ScanValue::Open(lit) => self.solver.is_on(lit),
                })
                .collect()
        };
        self.scans.iter().map(of_scan).collect()
    }
}

fn value(values: &[ScanValue], bit: Literal) -> ScanValue {
    values[bit.node() as usize].opposite_if(bit.is_inverted())
}

/// Whether inputs, from a cold start, lead to what is looked for in their last scan, and to nothing
/// that is not allowed.
pub(super) fn leads(system: &ScanSystem, inputs: &[Vec<bool>]) -> bool {
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
