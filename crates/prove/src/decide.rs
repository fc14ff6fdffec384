//! Decides the lines of a test file.
//!
//! Called by `rungd prove`. What is found is tried on the rig, as `rungd test` plays it: a run that
//! does not hold there is no answer.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use crate::aig::Literal;
use crate::answer::{Answer, AnswerVerdict, DependsOn, EXPLORING, Shown, SideWitness, Way};
use crate::cone::cone;
use crate::deduce::system::ScanSystem;
use crate::deduce::{Patience, has_first_scan};
use crate::encode::encode;
use crate::events::ScanEvent;
use crate::explore::Attained;
use crate::kept::{self, KeptAnswers};
use crate::model::{Path, Target};
use crate::named_input::{InputSetting, NamedInput};
use crate::question::{AlwaysLine, CanLine, Questions};
use crate::race::{Decision, Race};
use crate::rig_memory::DeadEnd;
use crate::stretched::{AddedScan, TestBrings, stretched};
use crate::trial::Trial;
use rungd_lab::testing::{Condition, TriedRun};
use rungd_language::source::wording::counted;

/// The limits of the answer about a line.
#[derive(Clone, Debug)]
pub struct DecideLimits {
    /// The time for a line.
    pub time: Duration,
    /// The memory for a line, bytes.
    pub memory: usize,
    /// All answers are no longer wanted.
    pub given_up: Arc<AtomicBool>,
}

impl DecideLimits {
    /// The race about a question that was begun at this time.
    pub(crate) fn race(&self, begun: Instant) -> Race {
        Race {
            end: begun + self.time,
            given_up: Arc::clone(&self.given_up),
            memory: self.memory,
            states: None,
            depth: None,
        }
    }
}

/// Decides a line of a test file.
pub fn decide(
    questions: &Questions,
    line: &AlwaysLine,
    limits: &DecideLimits,
    kept: &KeptAnswers,
) -> Answer {
    answered(questions, limits, &line.text, |race, answer| {
        Asked { questions, race, kept }.line(line, answer);
    })
}

/// Decides a line of `can`.
pub fn decide_can(questions: &Questions, line: &CanLine, limits: &DecideLimits) -> Answer {
    answered(questions, limits, &line.text, |race, answer| {
        answer.is_can = true;
        Asked { questions, race, kept: &KeptAnswers::default() }.can(line, answer);
    })
}

/// An answer with what is the same for all lines.
fn answered(
    questions: &Questions,
    limits: &DecideLimits,
    line: &str,
    decide: impl FnOnce(Race, &mut Answer),
) -> Answer {
    let begun = Instant::now();
    let proof = &questions.suite.proof;
    let mut answer = Answer {
        line: line.to_owned(),
        is_can: false,
        verdict: AnswerVerdict::NotDecided { covered: Vec::new(), cause: String::new() },
        depends_on: None,
        assumptions: proof.assume.iter().map(|assumed| assumed.text.clone()).collect(),
        cuts: Vec::new(),
        vacuous: None,
        is_kept: false,
        hash: String::new(),
        ms: 0,
        period: questions.model.period,
        late_max: questions.model.late_max,
        is_from_retained: proof.from_retained,
        events: questions.events_told(),
    };
    match questions.unknown.clone() {
        Some(cause) => answer.verdict = AnswerVerdict::NotDecided { covered: Vec::new(), cause },
        None => {
            let (states, depth) = (proof.states, proof.depth);
            decide(Race { states, depth, ..limits.race(begun) }, &mut answer);
        }
    }
    answer.ms = begun.elapsed().as_millis();
    answer
}

/// Whether some inputs satisfy what is assumed; `true` if that is not decided in its time.
pub fn can_begin(questions: &Questions, limits: &DecideLimits) -> bool {
    if questions.model.assumed.is_empty() {
        return true;
    }
    let gates = encode(&questions.model).reduced(&[]);
    let system = ScanSystem::of(&gates, Literal::FALSE);
    has_first_scan(&system, &Patience::new(limits.time, &limits.given_up))
}

