//! A chart, while it is translated: what its parts share.
//!
//! Made by `sfc`; `sfc_transitions` and `sfc_actions` add their rungs and rows to it.

use std::collections::{HashMap, HashSet};

use super::body::{BodyPlace, TranslatedBody, UnitBlocks};
use super::elements::ConditionSource;
use super::memory::PlcopenMemory;
use super::rung_names::RungNames;
use super::sfc_elements::SfcChart;
use super::sfc_links::ChartLinks;
use super::types::StepTag;
use crate::condition::RungCondition;
use crate::model::{
    Action, ActionForm, Fate, PartCount, ProjectRung, ProjectTag, RungBody, RungOutcome, RungStep,
    Term,
};
use crate::rungs::{ForeignRung, rungs};
use rungd_language::source::renaming::kebab;

/// A chart, while it is translated.
pub(super) struct ChartWork<'c> {
    pub(super) memory: &'c mut PlcopenMemory,
    pub(super) units: &'c UnitBlocks,
    pub(super) chart: &'c SfcChart,
    pub(super) place: BodyPlace<'c>,
    pub(super) links: ChartLinks,
    pub(super) steps: Vec<Result<StepTag, String>>,
    /// The rows of the report, and the subroutines.
    pub(super) done: TranslatedBody,
    pub(super) rungs: ChartRungs,
    /// The bits that keep whether a step was active before.
    pub(super) was: HashMap<usize, String>,
    /// What the current step writes.
    pub(super) batch: StepBatch,
    /// The word with the time since the last scan.
    pub(super) elapsed: Option<String>,
    pub(super) names: RungNames,
    /// How many rows of the report the program itself has.
    pub(super) rows: usize,
    /// The conditions of transitions with bodies of their own.
    pub(super) known: HashMap<String, Result<ConditionSource, String>>,
    /// The names of transitions that something names, in small letters.
    pub(super) named: HashSet<String>,
    /// The names of transitions that something with a stub names, in small letters, and its reason.
    pub(super) refused: HashMap<String, String>,
    /// What the conditions need of the next scan.
    pub(super) needed: Vec<ProjectRung>,
}

/// The rungs of a chart by the parts of a scan.
#[derive(Debug, Default)]
pub(super) struct ChartRungs {
    pub(super) times: Vec<ProjectRung>,
    /// What the conditions of transitions need before one fires.
    pub(super) heads: Vec<ProjectRung>,
    pub(super) judged: Vec<ProjectRung>,
    pub(super) entered: Vec<ProjectRung>,
    pub(super) acting: Vec<ProjectRung>,
    pub(super) called: Vec<ProjectRung>,
}

/// A part of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ScanPart {
    Times,
    Heads,
    Judged,
    Entered,
    Acting,
    Called,
}

/// The variables that a step writes, each once.
#[derive(Default)]
pub(super) struct StepBatch {
    pub(super) on: Vec<RungStep>,
    pub(super) off: Vec<RungStep>,
    pub(super) bits: HashSet<String>,
}

impl ChartWork<'_> {
    /// Adds the rungs of some steps to a part of the scan.
    pub(super) fn rung(&mut self, part: ScanPart, name: &str, steps: Vec<RungStep>) {
        let name = rung_name(name);
        let mut tags = Vec::new();
        let prefix = format!("{}_{}", self.place.prefix, name.replace('-', "_"));
        let foreign = ForeignRung {
            name,
            doc: String::new(),
            prefix,
            names: &mut self.memory.names,
            tags: &mut tags,
        };
        let made = rungs(steps, foreign);
        self.memory.scopes[self.place.scope].tags.extend(tags);
        made.into_iter().for_each(|rung| self.push(part, rung));
    }

    /// Adds a rung to a part of the scan, with a name that no other one has.
    pub(super) fn push(&mut self, part: ScanPart, mut rung: ProjectRung) {
        self.names.keep_apart(&mut rung);
        match part {
            ScanPart::Times => &mut self.rungs.times,
            ScanPart::Heads => &mut self.rungs.heads,
            ScanPart::Judged => &mut self.rungs.judged,
            ScanPart::Entered => &mut self.rungs.entered,
            ScanPart::Acting => &mut self.rungs.acting,
            ScanPart::Called => &mut self.rungs.called,
        }
        .push(rung);
    }

    /// A stub in a part of the scan.
    pub(super) fn stub(&mut self, part: ScanPart, was: &str, reason: &str) {
        let body = RungBody::Todo { reason: reason.to_owned(), was: was.to_owned() };
        let name = Some(rung_name(was));
        self.push(part, ProjectRung { name, doc: String::new(), body });
    }

    /// A row of the report.
    pub(super) fn row(&mut self, text: String, part: &str, fate: Fate) {
        let number = self.rows;
        self.rows += 1;
        self.done.outcomes.push(RungOutcome {
            place: self.place.title.to_owned(),
            number,
            text,
            parts: vec![PartCount { kind: part.to_owned(), count: 1 }],
            fate,
        });
    }

    /// A tag that the original does not have.
    pub(super) fn own_tag(&mut self, wish: &str, kind: &str, doc: String) -> String {
        let name = self.memory.names.fresh(&format!("{}_{wish}", self.place.prefix));
        self.memory.scopes[self.place.scope].tags.push(ProjectTag {
            name: name.clone(),
            kind: kind.to_owned(),
            doc,
            is_own: true,
            ..ProjectTag::default()
        });
        name
    }

    /// The word with the time since the last scan.
    pub(super) fn elapsed(&mut self) -> String {
        if let Some(name) = &self.elapsed {
            return name.clone();
        }
        let timer = self.own_tag("timer", "timer", "The time between two scans".to_owned());
        let word = self.own_tag("elapsed", "int", "The time since the last scan, in ms".to_owned());
        let steps = [
            format!("TMRAG {timer} preset=1h"),
            format!("MOVE {timer}.Acc to={word}"),
            format!("MOVE 0 to={timer}.Acc"),
        ];
        let steps = steps.map(|text| act(RungCondition::Constant(true), text));
        self.rung(ScanPart::Times, "elapsed", steps.to_vec());
        self.elapsed = Some(word.clone());
        word
    }

    /// Whether a step is active.
    pub(super) fn is_active(&self, step: usize) -> RungCondition {
        match &self.steps[step] {
            Ok(tag) => RungCondition::bit(format!("{}.X", tag.name)),
            Err(_) => RungCondition::Constant(false),
        }
    }
}

/// A step that does something under a condition.
pub(super) fn act(when: RungCondition, text: String) -> RungStep {
    let term = |condition| Term { condition, at: 0 };
    let when = match when {
        RungCondition::Constant(true) => Vec::new(),
        RungCondition::All(parts) => parts.into_iter().map(term).collect(),
        RungCondition::Constant(false)
        | RungCondition::Bit { .. }
        | RungCondition::Compare { .. }
        | RungCondition::Not(_)
        | RungCondition::Any(_) => vec![term(when)],
    };
    // Within a rung of a chart nothing changes what its contacts read.
    RungStep { when, action: Action { form: ActionForm::Do(text), writes: Vec::new() } }
}

/// The name of a rung near a text.
fn rung_name(text: &str) -> String {
    let name = kebab(&text.to_lowercase());
    let is_legal = name.len() <= 60 && name.starts_with(|c: char| c.is_ascii_lowercase());
    if is_legal { name } else { "chart".to_owned() }
}
