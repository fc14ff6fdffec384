//! A survey of a ladder: what its outputs, alarms, Stages and rungs can do, without a question.
//!
//! Called by `rungd prove --survey`. `drafts` lists what is asked, and puts probes into a copy of
//! the ladder (`probes`); `walks` shows what is easily seen, and the rest is decided one by one by
//! exploring and deducing, each in its own cone and with a measured effort. So the same ladder has
//! the same survey on every machine. What a fact says can be was executed.

pub(crate) mod contacts;
mod drafts;
mod facts;
mod flaps;
mod lock;
pub(crate) mod mishaps;
pub(crate) mod probes;
mod surveyed;
pub(crate) mod walks;

use std::collections::HashMap;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

pub use facts::{Fact, FactKind, Possibility};
pub use lock::SurveyChange;
pub use mishaps::RungMishap;
pub use surveyed::Survey;

use crate::cone::cone;
use crate::decide::DecideLimits;
use crate::model::{ProofModel, Run, Target};
use crate::question::{ModelWithNames, ModelledProgram};
use crate::race::{Decision, Effort};
use drafts::{Draft, ProbedLadder};
use flaps::FlapSearch;
use rungd_lab::testing::{self, ProofEvent, Suite};
use rungd_language::lower::judged::Judges;
use rungd_language::resolve::program::Contact;

/// How far a survey is.
#[derive(Clone, Copy, Debug)]
pub struct SurveyProgress {
    /// The number of conditions that are decided.
    pub done: usize,
    /// The number of all conditions.
    pub all: usize,
}

/// Surveys the first program of a test file: from a cold start, and every scan in time.
pub fn survey(
    mut suite: Suite,
    limits: &DecideLimits,
    progress: &(dyn Fn(SurveyProgress) + Sync),
) -> Survey {
    (suite.proof.late_max, suite.proof.from_retained) = (1, false);
    suite.proof.events.retain(|event| *event == ProofEvent::Writes);
    suite.proof.any.clear();
    let programs = testing::programs(&suite);
    let ladder = ProbedLadder::of(&suite);
    let first = &suite.programs[0];
    let asks: Vec<Contact> =
        ladder.drafts.iter().flat_map(|draft| draft.asks.iter().cloned()).collect();
    let judges = Judges { behind: &asks, cleared: &ladder.probes, ..Judges::default() };
    let asked = ModelledProgram { program: &ladder.program, judges };
    let ModelWithNames { model, inputs, .. } = asked.model(&suite, &programs[0]);
    let seen = first.view.as_ref().map(|view| view.observed());
    let program = seen.map_or(&*first.program, |observed| &observed.program);
    let flaps = FlapSearch { suite: &suite, lowered: &programs[0], program, model: &model };
    let settling = Settling { model: &model, flaps, limits, progress };
    let answers = settling.all(&ladder.drafts);
    let flapping = settling.flapping(&ladder.drafts, &answers);
    let facts = facts(&ladder.drafts, answers, flapping, &suite);
    let period = first.controller.period;
    let limits = limits.clone();
    Survey { facts, period, suite, programs, model, inputs, limits }
}

fn facts(
    drafts: &[Draft],
    answers: Vec<Vec<Possibility>>,
    flapping: Vec<Option<Possibility>>,
    suite: &Suite,
) -> Vec<Fact> {
    let is_never: Vec<bool> =
        answers.iter().map(|reach| matches!(reach.first(), Some(Possibility::Never))).collect();
    let mut all = Vec::new();
    let mut seen: HashMap<String, u32> = HashMap::new();
    for ((draft, answers), flaps) in drafts.iter().zip(answers).zip(flapping) {
        let place = match draft.span.end {
            0 => String::new(),
            _ => suite.programs[0].place(draft.span),
        };
        let is_hidden = draft.within.is_some_and(|at| is_never[at]);
        let Draft { kind, mut subject, bit, .. } = draft.clone();
        // A contact may stand twice in a rung.
        let count = seen.entry(subject.clone()).or_default();
        *count += 1;
        if *count > 1 {
            subject = format!("{subject} ({count})");
        }
        let first = Some(draft.first);
        all.push(Fact { kind, subject, place: place.clone(), answers, first, bit, is_hidden });
        if let Some(reach) = flaps {
            let subject = format!("{}, every scan", draft.subject);
            let (kind, answers) = (FactKind::Flap, vec![reach]);
            let (first, is_hidden) = (None, false);
            all.push(Fact { kind, subject, place, answers, first, bit, is_hidden });
        }
    }
    all
}

