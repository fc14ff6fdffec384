//! A solver of boolean formulas in conjunctive form, and the one that rungd uses.
//!
//! `unroll` and `reach` give it clauses and ask. Nothing else knows which solver it is.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use batsat::{Callbacks, Lit, Solver as Batsat, SolverInterface, SolverOpts, lbool};

/// A variable of the solver, or its opposite: twice the variable, plus 1 for the opposite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct SatLit(pub u32);

impl SatLit {
    pub fn opposite(self) -> SatLit {
        SatLit(self.0 ^ 1)
    }

    /// The literal, or its opposite.
    pub fn opposite_if(self, is_opposite: bool) -> SatLit {
        SatLit(self.0 ^ u32::from(is_opposite))
    }
}

/// The answer of a solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Solved {
    /// There is a solution; [`Solver::is_on`] has it.
    Yes,
    /// There is none; [`Solver::is_in_core`] has the assumptions that exclude it.
    No,
    /// The time is over.
    GivenUp,
}

/// When a solver gives up.
#[derive(Clone, Debug)]
pub struct Patience {
    /// The end of its time.
    pub deadline: Instant,
    /// The answer is no longer wanted: one of these is set.
    pub flags: [Arc<AtomicBool>; 2],
    /// How often it may ask whether to give up: at each of its decisions. Without a limit, `None`.
    pub effort: Option<Arc<AtomicU64>>,
}

impl Patience {
    /// As long as this from now on, unless the flag is set.
    pub fn new(time: Duration, flag: &Arc<AtomicBool>) -> Patience {
        let never = Arc::new(AtomicBool::new(false));
        let flags = [never, Arc::clone(flag)];
        Patience { deadline: Instant::now() + time, flags, effort: None }
    }

    /// Takes one of its decisions; false if none is left.
    fn takes(&self) -> bool {
        let Some(effort) = &self.effort else { return true };
        effort
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1))
            .is_ok()
    }

    /// Whether to give up now.
    pub fn is_over(&self) -> bool {
        !self.takes()
            || self.flags.iter().any(|flag| flag.load(Ordering::Relaxed))
            || Instant::now() >= self.deadline
    }
}

/// A solver that keeps its clauses from one question to the next.
pub(super) trait Solver {
    fn new_var(&mut self) -> SatLit;

    /// Adds a clause: one of these is ON.
    fn add(&mut self, clause: &[SatLit]);

    /// Whether all clauses can be so together with these assumptions.
    fn solve(&mut self, assumptions: &[SatLit]) -> Solved;

    /// The value in the solution.
    fn is_on(&self, lit: SatLit) -> bool;

    /// Whether an assumption is among those that exclude every solution.
    fn is_in_core(&self, assumption: SatLit) -> bool;
}

/// batsat, a MiniSat in Rust.
pub(super) struct BatsatSolver {
    solver: Batsat<Watched>,
    clause: Vec<Lit>,
}

/// Ends the search when the time is over.
struct Watched(Patience);

impl Callbacks for Watched {
    fn stop(&self) -> bool {
        self.0.is_over()
    }
}

impl BatsatSolver {
    pub fn new(patience: &Patience) -> BatsatSolver {
        let solver = Batsat::new(SolverOpts::default(), Watched(patience.clone()));
        BatsatSolver { solver, clause: Vec::new() }
    }

    fn lit(&mut self, SatLit(lit): SatLit) -> Lit {
        Lit::new(self.solver.var_of_int(lit >> 1), lit & 1 == 0)
    }
}

impl Solver for BatsatSolver {
    fn new_var(&mut self) -> SatLit {
        let var = self.solver.new_var_default();
        SatLit(var.idx() << 1)
    }

    fn add(&mut self, clause: &[SatLit]) {
        let mut lits = std::mem::take(&mut self.clause);
        lits.clear();
        for lit in clause {
            let lit = self.lit(*lit);
            lits.push(lit);
        }
        self.solver.add_clause_reuse(&mut lits);
        self.clause = lits;
    }

    fn solve(&mut self, assumptions: &[SatLit]) -> Solved {
        let assumed: Vec<Lit> = assumptions.iter().map(|lit| self.lit(*lit)).collect();
        match self.solver.solve_limited(&assumed) {
            found if found == lbool::TRUE => Solved::Yes,
            found if found == lbool::FALSE => Solved::No,
            _ => Solved::GivenUp,
        }
    }

    fn is_on(&self, SatLit(lit): SatLit) -> bool {
        let lit = Lit::new(batsat::Var::unsafe_from_idx(lit >> 1), lit & 1 == 0);
        self.solver.value_lit(lit) == lbool::TRUE
    }

    fn is_in_core(&self, SatLit(lit): SatLit) -> bool {
        let lit = Lit::new(batsat::Var::unsafe_from_idx(lit >> 1), lit & 1 == 0);
        self.solver.unsat_core_contains_lit(!lit)
    }
}
