//! Both ways at once about one question: the first answer counts.
//!
//! Called by `decide` and `equal`. What deducing finds is tried on the engine: a run that needs a
//! value of a cut which the engine never computes is no answer.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

use crate::answer::{DEDUCING, EXPLORING, Way};
use crate::cone::Cone;
use crate::deduce::system::ScanSystem;
use crate::deduce::{Deduced, Patience, Reason, deduce};
use crate::encode::{encode, obstacle};
use crate::events::ScanEvent;
use crate::explore::{Attained, ExploreLimits, Explored, explore_can, explore_cone};
use crate::gates::{GateCut, Gates};
use crate::gates_merged::merged;
use crate::model::{Path, ProofModel, Run, Target};
use rungd_language::source::wording::counted;

/// The maximum number of combinations of the inputs before each scan: 2 to the 12th.
const COMBINATIONS_MAX: u64 = 4_096;

/// The number of states up to which exploring tries alone.
const FEW_STATES: u64 = 2_000;

/// The effort of an answer that does not depend on the machine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// The number of scans that exploring executes first.
    few_scans: u64,
    /// The number of decisions of the solver, which comes next.
    decisions: u64,
    /// The number of scans that exploring executes after it; 0: it is not tried again.
    many_scans: u64,
}

impl Effort {
    /// For a fact of a survey.
    pub const SURVEY: Effort = Effort { few_scans: 5_000, decisions: 50_000, many_scans: 200_000 };
    /// For one of many mistakes, of which most change something.
    pub const MISTAKE: Effort = Effort { few_scans: 5_000, decisions: 10_000, many_scans: 0 };
}

/// The limits of a race.
#[derive(Clone, Debug)]
pub(crate) struct Race {
    /// The end of its time.
    pub end: Instant,
    /// The answer is no longer wanted.
    pub given_up: Arc<AtomicBool>,
    /// The memory for states, bytes.
    pub memory: usize,
    /// The maximum number of states.
    pub states: Option<u64>,
    /// The maximum number of scans.
    pub depth: Option<u64>,
}

/// The answer of one way, or of both.
#[derive(Debug)]
pub enum Decision {
    /// It is never so. With the cuts of the gates that were looked at.
    Never(Way, Vec<GateCut>),
    /// It is so after this path; with the name of the way.
    Found(&'static str, Path),
    /// Neither.
    Open(OpenQuestion),
}

/// Why a question is open.
#[derive(Clone, Debug, Default)]
pub struct OpenQuestion {
    /// What was looked at.
    pub covered: Vec<String>,
    /// What stood in the way of each way.
    pub causes: Vec<String>,
    /// The cuts that stood in the way.
    pub cuts: Vec<GateCut>,
}

impl OpenQuestion {
    /// What stood in the way, in one text; `names`: those of its cuts.
    pub(crate) fn cause(&self, names: &[String]) -> String {
        let mut causes = self.causes.clone();
        if !names.is_empty() {
            causes.push(format!("deducing: any value of {}", names.join(", ")));
        }
        causes.join("; ")
    }
}

impl Race {
    /// Decides a question about its cone: a small one by exploring alone, so that its answer is
    /// always the same; any other by both ways at once.
    pub fn decide(&self, cone: &Cone, target: Target) -> Decision {
        // Each event multiplies the scans of a state.
        let most = FEW_STATES / (1 + cone.model.events.kinds.len() as u64);
        let few = self.states.map_or(most, |states| states.min(most));
        let alone = Race { states: Some(few), ..self.clone() };
        let stop = || self.given_up.load(Ordering::Relaxed);
        match by_exploring(cone, target, &alone.explore_limits(1, &stop)) {
            Decision::Open(_) => self.decide_by_both(cone, target),
            decided @ (Decision::Never(..) | Decision::Found(..)) => decided,
        }
    }

    /// Whether from every state that can be reached some inputs lead to the target.
    pub fn explore_can(&self, cone: &Cone, target: Target) -> Attained {
        let stop = || self.given_up.load(Ordering::Relaxed);
        explore_can(cone, target, &self.explore_limits(1, &stop))
    }

    /// Decides one way after the other, each with a measured effort: an answer that comes within
    /// its time is the same on every machine.
    pub fn decide_by_effort(&self, cone: &Cone, target: Target, effort: Effort) -> Decision {
        let stop = || self.given_up.load(Ordering::Relaxed);
        let explored = |scans| {
            let limits = ExploreLimits { scans: Some(scans), ..self.explore_limits(1, &stop) };
            by_exploring(cone, target, &limits)
        };
        let first = explored(effort.few_scans);
        if !matches!(first, Decision::Open(_)) {
            return first;
        }
        let flags = [Arc::clone(&self.given_up), Arc::clone(&self.given_up)];
        let decisions = Some(Arc::new(AtomicU64::new(effort.decisions)));
        let patience = Patience { deadline: self.end, flags, effort: decisions };
        match deduced_cone(cone, target, &patience) {
            Decision::Open(deduced) if effort.many_scans > 0 => {
                first_of(explored(effort.many_scans), Decision::Open(deduced))
            }
            ended @ (Decision::Open(_) | Decision::Never(..) | Decision::Found(..)) => ended,
        }
    }

