//! The parts of a PLCopen file as a project: which file has what, and what executes when.

use std::collections::{HashMap, HashSet};

use super::block_calls::standard_members;
use super::body::{BodyPlace, TranslatedBody, UnitBlocks};
use super::document::{PlcopenFile, ProgramUnit, UnitBody, VariableUse};
use super::elements::{ElementBody, LadderElement};
use super::memory::PlcopenMemory;
use super::networks::network_rows;
use super::passes::translated;
use super::sfc::translated_chart;
use super::sfc_elements::SfcChart;
use super::sfc_steps::{executed, written};
use super::tasks::{ProgramPace, TaskPlan, TimedProgram, plan};
use super::types::VariableKind;
use crate::model::{
    Fate, ForeignProject, LadderFile, Outcome, PartCount, ProjectBlock, ProjectBlockKind,
    ProjectRung, RungBody, RungOutcome, UnwrittenTag,
};
use crate::names::legal;
use rungd_language::source::renaming::kebab;

/// Warnings about habits of programs for IEC 61131-3.
const HABITS: [&str; 6] = [
    "out-elsewhere",
    "set-never-reset",
    "reset-never-set",
    "never-written",
    "unused-tag",
    "unused-template",
];

/// The project of a file.
pub(super) fn project(file: &PlcopenFile) -> ForeignProject {
    let plan = plan(file);
    let mut memory = PlcopenMemory::default();
    memory.blocks.extend(standard_members());
    memory.written = written_names(file);
    memory.time_unit_ms = if file.product.to_uppercase().contains("CODESYS") { 1 } else { 1000 };
    memory.scope("", &file.globals, &file.types);
    let mut outcome = Outcome {
        differences: plan.differences.clone(),
        open: plan.open.clone(),
        ..Outcome::default()
    };
    let mut globals = LadderFile {
        name: "global-tags".to_owned(),
        doc: "Global variables and function blocks".to_owned(),
        allow: HABITS.to_vec(),
        ..LadderFile::default()
    };
    let mut work = ProjectWork {
        file,
        memory: &mut memory,
        units: HashMap::new(),
        outcome: &mut outcome,
        starts: Vec::new(),
    };
    globals.templates = work.templates();
    let ladders = work.programs(&plan);
    work.left_out(&plan);
    let units = work.units.len();
    let starts = std::mem::take(&mut work.starts);
    globals.tags = memory.scopes[0].tags.clone();
    globals.records = memory.records.clone();
    outcome.renamed = memory.names.renamed.clone();
    outcome.unwritten = unwritten(&memory);
    let mut files = ladders;
    let is_empty = globals.tags.is_empty() && globals.records.is_empty() && units == 0;
    if !is_empty {
        files.insert(0, globals);
    }
    main(starts, &mut files);
    ForeignProject {
        name: if file.name.is_empty() { "import".to_owned() } else { file.name.clone() },
        doc: String::new(),
        origin: format!("PLCopen XML, {}", file.product),
        period_ms: plan.period_ms,
        libraries: vec!["lib:iec"],
        parts: Vec::new(),
        files,
        outcome,
    }
}

/// What the parts of a file become parts of.
pub(super) struct ProjectWork<'w> {
    pub(super) file: &'w PlcopenFile,
    pub(super) memory: &'w mut PlcopenMemory,
    pub(super) units: UnitBlocks,
    pub(super) outcome: &'w mut Outcome,
    /// What starts the programs that are slower than the scan.
    starts: Vec<String>,
}