/// Decides the conditions of a model.
struct Settling<'a> {
    model: &'a ProofModel,
    flaps: FlapSearch<'a>,
    limits: &'a DecideLimits,
    progress: &'a (dyn Fn(SurveyProgress) + Sync),
}

impl Settling<'_> {
    /// The answers about all conditions, by draft.
    fn all(&self, drafts: &[Draft]) -> Vec<Vec<Possibility>> {
        let is_given_up = || self.limits.given_up.load(Ordering::Relaxed);
        let seen = walks::walks(self.model, walks::SURVEY_OPERATIONS, &is_given_up);
        let mut answers: Vec<Option<Possibility>> =
            seen.into_iter().map(|path| path.map(Possibility::Can)).collect();
        // What lies within a rung that is never ON is never so either: rungs first.
        let is_within = |at: &usize| drafts[*at].within.is_some();
        let numbers = 0..drafts.len();
        let (within, around): (Vec<usize>, Vec<usize>) = numbers.partition(is_within);
        for group in [around, within] {
            let mut open: Vec<usize> = Vec::new();
            for at in group {
                let first = drafts[at].first;
                let is_dead = drafts[at].within.is_some_and(|around| {
                    matches!(answers[drafts[around].first], Some(Possibility::Never))
                });
                let own = &mut answers[first..first + drafts[at].asks.len()];
                for (offset, answer) in own.iter_mut().enumerate() {
                    match (&answer, is_dead) {
                        (Some(_), _) => {}
                        (None, true) => *answer = Some(Possibility::Never),
                        (None, false) => open.push(first + offset),
                    }
                }
            }
            let found = self.each(&open, |at| self.one(at));
            for (at, reach) in open.into_iter().zip(found) {
                answers[at] = Some(reach);
            }
        }
        let mut answers = answers.into_iter().map(|answer| answer.unwrap_or(Possibility::Open));
        drafts.iter().map(|draft| answers.by_ref().take(draft.asks.len()).collect()).collect()
    }

    /// The answers about some numbers, on all processors, in their order.
    fn each(
        &self,
        numbers: &[usize],
        answer: impl Fn(usize) -> Possibility + Sync,
    ) -> Vec<Possibility> {
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let work = || {
            let mut found = Vec::new();
            loop {
                let at = next.fetch_add(1, Ordering::Relaxed);
                let Some(number) = numbers.get(at) else { return found };
                found.push((at, answer(*number)));
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                (self.progress)(SurveyProgress { done, all: numbers.len() });
            }
        };
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let mut found: Vec<(usize, Possibility)> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
            let joined = threads.into_iter().map(std::thread::ScopedJoinHandle::join);
            let all = joined.map(|found| found.unwrap_or_else(|panic| resume_unwind(panic)));
            all.flatten().collect()
        });
        found.sort_unstable_by_key(|(at, _)| *at);
        found.into_iter().map(|(_, reach)| reach).collect()
    }

    /// Whether outputs flap, by the numbers of their drafts.
    fn flapping(&self, drafts: &[Draft], answers: &[Vec<Possibility>]) -> Vec<Option<Possibility>> {
        let judged = |at: usize| self.model.judged[drafts[at].first];
        let asked: Vec<usize> = (0..drafts.len())
            .filter(|at| drafts[*at].bit.is_some() && answers[*at].len() == 2)
            .filter(|at| answers[*at].iter().all(|reach| matches!(reach, Possibility::Can(_))))
            .collect();
        let found = self.each(&asked, |at| match drafts[at].bit {
            Some(bit) => self.flaps.output(bit, judged(at), &self.limits.race(Instant::now())),
            None => Possibility::Never,
        });
        let mut all = vec![None; drafts.len()];
        for (at, reach) in asked.into_iter().zip(found) {
            all[at] = Some(reach);
        }
        all
    }

    /// Whether a judged bit can be ON.
    fn one(&self, at: usize) -> Possibility {
        if self.limits.given_up.load(Ordering::Relaxed) {
            return Possibility::Open;
        }
        let target = Target { bit: self.model.judged[at], value: true };
        let cone = cone(self.model, &[target.bit]);
        match self.limits.race(Instant::now()).decide_by_effort(&cone, target, Effort::SURVEY) {
            Decision::Never(..) => Possibility::Never,
            Decision::Open(_) => Possibility::Open,
            Decision::Found(_, path) => {
                let path = cone.widened(&path);
                match Run::leads_to(self.model, target, &path) {
                    true => Possibility::Can(path),
                    false => Possibility::Open,
                }
            }
        }
    }
}
