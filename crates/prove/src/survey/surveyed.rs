//! The survey of a ladder that was made: its text, and scenarios that show its facts.
//!
//! `survey` makes it; `lock` compares it with one that was written.

use std::sync::Arc;
use std::time::Instant;

use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{Address, Bit};
use rungd_lab::rig::RigProgram;
use rungd_lab::testing::{Condition, FoundRun, Suite, TestStep, try_run};
use rungd_language::resolve::program::Contact;
use rungd_language::source::span::Span;

use super::contacts::not;
use super::facts::{Fact, FactKind, Possibility};
use crate::cone::cone;
use crate::decide::DecideLimits;
use crate::model::{Path, ProofModel, Run, Target};
use crate::named_input::NamedInput;
use crate::race::{Decision, Effort, Race};
use crate::trial::steps;

/// The survey of a ladder.
pub struct Survey {
    /// The facts, in the order of the ladder.
    pub facts: Vec<Fact>,
    /// The scan period.
    pub period: ScanPeriod,
    pub(super) suite: Suite,
    pub(super) programs: Vec<Arc<RigProgram>>,
    pub(super) model: ProofModel,
    pub(super) inputs: Vec<NamedInput>,
    pub(super) limits: DecideLimits,
}

impl Survey {
    /// The survey as text: a line a fact.
    pub fn text(&self) -> String {
        let lines = self.facts.iter().filter_map(Fact::line);
        lines.map(|line| line + "\n").collect()
    }

    /// What shows that a condition of a fact can be: the shortest scenario that is found, played as
    /// a test plays it; `None`: it cannot be, or a test cannot play it.
    pub fn scenario(&self, fact: &Fact, at: usize) -> Option<String> {
        let Possibility::Can(known) = fact.answers.get(at)? else { return None };
        let shorter = fact.first.and_then(|first| self.shorter(first + at, known));
        let path = shorter.as_ref().unwrap_or(known);
        let inputs: Vec<Option<&NamedInput>> = self.inputs.iter().map(Some).collect();
        let mut steps = steps(&self.model, &inputs, path);
        if let Some(bit) = fact.bit.filter(|_| fact.kind != FactKind::Flap) {
            steps.push(TestStep::Expect(self.expected(bit, at == 0)));
        }
        let name = format!("shows: {}: {}", fact.subject, fact.verdict().unwrap_or("can be"));
        let run = FoundRun { name, set: Vec::new(), steps };
        let tried = try_run(&self.suite, &self.programs, run);
        tried.is_confirmed.then_some(tried.text)
    }

    /// `pump`, or `!pump`.
    fn expected(&self, bit: Bit, is_on: bool) -> Condition {
        let symbols = &self.programs[0].symbols;
        let (name, contact) =
            (symbols.names.name(Address::Bit(bit)), Contact::Bit(bit, Span::default()));
        match is_on {
            true => Condition::of(contact, &name, &symbols.layout),
            false => Condition::of(not(contact), &format!("!{name}"), &symbols.layout),
        }
    }

    /// A path that is shorter than one that a walk has found.
    fn shorter(&self, judged: usize, known: &Path) -> Option<Path> {
        let target = Target { bit: self.model.judged[judged], value: true };
        let cone = cone(&self.model, &[target.bit]);
        let depth = Some(known.scans.len() as u64);
        let race = Race { depth, ..self.limits.race(Instant::now()) };
        match race.decide_by_effort(&cone, target, Effort::SURVEY) {
            Decision::Found(_, path) => {
                let path = cone.widened(&path);
                let is_shorter = path.scans.len() < known.scans.len();
                (is_shorter && Run::leads_to(&self.model, target, &path)).then_some(path)
            }
            Decision::Never(..) | Decision::Open(_) => None,
        }
    }
}