impl ProjectWork<'_> {
    /// Counts how often each instance is called.
    pub(super) fn count_calls<'e>(
        &mut self,
        scope: usize,
        elements: impl IntoIterator<Item = &'e LadderElement>,
    ) {
        for element in elements {
            if let ElementBody::Block(block) = &element.body
                && let Some(name) = &block.instance
                && let Some(id) = self.memory.variable(scope, name)
            {
                *self.memory.calls.entry(id).or_default() += 1;
            }
        }
    }

    /// The ladders of the programs.
    fn programs(&mut self, plan: &TaskPlan) -> Vec<LadderFile> {
        let file = self.file;
        let mut scopes = Vec::new();
        for planned in &plan.programs {
            let unit = &file.units[planned.unit];
            let name = title(plan, planned, unit);
            let scope = self.memory.scope(name, &unit.variables, &file.types);
            match &unit.body {
                UnitBody::Ladder(elements) => self.count_calls(scope, elements),
                UnitBody::Chart(chart) => {
                    self.memory.steps(scope, chart);
                    self.count_calls(scope, executed(chart));
                }
                UnitBody::Other { .. } => {}
            }
            scopes.push(scope);
        }
        let mut ladders = Vec::new();
        let mut has_main = false;
        for (planned, scope) in plan.programs.iter().zip(scopes) {
            let unit = &file.units[planned.unit];
            let title = title(plan, planned, unit);
            let prefix = legal(title).to_lowercase();
            let place = BodyPlace { scope, prefix: &prefix, title, is_template: false };
            let done = match &unit.body {
                UnitBody::Ladder(elements) => translated(self.memory, &self.units, elements, place),
                UnitBody::Chart(chart) => translated_chart(self.memory, &self.units, chart, place),
                UnitBody::Other { .. } => continue,
            };
            self.outcome.rungs.extend(done.outcomes.iter().cloned());
            let is_main = planned.turn == ProgramPace::Scan && !has_main;
            has_main |= is_main;
            let name = match is_main {
                true => "Main".to_owned(),
                false => self.memory.names.fresh(title),
            };
            if let ProgramPace::Every(ms) = planned.turn {
                self.starts.push(format!("ENTASK {name} every={ms}ms"));
            }
            ladders.push(self.ladder(planned, scope, done, ProgramName { title, name, unit }));
        }
        let mut taken: Vec<String> = vec!["global-tags".to_owned()];
        for ladder in &mut ladders {
            let base = ladder.name.clone();
            let mut number = 2;
            while taken.contains(&ladder.name) {
                ladder.name = format!("{base}-{number}");
                number += 1;
            }
            taken.push(ladder.name.clone());
        }
        ladders
    }

    fn ladder(
        &mut self,
        planned: &TimedProgram,
        scope: usize,
        done: TranslatedBody,
        name: ProgramName<'_>,
    ) -> LadderFile {
        let kind = match planned.turn {
            ProgramPace::Scan => ProjectBlockKind::Program,
            ProgramPace::Every(_) => ProjectBlockKind::Task,
            ProgramPace::Never => ProjectBlockKind::StartedProgram,
        };
        let file_name = kebab(name.title);
        let block = ProjectBlock {
            kind,
            name: name.name,
            doc: String::new(),
            rungs: done.rungs,
            stages: Vec::new(),
        };
        LadderFile {
            name: if file_name.is_empty() { "program".to_owned() } else { file_name },
            doc: format!("The program {}. {}", name.title, name.unit.doc).trim().to_owned(),
            allow: HABITS.to_vec(),
            records: Vec::new(),
            tags: self.memory.scopes[scope].tags.clone(),
            templates: Vec::new(),
            blocks: [vec![block], done.blocks].concat(),
        }
    }

    /// Names what is in other languages.
    fn left_out(&mut self, plan: &TaskPlan) {
        let file = self.file;
        for (at, unit) in file.units.iter().enumerate() {
            let what = match unit.kind.as_str() {
                "functionBlock" => "function block",
                kind => kind,
            };
            match &unit.body {
                UnitBody::Other { language, size } => {
                    let size = if language == "ST" || language == "IL" {
                        format!("{size} lines")
                    } else {
                        format!("{size} elements")
                    };
                    let text = format!("the {what} {} is in {language}, {size}", unit.name);
                    let runs = |planned: &TimedProgram| {
                        planned.unit == at && planned.turn != ProgramPace::Never
                    };
                    if plan.programs.iter().any(runs) {
                        self.outcome.open.push(format!("{text}: not translated"));
                    }
                    self.outcome.left_out.push(text);
                }
                UnitBody::Ladder(_) => {}
                // Its actions and transitions are in the report.
                UnitBody::Chart(_) => continue,
            }
            for other in &unit.others {
                self.outcome.left_out.push(format!("the {other} of {}", unit.name));
            }
        }
        let retained = file.units.iter().flat_map(|unit| &unit.variables).chain(&file.globals);
        let retained: Vec<&str> = retained
            .filter(|variable| variable.is_retained)
            .map(|variable| variable.name.as_str())
            .collect();
        if !retained.is_empty() {
            self.outcome.differences.push(format!(
                "{} variables are RETAIN: name their tags in [retain] of the controller file ({})",
                retained.len(),
                retained.join(", ")
            ));
        }
    }

    /// The networks of a ladder that is not translated.
    pub(super) fn refused(&mut self, unit: &ProgramUnit, elements: &[LadderElement], why: &str) {
        let fate = Fate::Todo(why.to_owned());
        self.outcome.rungs.extend(network_rows(&unit.name, elements, &fate));
    }

    /// The parts of a chart that is not translated.
    pub(super) fn refused_chart(&mut self, unit: &ProgramUnit, chart: &SfcChart, why: &str) {
        chart.ladders().for_each(|elements| self.refused(unit, elements, why));
        let steps = chart
            .steps
            .iter()
            .map(|step| [if step.is_macro { "macroStep" } else { "step" }, step.name.as_str()]);
        let links = chart.links.iter().map(|link| [link.kind.name(), link.target.as_str()]);
        let transitions = chart.transitions.iter().map(|_| ["transition", ""]);
        let actions = chart.blocks.iter().flat_map(|block| &block.actions);
        let actions = actions.map(|action| ["action", action.qualifier.as_str()]);
        let rows = steps.chain(transitions).chain(actions).chain(links).enumerate();
        let rows = rows.map(|(number, [kind, name])| RungOutcome {
            place: format!("{}, chart", unit.name),
            number,
            text: format!("{kind} {name}").trim().to_owned(),
            parts: vec![PartCount { kind: kind.to_owned(), count: 1 }],
            fate: Fate::Todo(why.to_owned()),
        });
        self.outcome.rungs.extend(rows);
    }
}

