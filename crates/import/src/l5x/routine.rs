//! The rungs of a routine: jumps, master control zones, and the rungs one by one.
//!
//! A jump forward leaves rungs out; rungd has no such jump. So what a jump may leave out is a
//! subroutine, which is called while the jump's bit is OFF. In a zone of MCR every rung has the
//! zone's condition as its first contact.

use std::collections::{BTreeSet, HashMap, HashSet};

use super::call_book::CallBook;
use super::document::{RoutineDefinition, RungDefinition};
use super::memory::LogixMemory;
use super::prescan::Prescan;
use super::rll::{self, RllNode, Series};
use super::texts::{SEARCH, is_text_search};
use super::translate::{BlockNature, Terms, Translation};
use crate::condition::{RungCondition, TouchedPlace};
use crate::model::{
    Fate, PartCount, ProjectBlock, ProjectBlockKind, ProjectRung, ProjectTag, RungBody,
    RungOutcome, Term,
};
use crate::rungs::{ForeignRung, rungs};
use rungd_language::source::renaming::kebab;

const NOT_YET: &str = "an edit was pending in the original, in which this rung does not run yet";
const STILL: &str = "an edit was pending in the original, in which this rung still runs";

/// What the translation of routines shares.
pub(crate) struct RoutineWork<'m> {
    pub(crate) memory: &'m mut LogixMemory,
    pub(crate) calls: &'m CallBook,
    pub(crate) prescan: &'m mut Prescan,
    pub(crate) scope: usize,
}

/// A routine.
pub(crate) struct RoutineText<'r> {
    /// Its name in the report: `MainProgram/Main`.
    pub(crate) place: String,
    /// The beginning of the names of its bits.
    pub(crate) prefix: String,
    pub(crate) routine: &'r RoutineDefinition,
    pub(crate) nature: BlockNature,
}

/// The translation of a routine.
#[derive(Default)]
pub(crate) struct TranslatedRoutine {
    pub(crate) rungs: Vec<ProjectRung>,
    /// Subroutines for what jumps leave out, and for calls of Add-On Instructions.
    pub(crate) blocks: Vec<ProjectBlock>,
    pub(crate) outcomes: Vec<RungOutcome>,
}

/// A parsed rung.
struct ParsedRung<'r> {
    definition: &'r RungDefinition,
    series: Result<Series, String>,
}

/// Translates the rungs of a routine.
pub(crate) fn translated(work: &mut RoutineWork<'_>, text: RoutineText<'_>) -> TranslatedRoutine {
    let parse = |definition| ParsedRung { definition, series: parsed(definition) };
    let parsed: Vec<ParsedRung<'_>> = text.routine.rungs.iter().map(parse).collect();
    let labels = labels(work, &text, &parsed);
    let mut writer = RoutineWriter {
        work,
        text,
        labels,
        searches: Vec::new(),
        zone: None,
        zones: 0,
        segments: Vec::new(),
        driven: HashSet::new(),
        done: TranslatedRoutine::default(),
    };
    writer.searches = writer.text_searches(&parsed);
    for (number, rung) in parsed.iter().enumerate() {
        writer.rung(number, rung);
    }
    writer.close(0);
    writer.done
}

fn parsed(definition: &RungDefinition) -> Result<Series, String> {
    match definition.state.as_str() {
        "" | "N" | "R" | "D" | "I" | "IR" => rll::parse(&definition.text),
        state => Err(format!("an edit that is pending (rung type {state})")),
    }
}

/// A label that jumps go to.
struct JumpLabel {
    name: String,
    bit: String,
    /// The number of its rung.
    at: usize,
    /// The numbers of the rungs that jump to it.
    jumps: Vec<usize>,
}

