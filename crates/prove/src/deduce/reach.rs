//! Property-directed reachability: proves by clauses that hold in the first scan, are kept by every
//! scan, and exclude what is looked for.
//!
//! Called by `mod` for what k-induction leaves open. `frames[i]` excludes memory that no i scans
//! reach. A memory from which the target is reached is excluded by a clause as short as it can be,
//! or leads back to the cold start. Two frames with the same clauses are the proof. (A. Bradley:
//! SAT-Based Model Checking without Unrolling, 2011; N. Eén, A. Mishchenko, R. Brayton: Efficient
//! Implementation of Property Directed Reachability, 2011.)

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::solver::Patience;
use super::system::ScanSystem;
use super::transition::{Blocked, Cube, Transition};

/// What reachability has found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Reachability {
    /// It is never so. In every scan at least one bit of each cube differs: the invariant.
    Never(Vec<Cube>),
    /// The inputs after which it is so, by scan.
    Found(Vec<Vec<bool>>),
    /// It is not so in this number of scans.
    Open(usize),
}

/// Memory that leads to the target.
struct Obligation {
    cube: Cube,
    /// The inputs of the scan that begins with it.
    inputs: Vec<bool>,
    /// What this scan leads to; `None`: the target is ON in it.
    then: Option<usize>,
}

/// Decides a system.
pub(super) fn reach(system: &ScanSystem, patience: &Patience) -> Reachability {
    let mut search = ReachSearch {
        transition: Transition::new(system, patience),
        frames: vec![Vec::new(), Vec::new()],
        obligations: Vec::new(),
    };
    if let Blocked::By(..) = search.transition.target(0) {
        return Reachability::Found(vec![search.transition.inputs()]);
    }
    loop {
        let top = search.frames.len() - 1;
        search.transition.open_frame(top);
        match search.exclude_target(top) {
            Ended::Excluded => {}
            Ended::Found(first) => return Reachability::Found(search.path(first)),
            Ended::GivenUp => return Reachability::Open(top),
        }
        search.frames.push(Vec::new());
        match search.propagate() {
            Some(Ok(invariant)) => return Reachability::Never(invariant),
            Some(Err(())) => return Reachability::Open(top + 1),
            None => {}
        }
    }
}

/// How the exclusion of the target in a frame has ended.
enum Ended {
    Excluded,
    /// The obligation that a cold start meets.
    Found(usize),
    GivenUp,
}

struct ReachSearch<'s> {
    transition: Transition<'s>,
    /// By frame: the cubes that are excluded in it and in all before it.
    frames: Vec<Vec<Cube>>,
    obligations: Vec<Obligation>,
}

impl ReachSearch<'_> {
    fn exclude_target(&mut self, top: usize) -> Ended {
        loop {
            match self.transition.target(top) {
                Blocked::No => return Ended::Excluded,
                Blocked::GivenUp => return Ended::GivenUp,
                Blocked::By(cube, inputs) => {
                    self.obligations.push(Obligation { cube, inputs, then: None });
                    let first = self.obligations.len() - 1;
                    match self.block(first, top) {
                        Ended::Excluded => {}
                        ended @ (Ended::Found(_) | Ended::GivenUp) => return ended,
                    }
                }
            }
        }
    }

    /// Excludes an obligation, and all that lead to it.
    fn block(&mut self, first: usize, top: usize) -> Ended {
        let mut open = BinaryHeap::from([Reverse((top, first))]);
        while let Some(Reverse((frame, number))) = open.pop() {
            let cube = self.obligations[number].cube.clone();
            if frame == 0 || self.transition.is_cold(&cube) {
                return Ended::Found(number);
            }
            if self.is_excluded(&cube, frame) {
                continue;
            }
            match self.transition.step_to(&cube, frame - 1) {
                Blocked::GivenUp => return Ended::GivenUp,
                Blocked::No => {
                    let core = self.transition.core(&cube);
                    let Some(short) = self.shorten(core, frame) else { return Ended::GivenUp };
                    let at = match self.lift(&short, frame, top) {
                        Some(at) => at,
                        None => return Ended::GivenUp,
                    };
                    self.exclude(short, at);
                    if at < top {
                        open.push(Reverse((at + 1, number)));
                    }
                }
                Blocked::By(before, inputs) => {
                    self.obligations.push(Obligation { cube: before, inputs, then: Some(number) });
                    open.push(Reverse((frame - 1, self.obligations.len() - 1)));
                    open.push(Reverse((frame, number)));
                }
            }
        }
        Ended::Excluded
    }

    /// Whether a clause of a frame or of a later one excludes all memory of a cube.
    fn is_excluded(&self, cube: &Cube, frame: usize) -> bool {
        let later = self.frames.get(frame..).unwrap_or_default();
        later.iter().flatten().any(|known| is_part(known, cube))
    }

    /// The cube without the bits that need not be in it; `None`: the time is over.
    fn shorten(&mut self, mut cube: Cube, frame: usize) -> Option<Cube> {
        let mut at = 0;
        while at < cube.len() && cube.len() > 1 {
            let mut shorter = cube.clone();
            shorter.remove(at);
            if self.transition.is_cold(&shorter) {
                at += 1;
                continue;
            }
            match self.transition.step_to(&shorter, frame - 1) {
                Blocked::GivenUp => return None,
                Blocked::By(..) => at += 1,
                Blocked::No => cube = self.transition.core(&shorter),
            }
        }
        Some(cube)
    }

    /// The last frame in which a cube is excluded by itself; `None`: the time is over.
    fn lift(&mut self, cube: &Cube, from: usize, top: usize) -> Option<usize> {
        let mut at = from;
        while at < top {
            match self.transition.step_to(cube, at) {
                Blocked::GivenUp => return None,
                Blocked::By(..) => break,
                Blocked::No => at += 1,
            }
        }
        Some(at)
    }

    fn exclude(&mut self, cube: Cube, frame: usize) {
        for earlier in &mut self.frames[..=frame] {
            earlier.retain(|known| !is_part(&cube, known));
        }
        self.transition.exclude(&cube, frame);
        self.frames[frame].push(cube);
    }

    /// Moves each clause to the last frame in which it holds. `Some`: the invariant, or the time is
    /// over.
    fn propagate(&mut self) -> Option<Result<Vec<Cube>, ()>> {
        let top = self.frames.len() - 1;
        self.transition.open_frame(top);
        for frame in 1..top {
            for cube in std::mem::take(&mut self.frames[frame]) {
                match self.transition.step_to(&cube, frame) {
                    Blocked::GivenUp => return Some(Err(())),
                    Blocked::By(..) => self.frames[frame].push(cube),
                    Blocked::No => {
                        self.transition.exclude(&cube, frame + 1);
                        self.frames[frame + 1].push(cube);
                    }
                }
            }
            if self.frames[frame].is_empty() {
                return Some(Ok(self.frames[frame + 1..].iter().flatten().cloned().collect()));
            }
        }
        None
    }

    /// The inputs from a cold start on.
    fn path(&self, first: usize) -> Vec<Vec<bool>> {
        let mut at = Some(first);
        let mut scans = Vec::new();
        while let Some(number) = at {
            let obligation = &self.obligations[number];
            scans.push(obligation.inputs.clone());
            at = obligation.then;
        }
        scans
    }
}

/// Whether all bits of a sorted cube are in another one.
fn is_part(part: &Cube, whole: &Cube) -> bool {
    let mut rest = whole.iter();
    part.iter().all(|bit| rest.any(|other| other == bit))
}
