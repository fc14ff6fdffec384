//! k-induction: nothing is found in the first k scans, and nothing after k scans without it.
//!
//! Called by `mod`, before `reach`: what holds by itself is proved at once, and what is found, is
//! found with the fewest scans.

use super::solver::{BatsatSolver, Patience, Solved, Solver};
use super::system::ScanSystem;
use super::unroll::Unrolled;

/// The number of scans up to which all memories of a step must differ. The clauses grow with its
/// square.
const DIFFERENT_MAX: usize = 24;

/// What k-induction has found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Induced {
    /// It is never so; the number of scans of the step.
    Never(usize),
    /// The inputs after which it is so, by scan: the fewest scans.
    Found(Vec<Vec<bool>>),
    /// It is not so in this number of scans.
    Open(usize),
}

/// Decides by at most this number of scans. `has_step`: also whether it follows from the scans
/// before that it is not so.
pub(super) fn induce(
    system: &ScanSystem,
    has_step: bool,
    most: usize,
    patience: &Patience,
) -> Induced {
    let unrolled = |is_cold| Unrolled::new(system, BatsatSolver::new(patience), is_cold);
    let mut base = unrolled(true);
    let mut step = has_step.then(|| unrolled(false));
    for k in 0..most {
        base.add_scan();
        match ask(&mut base, k) {
            Solved::Yes => return Induced::Found(base.inputs()),
            Solved::No => base.exclude(k),
            Solved::GivenUp => return Induced::Open(k),
        }
        let Some(step) = &mut step else { continue };
        step.add_scan();
        if k < DIFFERENT_MAX {
            (0..k).for_each(|earlier| step.differ(earlier, k));
        }
        match ask(step, k) {
            Solved::No => return Induced::Never(k),
            Solved::Yes => step.exclude(k),
            Solved::GivenUp => return Induced::Open(k + 1),
        }
    }
    Induced::Open(most)
}

fn ask<S: Solver>(unrolled: &mut Unrolled<S>, scan: usize) -> Solved {
    match unrolled.found(scan) {
        Ok(false) => Solved::No,
        Ok(true) => unrolled.solver.solve(&[]),
        Err(lit) => unrolled.solver.solve(&[lit]),
    }
}