/// The labels that only jumps from before, which are the last instruction of their rung, go to.
fn labels(
    work: &mut RoutineWork<'_>,
    text: &RoutineText<'_>,
    rungs: &[ParsedRung<'_>],
) -> Vec<JumpLabel> {
    if text.nature == BlockNature::ProjectTemplate {
        return Vec::new();
    }
    let mut jumps: HashMap<String, Vec<usize>> = HashMap::new();
    let mut bad: BTreeSet<String> = BTreeSet::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    for (number, rung) in rungs.iter().enumerate() {
        let Ok(series) = &rung.series else { continue };
        for instruction in rll::instructions(series) {
            let Some(name) = instruction.operands.first().map(|name| name.to_lowercase()) else {
                continue;
            };
            if instruction.name == "LBL" {
                let is_first = is_instruction(series.first(), instruction);
                if !is_first {
                    bad.insert(name.clone());
                }
                places.insert(name, number);
            } else if instruction.name == "JMP" {
                let is_last = is_instruction(series.last(), instruction);
                if !is_last {
                    bad.insert(name.clone());
                }
                jumps.entry(name).or_default().push(number);
            }
        }
    }
    let zones = |number: usize| {
        let is_zone = |rung: &&ParsedRung<'_>| rung.series.as_ref().is_ok_and(|one| is_zone(one));
        rungs.iter().take(number).filter(is_zone).count()
    };
    let mut labels = Vec::new();
    for (name, at) in places {
        let jumps = jumps.remove(&name).unwrap_or_default();
        if jumps.is_empty() || bad.contains(&name) || jumps.iter().any(|jump| *jump >= at) {
            continue;
        }
        // A zone of MCR would begin or end within what is left out.
        if zones(at) % 2 == 1 || jumps.iter().any(|jump| zones(*jump) % 2 == 1) {
            continue;
        }
        labels.push(JumpLabel { bit: String::new(), name, at, jumps });
    }
    labels.sort_by_key(|label| label.at);
    for label in &mut labels {
        label.bit = work.memory.names.fresh(&format!("{}_to_{}", text.prefix, label.name));
        let home = work.memory.scopes[work.scope].home;
        work.memory.homes[home].push(ProjectTag {
            name: label.bit.clone(),
            kind: "bit".to_owned(),
            doc: format!("A jump to {} is taken", label.name),
            is_own: true,
            ..ProjectTag::default()
        });
    }
    labels
}

struct RoutineWriter<'w, 'm> {
    work: &'w mut RoutineWork<'m>,
    text: RoutineText<'w>,
    labels: Vec<JumpLabel>,
    /// The numbers of the rungs that only look for a text.
    searches: Vec<usize>,
    /// The bit of the zone of MCR that the rungs are in.
    zone: Option<String>,
    zones: usize,
    /// The parts that jumps may leave out, the innermost last.
    segments: Vec<JumpedSegment>,
    driven: HashSet<String>,
    done: TranslatedRoutine,
}

/// A part of a routine that a jump may leave out.
struct JumpedSegment {
    /// The labels behind it.
    labels: Vec<usize>,
    rungs: Vec<ProjectRung>,
    driven: HashSet<String>,
}

impl RoutineWriter<'_, '_> {
    /// The rungs of an Add-On Instruction that only look for a text.
    fn text_searches(&self, rungs: &[ParsedRung<'_>]) -> Vec<usize> {
        if self.text.nature != BlockNature::ProjectTemplate {
            return Vec::new();
        }
        let all: Vec<&[RllNode]> =
            rungs.iter().filter_map(|rung| rung.series.as_deref().ok()).collect();
        let is_it = |rung: &ParsedRung<'_>| {
            let series = rung.series.as_deref();
            series.is_ok_and(|own| is_text_search(self.work.memory, self.work.scope, own, &all))
        };
        (0..rungs.len()).filter(|number| is_it(&rungs[*number])).collect()
    }

    fn rung(&mut self, number: usize, rung: &ParsedRung<'_>) {
        let active =
            |label: &JumpLabel| label.at > number && label.jumps.iter().any(|jump| *jump < number);
        let active: Vec<usize> = self
            .labels
            .iter()
            .enumerate()
            .filter(|(_, label)| active(label))
            .map(|(at, _)| at)
            .collect();
        let is_boundary =
            self.labels.iter().any(|label| label.jumps.contains(&(number.wrapping_sub(1))));
        if is_boundary || self.segments.last().is_some_and(|segment| segment.labels != active) {
            self.close(0);
        }
        for at in 0..self.labels.len() {
            if self.labels[at].at == number {
                let reset = format!("RST {}", self.labels[at].bit);
                self.add(plain(&format!("label-{number}"), "$On", vec![reset]));
            }
        }
        if !active.is_empty() && self.segments.is_empty() {
            let driven = HashSet::new();
            self.segments.push(JumpedSegment { labels: active, rungs: Vec::new(), driven });
        }
        let (made, outcome) = self.one(number, rung);
        made.into_iter().for_each(|rung| self.add(rung));
        self.done.outcomes.push(outcome);
    }

    fn add(&mut self, rung: ProjectRung) {
        match self.segments.last_mut() {
            Some(segment) => segment.rungs.push(rung),
            None => self.done.rungs.push(rung),
        }
    }

    /// Ends the segments: each becomes a subroutine, and its call.
    fn close(&mut self, left: usize) {
        while self.segments.len() > left {
            let Some(segment) = self.segments.pop() else { return };
            if segment.rungs.iter().all(|rung| rung.body == RungBody::Comment) {
                continue;
            }
            let name = self.work.memory.names.fresh(&format!("{}_part", self.text.prefix));
            let bits = segment.labels.iter().map(|at| RungCondition::bit(&self.labels[*at].bit));
            let when = RungCondition::all(bits.map(RungCondition::opposite)).contacts();
            self.done.blocks.push(ProjectBlock {
                kind: ProjectBlockKind::Subroutine,
                name: name.clone(),
                doc: format!("A part of {} that a jump leaves out", self.text.place),
                rungs: segment.rungs,
                stages: Vec::new(),
            });
            let body =
                RungBody::Ladder { when, body: vec![format!("CALL {name}")], branches: Vec::new() };
            let name = kebab(&name);
            self.add(ProjectRung { name: Some(name), doc: String::new(), body });
        }
    }

    /// The rung, as far as no edit of it is pending.
    fn edited(&mut self, number: usize, source: RungSource<'_>) -> Result<TranslatedRung, String> {
        let rung = &self.text.routine.rungs[number];
        match rung.state.as_str() {
            _ if self.searches.contains(&number) => {
                let differences = BTreeSet::from([SEARCH.to_owned()]);
                let rungs = self.comment(number, source.comment, true);
                Ok(TranslatedRung { rungs, differences })
            }
            "I" | "IR" => {
                let text = format!("{}\n{NOT_YET}: {}", source.comment, rung.text.trim());
                let differences = BTreeSet::from([NOT_YET.to_owned()]);
                Ok(TranslatedRung { rungs: vec![note(text.trim())], differences })
            }
            "R" | "D" => {
                let mut translated = self.ladder(number, source)?;
                translated.differences.insert(STILL.to_owned());
                Ok(translated)
            }
            _ => self.ladder(number, source),
        }
    }

    /// The rungs of a rung, and what became of it.
    fn one(&mut self, number: usize, rung: &ParsedRung<'_>) -> (Vec<ProjectRung>, RungOutcome) {
        let RungDefinition { text, comment, .. } = rung.definition;
        let result = match &rung.series {
            Ok(series) if is_zone(series) => self.zone(number, series, comment),
            Ok(series) => self.edited(number, RungSource { series, comment, coil: None }),
            Err(why) => Err(why.clone()),
        };
        let (rungs, fate) = match result {
            Ok(TranslatedRung { rungs, differences }) if differences.is_empty() => {
                (rungs, Fate::Exact)
            }
            Ok(TranslatedRung { rungs, differences }) => {
                (rungs, Fate::Different(differences.into_iter().collect()))
            }
            Err(reason) => {
                let body = RungBody::Todo { reason: reason.clone(), was: text.clone() };
                let name = Some(format!("r{number}"));
                (vec![ProjectRung { name, doc: comment.clone(), body }], Fate::Todo(reason))
            }
        };
        let outcome = RungOutcome {
            place: self.text.place.clone(),
            number,
            text: text.clone(),
            parts: rung.series.as_ref().map_or_else(|_| Vec::new(), |series| counted(series)),
            fate,
        };
        (rungs, outcome)
    }

    /// The comment in place of a rung that does nothing; with its text, if that is a difference.
    fn comment(&self, number: usize, comment: &str, is_different: bool) -> Vec<ProjectRung> {
        let text = self.text.routine.rungs.get(number).map_or("", |rung| rung.text.trim());
        let doc = match is_different {
            true => format!("{comment}\nWithout its rung: {text}"),
            false => comment.to_owned(),
        };
        (!doc.is_empty()).then(|| note(doc.trim())).into_iter().collect()
    }

    /// Drops the values within a rung that were made before it got a stub. `declared`: how many
    /// tags there were before it.
    fn drop_values(&mut self, declared: usize) {
        let home = self.work.memory.scopes[self.work.scope].home;
        let mut at = 0;
        self.work.memory.homes[home].retain(|tag| {
            at += 1;
            at <= declared || !tag.is_own
        });
    }

    fn ladder(&mut self, number: usize, source: RungSource<'_>) -> Result<TranslatedRung, String> {
        let RungSource { series, comment, coil } = source;
        let prefix = format!("{}_r{number}", self.text.prefix);
        let nature = match (self.segments.is_empty(), self.text.nature) {
            (true, nature) => nature,
            (false, _) => BlockNature::JumpedSegment,
        };
        let labels = self.labels.iter().filter(|label| label.at > number);
        let labels = labels.map(|label| (label.name.clone(), label.bit.clone())).collect();
        let driven = match self.segments.last_mut() {
            Some(segment) => std::mem::take(&mut segment.driven),
            None => std::mem::take(&mut self.driven),
        };
        let home = self.work.memory.scopes[self.work.scope].home;
        self.work.memory.guesses.clear();
        let declared = self.work.memory.homes[home].len();
        let mut translation = Translation {
            memory: self.work.memory,
            scope: self.work.scope,
            calls: self.work.calls,
            prescan: self.work.prescan,
            prefix: prefix.clone(),
            driven,
            steps: Vec::new(),
            differences: BTreeSet::new(),
            block: nature,
            own_blocks: Vec::new(),
            labels,
        };
        let zone = self.zone.as_ref().map(RungCondition::bit);
        let when: Terms = zone.map(|condition| Term { condition, at: 0 }).into_iter().collect();
        let result = translation.series(series, when, coil.is_some()).map(|when| {
            if let Some(bit) = coil {
                translation.push(when, format!("OUT {bit}"), vec![TouchedPlace::of(bit)]);
            }
        });
        let (steps, mut differences) = (translation.steps, translation.differences);
        let (driven, own_blocks) = (translation.driven, translation.own_blocks);
        differences.append(&mut self.work.memory.guesses);
        match self.segments.last_mut() {
            Some(segment) => segment.driven = driven,
            None => self.driven = driven,
        }
        if let Err(why) = result {
            self.drop_values(declared);
            return Err(why);
        }
        self.done.blocks.extend(own_blocks);
        if steps.is_empty() {
            let rungs = self.comment(number, comment, !differences.is_empty());
            return Ok(TranslatedRung { rungs, differences });
        }
        let mut tags = Vec::new();
        let place = ForeignRung {
            name: format!("r{number}"),
            doc: comment.to_owned(),
            prefix,
            names: &mut self.work.memory.names,
            tags: &mut tags,
        };
        let rungs = rungs(steps, place);
        self.work.memory.homes[home].extend(tags);
        Ok(TranslatedRung { rungs, differences })
    }

    /// A rung with MCR: the beginning of a zone, or its end.
    fn zone(
        &mut self,
        number: usize,
        series: &[RllNode],
        comment: &str,
    ) -> Result<TranslatedRung, String> {
        if self.zone.take().is_some() {
            let comments = (!comment.is_empty()).then(|| note(comment));
            let rungs = comments.into_iter().collect();
            return Ok(TranslatedRung { rungs, differences: BTreeSet::new() });
        }
        self.zones += 1;
        let bit = self.work.memory.names.fresh(&format!("{}_zone{}", self.text.prefix, self.zones));
        let home = self.work.memory.scopes[self.work.scope].home;
        self.work.memory.homes[home].push(ProjectTag {
            name: bit.clone(),
            kind: "bit".to_owned(),
            doc: format!("The zone of the MCR in rung {number}"),
            is_own: true,
            ..ProjectTag::default()
        });
        let series = &series[..series.len() - 1];
        let result = self.ladder(number, RungSource { series, comment, coil: Some(&bit) });
        self.zone = Some(bit);
        result
    }
}

/// A rung to translate.
struct RungSource<'r> {
    series: &'r [RllNode],
    comment: &'r str,
    /// The bit that its power drives, beside its instructions.
    coil: Option<&'r str>,
}