/// The names of an instance of a program.
struct ProgramName<'n> {
    title: &'n str,
    /// Its block here.
    name: String,
    unit: &'n ProgramUnit,
}

/// What an instance of a program is called: as its program, if it is the only one.
fn title<'t>(plan: &'t TaskPlan, planned: &'t TimedProgram, unit: &'t ProgramUnit) -> &'t str {
    let count = plan.programs.iter().filter(|other| other.unit == planned.unit).count();
    if count == 1 { &unit.name } else { &planned.name }
}

pub(super) fn language(unit: &ProgramUnit) -> &str {
    match &unit.body {
        UnitBody::Other { language, .. } => language,
        UnitBody::Ladder(_) => "LD",
        UnitBody::Chart(_) => "SFC",
    }
}

/// A rung of instructions.
pub(super) fn plain_rung(name: &str, contact: &str, body: Vec<String>) -> ProjectRung {
    let body = RungBody::Ladder { when: vec![contact.to_owned()], body, branches: Vec::new() };
    ProjectRung { name: Some(name.to_owned()), doc: String::new(), body }
}

/// The program `Main`, which always runs: it starts what is slower than the scan.
fn main(starts: Vec<String>, files: &mut Vec<LadderFile>) {
    let mut blocks = files.iter().flat_map(|file| &file.blocks);
    if blocks.all(|block| block.name != "Main") {
        files.push(LadderFile::empty_main("No program of the original runs in every scan"));
    }
    let main =
        files.iter_mut().flat_map(|file| &mut file.blocks).find(|block| block.name == "Main");
    if let Some(main) = main.filter(|_| !starts.is_empty()) {
        main.rungs.insert(0, plain_rung("start-tasks", "$On", starts));
    }
}

/// The names that coils and variables at the end of a line write, in small letters.
fn written_names(file: &PlcopenFile) -> HashSet<String> {
    let mut names = HashSet::new();
    for unit in &file.units {
        let elements = match &unit.body {
            UnitBody::Ladder(elements) => elements,
            UnitBody::Chart(chart) => {
                names.extend(written(chart));
                continue;
            }
            UnitBody::Other { .. } => continue,
        };
        for element in elements {
            if let ElementBody::Coil { variable: name, .. }
            | ElementBody::OutVariable { expression: name, .. } = &element.body
            {
                names.insert(name.trim().to_lowercase());
            }
        }
    }
    names
}

/// The tags that the program reads, and nothing writes.
fn unwritten(memory: &PlcopenMemory) -> Vec<UnwrittenTag> {
    let mut found: Vec<UnwrittenTag> = Vec::new();
    for variable in &memory.variables {
        let is_value =
            !matches!(variable.kind, VariableKind::Instance(_) | VariableKind::Missing(_));
        let is_inner = matches!(variable.usage, VariableUse::Input | VariableUse::InOut);
        let is_open = variable.is_read && !variable.is_written && is_value && !is_inner;
        if is_open && found.iter().all(|tag| tag.name != variable.name) {
            found.push(UnwrittenTag {
                name: variable.name.clone(),
                was: variable.original.clone(),
                source: match &variable.address {
                    Some(address) => format!("the address {address}"),
                    None if variable.is_guessed => "not declared in the file".to_owned(),
                    None => "an operator, or a constant".to_owned(),
                },
            });
        }
    }
    found
}