    fn explore_limits<'s>(
        &self,
        threads: usize,
        stop: &'s (dyn Fn() -> bool + Sync),
    ) -> ExploreLimits<'s> {
        let Race { memory, states, depth, end, .. } = *self;
        let (combinations, deadline, scans) = (COMBINATIONS_MAX, Some(end), None);
        ExploreLimits { memory, combinations, threads, deadline, stop, states, depth, scans }
    }

    fn decide_by_both(&self, cone: &Cone, target: Target) -> Decision {
        let is_over = Arc::new(AtomicBool::new(false));
        let flags = [Arc::clone(&is_over), Arc::clone(&self.given_up)];
        let patience = Patience { deadline: self.end, flags, effort: None };
        let done = |decision: &Decision| {
            if !matches!(decision, Decision::Open(_)) {
                is_over.store(true, Ordering::Relaxed);
            }
        };
        let (deduced, explored) = std::thread::scope(|scope| {
            let deducing = scope.spawn(|| {
                let decision = deduced_cone(cone, target, &patience);
                done(&decision);
                decision
            });
            let threads = std::thread::available_parallelism().map_or(1, usize::from);
            let stop = || patience.is_over();
            let limits = self.explore_limits(threads, &stop);
            let explored = by_exploring(cone, target, &limits);
            done(&explored);
            (deducing.join(), explored)
        });
        let deduced = deduced.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        first_of(explored, deduced)
    }
}

/// The answer of two ways.
fn first_of(a: Decision, b: Decision) -> Decision {
    match (a, b) {
        (Decision::Open(mut a), Decision::Open(b)) => {
            a.covered.extend(b.covered);
            a.causes.extend(b.causes);
            a.cuts.extend(b.cuts);
            Decision::Open(a)
        }
        (Decision::Open(_), decided) | (decided, _) => decided,
    }
}

fn by_exploring(cone: &Cone, target: Target, limits: &ExploreLimits) -> Decision {
    match explore_cone(cone, target, limits) {
        Explored::All { states, .. } => Decision::Never(Way::Exploring { states }, Vec::new()),
        Explored::Found(path) => Decision::Found(EXPLORING, path),
        Explored::Stopped { states, depth, cause } => {
            let (states, scans) = (counted(states, "state"), counted(depth, "scan"));
            let covered = vec![format!("explored: {states}, the first {scans}")];
            Decision::Open(OpenQuestion {
                covered,
                causes: vec![format!("exploring: {}", cause.text())],
                cuts: Vec::new(),
            })
        }
    }
}

/// Decides with a solver, about the gates of a scan.
pub fn by_deducing(model: &ProofModel, target: Target, patience: &Patience) -> Decision {
    deduced(model, || Cow::Owned(encode(model)), target, patience)
}

/// As [`by_deducing`], about a cone.
fn deduced_cone(cone: &Cone, target: Target, patience: &Patience) -> Decision {
    deduced(&cone.model, || Cow::Borrowed(cone.gates()), target, patience)
}

fn deduced<'g>(
    model: &ProofModel,
    gates: impl FnOnce() -> Cow<'g, Gates>,
    target: Target,
    patience: &Patience,
) -> Decision {
    if let Some(obstacle) = obstacle(model) {
        return Decision::Open(OpenQuestion {
            causes: vec![format!("deducing: {obstacle}")],
            ..OpenQuestion::default()
        });
    }
    let at = model.judged.iter().position(|bit| *bit == target.bit).unwrap_or_default();
    let gates = merged(&gates().reduced(&[at])).reduced(&[at]);
    let system = ScanSystem::of(&gates, gates.judged[at].inverted_if(!target.value));
    let way = match deduce(&system, patience) {
        Deduced::Never(Reason::Induction(k)) => Way::Induction { k },
        Deduced::Never(Reason::Invariant(cubes)) => Way::Reachability { clauses: cubes.len() },
        Deduced::Open(scans) => {
            return Decision::Open(OpenQuestion {
                covered: vec![nothing_in(scans)],
                causes: vec!["deducing: the time is over".to_owned()],
                cuts: Vec::new(),
            });
        }
        Deduced::Found(inputs) => {
            let path = path_of(&gates, &system, &inputs);
            if Run::leads_to(model, target, &path) {
                let path = with_cold_values(model, target, path);
                let path = with_fewer_events(model, target, path);
                let path = with_short_times(model, target, path, patience);
                return Decision::Found(DEDUCING, path);
            }
            return Decision::Open(OpenQuestion {
                covered: vec![nothing_in(inputs.len() - 1)],
                causes: Vec::new(),
                cuts: gates.open_cuts(),
            });
        }
    };
    Decision::Never(way, gates.open_cuts())
}