/// The rungs of a rung.
struct TranslatedRung {
    rungs: Vec<ProjectRung>,
    differences: BTreeSet<String>,
}

/// Whether a node is this instruction.
fn is_instruction(node: Option<&RllNode>, instruction: &rll::RllInstruction) -> bool {
    matches!(node, Some(RllNode::RllInstruction(found)) if found == instruction)
}

/// Whether a rung ends with MCR, behind contacts alone.
fn is_zone(series: &[RllNode]) -> bool {
    match series.last() {
        Some(RllNode::RllInstruction(last)) => last.name == "MCR",
        Some(RllNode::Branches(_)) | None => false,
    }
}

/// The parts of a rung by their names.
fn counted(series: &[RllNode]) -> Vec<PartCount> {
    let mut counts: Vec<PartCount> = Vec::new();
    for instruction in rll::instructions(series) {
        let kind = instruction.name.clone();
        match counts.iter_mut().find(|part| part.kind == kind) {
            Some(part) => part.count += 1,
            None => counts.push(PartCount { kind, count: 1 }),
        }
    }
    counts
}

/// The parts of the text of a rung.
pub(crate) fn parts_of(text: &str) -> Vec<PartCount> {
    rll::parse(text).map_or_else(|_| Vec::new(), |series| counted(&series))
}

/// A comment between rungs.
fn note(text: &str) -> ProjectRung {
    ProjectRung { name: None, doc: text.to_owned(), body: RungBody::Comment }
}

fn plain(name: &str, contact: &str, body: Vec<String>) -> ProjectRung {
    let body = RungBody::Ladder { when: vec![contact.to_owned()], body, branches: Vec::new() };
    ProjectRung { name: Some(name.to_owned()), doc: String::new(), body }
}