/// The questions, with the limits of each.
struct Asked<'q> {
    questions: &'q Questions,
    race: Race,
    kept: &'q KeptAnswers,
}

impl Asked<'_> {
    fn line(&self, line: &AlwaysLine, answer: &mut Answer) {
        if let Some(cause) = line.outside.clone() {
            answer.verdict = AnswerVerdict::NotDecided { covered: Vec::new(), cause };
            return;
        }
        let cone = cone(&self.questions.model, &[line.target.bit]);
        answer.depends_on = Some(DependsOn { operations: cone.operations, inputs: cone.inputs });
        answer.cuts = self.questions.named_cuts(&cone);
        answer.hash = kept::hash(&cone, line.target, &self.settings());
        if let Some(kept) = self.kept.find(&line.text, &answer.hash) {
            (answer.is_kept, answer.cuts) = (true, kept.cuts.clone());
            answer.vacuous = kept.vacuous.clone();
            answer.verdict = AnswerVerdict::Proved { way: kept.way, witnesses: Vec::new() };
            return;
        }
        answer.verdict = match self.race.decide(&cone, line.target) {
            Decision::Never(way, cuts) => {
                answer.cuts.extend(self.questions.cut_names(&cuts));
                let witnesses: Vec<SideWitness> =
                    line.sides.iter().map(|(side, target)| self.side(side, *target)).collect();
                let never = witnesses.iter().find(|one| matches!(one.shown, Shown::Never));
                answer.vacuous = never.map(|one| format!("`{}` can never be ON", one.side));
                if cone.inputs.kept == 0 && answer.vacuous.is_none() {
                    answer.vacuous = Some("it depends on no input".to_owned());
                }
                AnswerVerdict::Proved { way, witnesses }
            }
            Decision::Found(way, path) => {
                let path = self.to_last_scan(cone.widened(&path));
                let TriedPath { scan, run } =
                    self.tried(&path, |trial| trial.violation(line.number));
                let TriedRun { text, is_confirmed, failure } = run;
                match is_confirmed {
                    true => AnswerVerdict::Violated { way, scan, scenario: text, failure },
                    false => self.unconfirmed(&path, &answer.cuts),
                }
            }
            Decision::Open(open) => {
                let cause = open.cause(&self.questions.cut_names(&open.cuts));
                AnswerVerdict::NotDecided { covered: open.covered, cause }
            }
        };
    }

    /// A line of `can`: exploring alone decides it.
    fn can(&self, line: &CanLine, answer: &mut Answer) {
        let cone = cone(&self.questions.model, &[line.target.bit]);
        answer.depends_on = Some(DependsOn { operations: cone.operations, inputs: cone.inputs });
        answer.cuts = self.questions.named_cuts(&cone);
        answer.verdict = match self.race.explore_can(&cone, line.target) {
            Attained::Everywhere(states) if !answer.cuts.is_empty() => AnswerVerdict::NotDecided {
                covered: vec![format!("explored: {}", counted(states, "state"))],
                cause: format!("the way there may need any value of {}", answer.cuts.join(", ")),
            },
            Attained::Everywhere(states) => {
                AnswerVerdict::Proved { way: Way::Exploring { states }, witnesses: Vec::new() }
            }
            Attained::NotFrom(path) => {
                let path = cone.widened(&path);
                let end = DeadEnd::new(&self.questions.model, &cone, &path);
                let TriedPath { scan, run } =
                    self.tried(&path, |trial| trial.dead_end(&line.text, &end));
                let TriedRun { text, is_confirmed, .. } = run;
                match is_confirmed {
                    true => AnswerVerdict::Violated {
                        way: EXPLORING,
                        scan,
                        scenario: text,
                        failure: None,
                    },
                    false => self.unconfirmed(&path, &answer.cuts),
                }
            }
            Attained::Stopped { states, cause } => AnswerVerdict::NotDecided {
                covered: vec![format!("explored: {}", counted(states, "state"))],
                cause: format!("exploring: {}", cause.text()),
            },
        };
    }

    /// What a proof assumes beside its cone.
    fn settings(&self) -> String {
        let proof = &self.questions.suite.proof;
        format!("{:?} {} {:?}", proof.events, proof.late_max, proof.from_retained)
    }

    /// The path without what happens behind its last scan, which breaks no line any more.
    fn to_last_scan(&self, mut path: Path) -> Path {
        let model = &self.questions.model;
        if let (Some(place), Some(last)) = (model.event_place(), path.scans.last_mut())
            && !model.event(last).is_some_and(ScanEvent::ends_run)
        {
            last[place] = 0;
        }
        path
    }

    /// The answer if a path does something else in a test: what it needs and a test does not bring.
    fn unconfirmed(&self, path: &Path, cuts: &[String]) -> AnswerVerdict {
        let cause = if !cuts.is_empty() {
            let cuts = cuts.join(", ");
            format!("it needs a value that the ladder does not compute there, of {cuts}")
        } else if self.finds_older_image(path) {
            let period = self.questions.model.period;
            format!(
                "a power cut would have to find an image that a test does not keep; `interval = \
                 \"{period}\"` in `[retain]` keeps one of every scan"
            )
        } else if self.loses_device(path) {
            "there `.Stale` comes when `loss-after` has passed, neither sooner nor later, and what \
             a lost device brings stands still"
                .to_owned()
        } else {
            "a test does not set all that it depends on".to_owned()
        };
        let scans = counted(path.scans.len() as u64, "scan");
        AnswerVerdict::NotDecided {
            covered: vec![format!("a run of {scans} was found")],
            cause: format!("the run does not break the line in a test: {cause}"),
        }
    }

    /// Whether a power cut of a path finds an image, where a test keeps not one of every scan.
    fn finds_older_image(&self, path: &Path) -> bool {
        let model = &self.questions.model;
        let is_cut = |choices: &Vec<i32>| {
            let event = model.event(choices);
            matches!(event, Some(ScanEvent::PowerCut | ScanEvent::PowerCutBeforeImage))
        };
        model.events.image_is_final.is_some() && path.scans.iter().any(is_cut)
    }

    /// Whether a path loses a device with settings.
    fn loses_device(&self, path: &Path) -> bool {
        let is_lost = |(named, value): (&NamedInput, &i32)| {
            matches!(named.setting, InputSetting::Device(_)) && *value == 0
        };
        let mut scans = path.scans.iter();
        !self.questions.suite.programs[0].controller.devices.is_empty()
            && scans.any(|choices| self.questions.inputs.iter().zip(choices).any(is_lost))
    }

    /// Tries a path on the rig; if it does not hold there, with what a test brings later.
    fn tried(&self, path: &Path, try_it: impl Fn(&Trial) -> TriedRun) -> TriedPath {
        let try_path = |path: &Path| {
            let run = try_it(&Trial { questions: self.questions, path });
            TriedPath { scan: path.scans.len() as u64, run }
        };
        let mut tried = try_path(path);
        for added in AddedScan::BOTH {
            if tried.run.is_confirmed {
                break;
            }
            let longer = stretched(&TestBrings::of(self.questions), path, added);
            if longer.scans.len() == path.scans.len() {
                break;
            }
            tried = try_path(&longer);
        }
        tried
    }

    /// Whether a side of a line can be.
    fn side(&self, side: &Condition, target: Target) -> SideWitness {
        let cone = cone(&self.questions.model, &[target.bit]);
        let shown = match self.race.decide(&cone, target) {
            Decision::Never(..) => Shown::Never,
            Decision::Open(_) => Shown::Open,
            Decision::Found(_, path) => {
                let TriedPath { scan, run } =
                    self.tried(&cone.widened(&path), |trial| trial.witness(side));
                match run.is_confirmed {
                    true => Shown::At(scan, run.text),
                    false => Shown::Open,
                }
            }
        };
        SideWitness { side: side.text.clone(), shown }
    }
}

/// A path that was tried.
struct TriedPath {
    /// The number of its scans.
    scan: u64,
    run: TriedRun,
}