fn nothing_in(scans: usize) -> String {
    format!("deduced: nothing in the first {}", counted(scans as u64, "scan"))
}

/// The path of the values of a system's inputs.
fn path_of(gates: &Gates, system: &ScanSystem, inputs: &[Vec<bool>]) -> Path {
    let scan = |values: &Vec<bool>| {
        let mut on = vec![false; system.bits];
        for (input, value) in system.inputs.iter().zip(values) {
            on[*input as usize] = *value;
        }
        gates.input_values(|literal| on[literal.node() as usize] != literal.is_inverted())
    };
    Path { scans: inputs.iter().map(scan).collect() }
}

/// The same path with those values before the first scan alone that it needs: the others are those
/// of a cold start.
fn with_cold_values(model: &ProofModel, target: Target, mut path: Path) -> Path {
    for (at, input) in model.inputs.iter().enumerate() {
        let Some(cold) = input.cold else { continue };
        let needed = std::mem::replace(&mut path.scans[0][at], cold);
        if needed != cold && !Run::leads_to(model, target, &path) {
            path.scans[0][at] = needed;
        }
    }
    path
}

/// The same path with those events alone that it needs.
fn with_fewer_events(model: &ProofModel, target: Target, mut path: Path) -> Path {
    let Some(place) = model.event_place() else { return path };
    for at in 0..path.scans.len() {
        let needed = std::mem::replace(&mut path.scans[at][place], 0);
        if needed != 0 && !Run::leads_to(model, target, &path) {
            path.scans[at][place] = needed;
        }
    }
    path
}

/// The same path with short times without a process: a second less, and it does something else. It
/// looks for them while time is left.
fn with_short_times(
    model: &ProofModel,
    target: Target,
    mut path: Path,
    patience: &Patience,
) -> Path {
    let Some(place) = model.down_place() else { return path };
    let begins = |scan: &[i32]| model.event(scan).is_some_and(ScanEvent::begins_process);
    // Where no process begins, nothing reads the time.
    path.scans.iter_mut().filter(|scan| !begins(scan)).for_each(|scan| scan[place] = 0);
    for at in 0..path.scans.len() {
        // It does so with `most`, and not with anything that was tried below `least`.
        let (mut least, mut most) = (0, path.scans[at][place]);
        while least < most && !patience.is_over() {
            let tried = least + (most - least) / 2;
            path.scans[at][place] = tried;
            match Run::leads_to(model, target, &path) {
                true => most = tried,
                false => least = tried + 1,
            }
        }
        path.scans[at][place] = most;
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::question::Questions;
    use rungd_lab::testing::read_suite;
    use rungd_test_support::folder::TestFolder;
    use rungd_test_support::patience::PATIENCE;
    use std::fs;

    const LADDER: &str = r#"
[tags]
running = { at = "C0" }
waste   = { at = "C1" }
[[program]]
name = "Main"
rung = [
  { when = ["X0"], do = ["SET running"] },
  { when = ["$FirstScan", "running", "$DownSeconds > 600"], do = ["SET waste"] },
]
"#;

    const TEST: &str = r#"
ladder = ["ladder.toml"]
always = ["!waste"]
[retain]
tags = ["running"]
[prove]
events = ["restart"]
"#;

    /// A quiet scan, the press before a restart, and a scan of the new process, with long times
    /// without one; then the times that are left of them.
    fn shortened(patience: &Patience) -> Vec<i32> {
        let folder = TestFolder::new("prove-short-times");
        let file = folder.path().join("a.test.toml");
        fs::write(folder.path().join("ladder.toml"), LADDER).expect("a ladder");
        fs::write(&file, TEST).expect("a test file");
        let suite = read_suite(&file).expect("a file").suite.expect("a suite");
        let questions = Questions::new(suite);
        let (model, target) = (&questions.model, questions.lines[0].target);
        let down = model.down_place().expect("a time without a process");
        let event = model.event_place().expect("an event");
        let scan = |pressed: i32, seconds: i32| {
            let choices = model.choices().into_iter();
            let mut row: Vec<i32> =
                choices.map(|choice| if choice.high == 1 { pressed } else { 0 }).collect();
            (row[down], row[event]) = (seconds, pressed);
            row
        };
        let path = Path { scans: vec![scan(0, 5_000), scan(1, 9_000_000), scan(0, 70)] };
        assert!(Run::leads_to(model, target, &path));
        let path = with_short_times(model, target, path, patience);
        assert!(Run::leads_to(model, target, &path));
        path.scans.iter().map(|scan| scan[down]).collect()
    }

    #[test]
    fn the_shortest_time_without_a_process_is_looked_for_while_time_is_left() {
        let given_up = Arc::new(AtomicBool::new(false));
        let patience = Patience::new(PATIENCE, &given_up);
        assert_eq!(shortened(&patience), [0, 601, 0]);
        given_up.store(true, Ordering::Relaxed);
        assert_eq!(shortened(&patience), [0, 9_000_000, 0]);
    }
}
