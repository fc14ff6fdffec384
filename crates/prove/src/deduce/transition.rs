//! One scan in a solver: which memory leads to a cube, and which bits of it do.
//!
//! `reach` asks. A frame is a set of clauses with a literal of its own; a question about a frame
//! assumes the literals of this frame and all later ones.

use super::solver::{BatsatSolver, Patience, SatLit, Solved, Solver};
use super::system::ScanSystem;
use crate::aig::Literal;

/// The number of questions after which a solver begins anew, without what they left behind.
const QUESTIONS_MAX: usize = 2_000;

/// Some bits of memory, each as the literal that is ON. Sorted.
pub(super) type Cube = Vec<Literal>;

/// Whether a frame excludes something.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Blocked {
    /// It does; [`Transition::core`] has the reason.
    No,
    /// It does not: memory of this cube, with these inputs, leads there.
    By(Cube, Vec<bool>),
    /// The time is over.
    GivenUp,
}

/// A scan in a solver.
pub(super) struct Transition<'s> {
    system: &'s ScanSystem,
    patience: Patience,
    /// With the clauses of all frames; every scan is allowed.
    forward: BatsatSolver,
    /// Without clauses: which bits of a memory lead to something.
    backward: BatsatSolver,
    /// By frame: the literal that its clauses wait for.
    frames: Vec<SatLit>,
    /// By frame: the clauses.
    clauses: Vec<Vec<Cube>>,
    /// By bit: the index in [`ScanSystem::kept`].
    latch_of: Vec<u32>,
    questions: usize,
    /// The inputs of the last solution.
    inputs: Vec<bool>,
}

/// The solver's literal of one of the gates: every bit is the variable of its number.
fn lit(bit: Literal) -> SatLit {
    SatLit(bit.0)
}

/// A solver with the gates of a scan.
fn solver(system: &ScanSystem, patience: &Patience) -> BatsatSolver {
    let mut solver = BatsatSolver::new(patience);
    for _ in 0..system.bits {
        solver.new_var();
    }
    solver.add(&[lit(Literal::TRUE)]);
    for gate in &system.gates {
        let (both, [a, b]) = (lit(Literal(gate.bit << 1)), gate.reads.map(lit));
        solver.add(&[both.opposite(), a]);
        solver.add(&[both.opposite(), b]);
        solver.add(&[both, a.opposite(), b.opposite()]);
    }
    solver
}

