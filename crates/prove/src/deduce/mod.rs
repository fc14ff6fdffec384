//! Deducing: decides a question about the gates of a scan with a solver.
//!
//! First k-induction: what holds by itself is proved at once, and what is near is found with the
//! fewest scans. What stays open goes to property-directed reachability (`reach`). A run that is
//! found is tried on the gates before it is told; the caller tries it on the engine.

mod induction;
mod reach;
mod solver;
pub mod system;
#[cfg(test)]
mod tests;
mod transition;
mod unroll;

use crate::aig::Literal;
use induction::{Induced, induce};
use reach::{Reachability, reach};
pub use solver::Patience;
use solver::{BatsatSolver, Solved, Solver};
use system::ScanSystem;
use unroll::{Unrolled, leads};

/// The number of scans up to which induction tries alone.
const SCANS_MAX: usize = 12;

/// What deducing has found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Deduced {
    /// It is never so.
    Never(Reason),
    /// The values of [`ScanSystem::inputs`] after which it is so, by scan.
    Found(Vec<Vec<bool>>),
    /// It is not so in this number of scans; the time is over.
    Open(usize),
}

/// Why something is never so.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reason {
    /// It follows from this number of scans before, whatever their memory.
    Induction(usize),
    /// In every scan at least one bit of each of these is OFF.
    Invariant(Vec<Vec<Literal>>),
}

/// Decides a question.
pub fn deduce(system: &ScanSystem, patience: &Patience) -> Deduced {
    match induce(system, true, SCANS_MAX, patience) {
        Induced::Never(scans) => return Deduced::Never(Reason::Induction(scans)),
        Induced::Found(inputs) if leads(system, &inputs) => return Deduced::Found(inputs),
        Induced::Found(_) | Induced::Open(_) => {}
    }
    match reach(system, patience) {
        Reachability::Never(invariant) => Deduced::Never(Reason::Invariant(invariant)),
        Reachability::Found(inputs) if leads(system, &inputs) => shortest(system, inputs, patience),
        Reachability::Found(inputs) => Deduced::Open(inputs.len()),
        Reachability::Open(scans) => Deduced::Open(scans),
    }
}

/// The shortest inputs that are found in the time that is left.
fn shortest(system: &ScanSystem, known: Vec<Vec<bool>>, patience: &Patience) -> Deduced {
    match induce(system, false, known.len(), patience) {
        Induced::Found(inputs) if leads(system, &inputs) => Deduced::Found(inputs),
        Induced::Found(_) | Induced::Never(_) | Induced::Open(_) => Deduced::Found(known),
    }
}

/// Whether there is a first scan; `true` if the time is over.
pub fn has_first_scan(system: &ScanSystem, patience: &Patience) -> bool {
    let mut first = Unrolled::new(system, BatsatSolver::new(patience), true);
    first.add_scan();
    first.solver.solve(&[]) != Solved::No
}

/// An invariant that excludes what is looked for; `None`: it is found, or the time is over.
pub fn invariant(system: &ScanSystem, patience: &Patience) -> Option<Vec<Vec<Literal>>> {
    match reach(system, patience) {
        Reachability::Never(invariant) => Some(invariant),
        Reachability::Found(_) | Reachability::Open(_) => None,
    }
}