impl<'s> Transition<'s> {
    /// A scan with frame 0, the cold start.
    pub fn new(system: &'s ScanSystem, patience: &Patience) -> Transition<'s> {
        let mut latch_of = vec![u32::MAX; system.bits];
        for (at, latch) in system.kept.iter().enumerate() {
            latch_of[latch.bit as usize] = at as u32;
        }
        let mut transition = Transition {
            system,
            patience: patience.clone(),
            forward: solver(system, patience),
            backward: solver(system, patience),
            frames: Vec::new(),
            clauses: Vec::new(),
            latch_of,
            questions: 0,
            inputs: Vec::new(),
        };
        transition.begin();
        transition.open_frame(1);
        transition
    }

    /// Opens the frames in a new solver.
    fn begin(&mut self) {
        self.forward.add(&[lit(self.system.allowed)]);
        let frames = self.clauses.len().max(1);
        self.frames.clear();
        (0..frames).for_each(|_| self.frames.push(self.forward.new_var()));
        let cold = self.frames[0].opposite();
        for latch in &self.system.kept {
            if let Some(init) = latch.init {
                let bit = SatLit(latch.bit << 1).opposite_if(!init);
                self.forward.add(&[cold, bit]);
            }
        }
        for frame in 0..self.clauses.len() {
            for cube in self.clauses[frame].clone() {
                self.add_clause(&cube, frame);
            }
        }
    }

    /// Opens all frames up to this one.
    pub fn open_frame(&mut self, frame: usize) {
        while self.frames.len() <= frame {
            let waits = self.forward.new_var();
            self.frames.push(waits);
        }
        self.clauses.resize(self.frames.len(), Vec::new());
    }

    /// Excludes a cube in a frame and all before it.
    pub fn exclude(&mut self, cube: &Cube, frame: usize) {
        self.clauses[frame].push(cube.clone());
        self.add_clause(cube, frame);
    }

    fn add_clause(&mut self, cube: &Cube, frame: usize) {
        let bits = cube.iter().map(|bit| lit(!*bit));
        let clause: Vec<SatLit> = bits.chain([self.frames[frame].opposite()]).collect();
        self.forward.add(&clause);
    }

    /// Whether memory of a cold start has all bits of a cube.
    pub fn is_cold(&self, cube: &Cube) -> bool {
        cube.iter().all(|bit| {
            let latch = &self.system.kept[self.latch_of[bit.node() as usize] as usize];
            latch.init.is_none_or(|init| init != bit.is_inverted())
        })
    }

    /// Whether a frame excludes the target.
    pub fn target(&mut self, frame: usize) -> Blocked {
        let found = lit(self.system.found);
        self.ask(frame, &[], &[found])
    }

    /// Whether memory of a frame, outside of the cube, leads to the cube.
    pub fn step_to(&mut self, cube: &Cube, frame: usize) -> Blocked {
        let next: Vec<SatLit> = cube.iter().map(|bit| lit(self.next(*bit))).collect();
        let outside: Vec<SatLit> = cube.iter().map(|bit| lit(!*bit)).collect();
        self.ask(frame, &outside, &next)
    }

    /// The literal that is ON at the end of a scan if the given one is ON in the next.
    fn next(&self, bit: Literal) -> Literal {
        let latch = &self.system.kept[self.latch_of[bit.node() as usize] as usize];
        latch.next.inverted_if(bit.is_inverted())
    }

    /// Whether memory of a frame, `outside` of something, leads to a goal.
    fn ask(&mut self, frame: usize, outside: &[SatLit], goal: &[SatLit]) -> Blocked {
        self.questions += 1;
        if self.questions.is_multiple_of(QUESTIONS_MAX) {
            self.forward = solver(self.system, &self.patience);
            self.backward = solver(self.system, &self.patience);
            self.begin();
        }
        let mut assumed: Vec<SatLit> = self.frames[frame..].to_vec();
        let only_now = (!outside.is_empty()).then(|| self.forward.new_var());
        if let Some(only_now) = only_now {
            let clause: Vec<SatLit> =
                outside.iter().copied().chain([only_now.opposite()]).collect();
            self.forward.add(&clause);
            assumed.push(only_now);
        }
        assumed.extend(goal);
        let solved = self.forward.solve(&assumed);
        let answer = match solved {
            Solved::GivenUp => Blocked::GivenUp,
            Solved::No => Blocked::No,
            Solved::Yes => self.lifted(goal),
        };
        if let Some(only_now) = only_now {
            self.forward.add(&[only_now.opposite()]);
        }
        answer
    }

    /// The bits of the solution's memory that, with its inputs, lead to a goal in a scan that is
    /// allowed.
    fn lifted(&mut self, goal: &[SatLit]) -> Blocked {
        let on = |solver: &BatsatSolver, number: u32| solver.is_on(SatLit(number << 1));
        self.inputs = self.system.inputs.iter().map(|input| on(&self.forward, *input)).collect();
        let memory = self.system.kept.iter().map(|latch| latch.bit);
        let memory: Cube = memory
            .map(|number| Literal(number << 1 | u32::from(!on(&self.forward, number))))
            .collect();
        let only_now = self.backward.new_var();
        let allowed = lit(self.system.allowed).opposite();
        let missed = goal.iter().map(|lit| lit.opposite()).chain([allowed, only_now.opposite()]);
        let missed: Vec<SatLit> = missed.collect();
        self.backward.add(&missed);
        let inputs = self.system.inputs.iter().zip(&self.inputs);
        let inputs = inputs.map(|(input, value)| SatLit(input << 1).opposite_if(!value));
        let mut assumed: Vec<SatLit> = inputs.collect();
        assumed.push(only_now);
        assumed.extend(memory.iter().map(|bit| lit(*bit)));
        let answer = match self.backward.solve(&assumed) {
            Solved::No => {
                let mut cube = memory;
                cube.retain(|bit| self.backward.is_in_core(lit(*bit)));
                cube.sort_unstable();
                Blocked::By(cube, self.inputs.clone())
            }
            // A solution of the one is none of the other: the time is over.
            Solved::Yes | Solved::GivenUp => Blocked::GivenUp,
        };
        self.backward.add(&[only_now.opposite()]);
        answer
    }

    /// After [`Blocked::No`] of [`Transition::step_to`]: the bits of the cube that are the reason,
    /// and at least one that a cold start does not have.
    pub fn core(&self, cube: &Cube) -> Cube {
        let is_in_core = |bit: &&Literal| self.forward.is_in_core(lit(self.next(**bit)));
        let mut core: Cube = cube.iter().filter(is_in_core).copied().collect();
        if self.is_cold(&core)
            && let Some(warm) = cube.iter().find(|bit| !self.is_cold(&vec![**bit]))
        {
            core.push(*warm);
            core.sort_unstable();
        }
        core
    }

    /// The inputs of the last answer [`Blocked::By`].
    pub fn inputs(&self) -> Vec<bool> {
        self.inputs.clone()
    }
}
