//! The parts of an L5X file as a project: which file has what, and what executes when.

use super::call_book::{CallBook, Callee, RoutineKey, callee};
use super::document::{InstructionDefinition, L5xFile, ProgramDefinition, RoutineDefinition};
use super::inputs;
use super::memory::LogixMemory;
use super::own_instruction::{own_instruction, shared};
use super::prescan::Prescan;
use super::rll;
use super::routine::{RoutineText, RoutineWork, translated};
use super::tasks::{ProgramTurn, TaskProgram, filled_tasks, plan};
use super::translate::BlockNature;
use super::types::PID_RECORD;
use super::undeclared::{ScopedProgram, demand};
use crate::model::{
    Fate, ForeignProject, LadderFile, Outcome, ProjectBlock, ProjectBlockKind, ProjectPart,
    ProjectRung, ProjectTag, RungBody, RungOutcome,
};

/// Warnings about habits of Logix programs.
const HABITS: [&str; 5] =
    ["out-elsewhere", "set-never-reset", "reset-never-set", "never-written", "unused-tag"];

/// Timers and counters of Logix, as templates.
static LOGIX: ProjectPart = ProjectPart { name: "logix", text: include_str!("logix.toml") };
/// PID, for the projects that have one.
static PID: ProjectPart = ProjectPart { name: "logix-pid", text: include_str!("logix-pid.toml") };

/// The project of a file.
pub(super) fn project(file: &L5xFile) -> ForeignProject {
    let mut memory = LogixMemory::of(file);
    let plan = plan(file);
    let mut outcome = Outcome {
        differences: plan.differences.clone(),
        open: plan.open.clone(),
        ..Outcome::default()
    };
    let mut calls =
        CallBook { shared: shared(file), tasks: filled_tasks(file), ..CallBook::default() };
    let mut controller = LadderFile {
        name: "controller-tags".to_owned(),
        doc: format!("Tags of the controller {}. {}", file.name, file.doc),
        allow: HABITS.to_vec(),
        ..LadderFile::default()
    };
    let mut assembly = Assembly {
        memory: &mut memory,
        calls: &mut calls,
        outcome: &mut outcome,
        controller: &mut controller,
    };
    instructions(file, &mut assembly);
    let mut prescan = Prescan::default();
    let mut ladders = Vec::new();
    let mut starts = Vec::new();
    let scopes = scopes(file, &plan.programs, &mut memory, &calls);
    for (planned, scope) in plan.programs.iter().zip(&scopes) {
        let program = &file.programs[planned.index];
        let mut work = ProgramWork {
            memory: &mut memory,
            calls: &mut calls,
            prescan: &mut prescan,
            outcome: &mut outcome,
            scope: *scope,
        };
        let (ladder, main) = work.program(program, planned);
        if let ProgramTurn::Every(interval) = planned.turn {
            starts.push(format!("ENTASK {main} every={interval}ms"));
        }
        ladders.push(ladder);
    }
    unused(&mut memory, &mut outcome);
    for (ladder, scope) in ladders.iter_mut().zip(&scopes) {
        ladder.tags = memory.homes[memory.scopes[*scope].home].clone();
    }
    controller.tags = memory.homes[0].clone();
    controller.records = memory.records.clone();
    let begins = Begins { memory: &memory, prescan: &prescan, scopes: &scopes };
    controller.blocks = begins.blocks(starts);
    outcome.renamed = memory.names.renamed.clone();
    outcome.unwritten = inputs::unwritten(&memory);
    outcome.outputs = inputs::outputs(&memory);
    let mut files = vec![controller];
    files.extend(ladders);
    let has_pid = memory.homes.iter().flatten().any(|tag| tag.kind == PID_RECORD);
    ForeignProject {
        name: if file.name.is_empty() { "import".to_owned() } else { file.name.clone() },
        doc: file.doc.clone(),
        origin: format!("Rockwell L5X, {} {}, revision {}", file.target, file.name, file.revision),
        period_ms: plan.period_ms,
        libraries: Vec::new(),
        parts: if has_pid { vec![LOGIX, PID] } else { vec![LOGIX] },
        files,
        outcome,
    }
}

/// The scopes of the programs, with the tags that the file does not declare.
fn scopes(
    file: &L5xFile,
    planned: &[TaskProgram],
    memory: &mut LogixMemory,
    calls: &CallBook,
) -> Vec<usize> {
    let mut programs = Vec::new();
    for planned in planned {
        let program = &file.programs[planned.index];
        let scope = memory.scope(&program.name, true, &program.tags);
        programs.push(ScopedProgram { program, scope });
    }
    demand(file, memory, calls, &programs);
    programs.iter().map(|program| program.scope).collect()
}

/// What the Add-On Instructions become parts of.
struct Assembly<'a> {
    memory: &'a mut LogixMemory,
    calls: &'a mut CallBook,
    outcome: &'a mut Outcome,
    controller: &'a mut LadderFile,
}

/// Translates the Add-On Instructions, each behind those that it uses.
fn instructions(file: &L5xFile, assembly: &mut Assembly<'_>) {
    let mut waiting: Vec<&InstructionDefinition> = file.instructions.iter().collect();
    let names: Vec<String> = waiting.iter().map(|one| one.name.to_lowercase()).collect();
    let uses = |one: &InstructionDefinition| -> Vec<String> {
        let rungs = one.routines.iter().flat_map(|routine| &routine.rungs);
        let series = rungs.filter_map(|rung| rll::parse(&rung.text).ok());
        let used = |series: rll::Series| {
            let all = rll::instructions(&series).into_iter();
            all.map(|one| one.name.to_lowercase()).collect::<Vec<_>>()
        };
        series.flat_map(used).filter(|name| names.contains(name)).collect()
    };
    while !waiting.is_empty() {
        let is_ready = |one: &&InstructionDefinition| {
            uses(one).iter().all(|name| assembly.calls.instructions.contains_key(name))
        };
        let Some(at) = waiting.iter().position(is_ready) else { break };
        let definition = waiting.remove(at);
        let done = own_instruction(assembly.memory, assembly.calls, definition);
        if let Err(why) = &done.own {
            assembly
                .outcome
                .left_out
                .push(format!("the Add-On Instruction {}: {why}", definition.name));
        }
        assembly.calls.instructions.insert(definition.name.to_lowercase(), done.own);
        assembly.controller.templates.extend(done.templates);
        assembly.outcome.rungs.extend(done.outcomes);
    }
    for definition in &waiting {
        let why = "it uses itself, through others too".to_owned();
        assembly.outcome.open.push(format!("the Add-On Instruction {}: {why}", definition.name));
        assembly.calls.instructions.insert(definition.name.to_lowercase(), Err(why));
    }
    for definition in waiting {
        let done = own_instruction(assembly.memory, assembly.calls, definition);
        assembly.outcome.rungs.extend(refused(done.outcomes, "an instruction that uses itself"));
    }
}

/// Rungs that are not part of the project, for a reason of their routine.
fn refused(outcomes: Vec<RungOutcome>, why: &str) -> Vec<RungOutcome> {
    let refuse = |outcome| RungOutcome { fate: Fate::Todo(why.to_owned()), ..outcome };
    outcomes.into_iter().map(refuse).collect()
}

/// The translation of a program.
struct ProgramWork<'w> {
    memory: &'w mut LogixMemory,
    calls: &'w mut CallBook,
    prescan: &'w mut Prescan,
    outcome: &'w mut Outcome,
    scope: usize,
}

impl ProgramWork<'_> {
    /// The ladder file of a program, and the name of its block.
    fn program(
        &mut self,
        program: &ProgramDefinition,
        planned: &TaskProgram,
    ) -> (LadderFile, String) {
        let block_name = match self.memory.names.is_taken(&program.name) {
            true => self.memory.names.take(&format!("{}_program", program.name)),
            false => self.memory.names.take(&program.name),
        };
        let main = program.main.clone().unwrap_or_default();
        let is_main = |routine: &RoutineDefinition| routine.name.eq_ignore_ascii_case(&main);
        let calls_main = self.book(program, &block_name, &main);
        let mut blocks = Vec::new();
        let mut own = Vec::new();
        for routine in &program.routines {
            let place = format!("{}/{}", program.name, routine.name);
            if !matches!(routine.language.as_str(), "RLL" | "") {
                let (language, size) = (&routine.language, routine.size);
                self.outcome.left_out.push(format!("{place}: {language}, {size} parts"));
                continue;
            }
            let is_block = is_main(routine) && !calls_main;
            let nature = if is_block { BlockNature::Main } else { BlockNature::Routine };
            let prefix = format!("{block_name}_{}", routine.name);
            let mut work = RoutineWork {
                memory: self.memory,
                calls: self.calls,
                prescan: self.prescan,
                scope: self.scope,
            };
            let done = translated(&mut work, RoutineText { place, prefix, routine, nature });
            let key = RoutineKey { scope: self.scope, name: routine.name.to_lowercase() };
            let name = match self.calls.routines.get(&key) {
                Some(Callee { name: Ok(name), .. }) => name,
                Some(Callee { name: Err(why), .. }) if !is_block => {
                    let why = format!("the routine {why}");
                    self.outcome.rungs.extend(refused(done.outcomes, &why));
                    continue;
                }
                Some(_) | None => {
                    self.outcome.rungs.extend(done.outcomes);
                    blocks.extend(done.blocks);
                    own = done.rungs;
                    continue;
                }
            };
            self.outcome.rungs.extend(done.outcomes);
            blocks.extend(done.blocks);
            if is_main(routine) {
                own = vec![rung("main", vec![format!("CALL {name}")])];
            }
            blocks.push(subroutine(routine, name, done.rungs));
        }
        if own.is_empty() && !blocks.is_empty() {
            self.outcome.differences.push(format!(
                "The file has no main routine of {}: nothing calls its routines.",
                program.name
            ));
        }
        blocks.insert(0, program_block(program, planned, &block_name, own));
        let ladder = LadderFile {
            name: kebab_name(&block_name),
            doc: program.doc.clone(),
            allow: HABITS.to_vec(),
            blocks,
            ..LadderFile::default()
        };
        (ladder, block_name)
    }

    /// Enters the routines of a program into the book of what can be called. Returns whether the
    /// main routine has to be a subroutine: it is called, or it ends early.
    fn book(&mut self, program: &ProgramDefinition, block: &str, main: &str) -> bool {
        let mut has_early_end = false;
        let mut called: Vec<String> = Vec::new();
        let mut all = Vec::new();
        for routine in &program.routines {
            let series: Vec<rll::Series> =
                routine.rungs.iter().filter_map(|rung| rll::parse(&rung.text).ok()).collect();
            let instructions: Vec<rll::RllInstruction> =
                series.iter().flat_map(|one| rll::instructions(one)).cloned().collect();
            let is_main = routine.name.eq_ignore_ascii_case(main);
            let ends = |one: &rll::RllInstruction| matches!(one.name.as_str(), "RET" | "TND");
            has_early_end |= is_main && instructions.iter().any(ends);
            let jsr = instructions.iter().filter(|one| one.name == "JSR");
            let own: Vec<String> = jsr
                .filter_map(|one| one.operands.first())
                .map(|name| name.to_lowercase())
                .collect();
            called.extend(own.clone());
            all.push(RoutineCalls { routine, instructions, own });
        }
        let main_is_called = has_early_end || called.contains(&main.to_lowercase());
        for calls in &all {
            let routine = calls.routine;
            let is_main = routine.name.eq_ignore_ascii_case(main);
            let name = if !matches!(routine.language.as_str(), "RLL" | "") {
                Err(format!("is in {}", routine.language))
            } else if is_main && !main_is_called {
                Err("is the main routine".to_owned())
            } else if calls_itself(&all, &routine.name.to_lowercase()) {
                Err("calls itself, through others too".to_owned())
            } else {
                let wish = match self.memory.names.is_taken(&routine.name) {
                    true => format!("{block}_{}", routine.name),
                    false => routine.name.clone(),
                };
                Ok(self.memory.names.take(&wish))
            };
            let key = RoutineKey { scope: self.scope, name: routine.name.to_lowercase() };
            let instructions: Vec<&rll::RllInstruction> = calls.instructions.iter().collect();
            self.calls.routines.insert(key, callee(name, &instructions));
        }
        main_is_called
    }
}

/// The block of a routine that is called.
fn subroutine(routine: &RoutineDefinition, name: &str, rungs: Vec<ProjectRung>) -> ProjectBlock {
    ProjectBlock {
        kind: ProjectBlockKind::Subroutine,
        name: name.to_owned(),
        doc: routine.doc.clone(),
        rungs,
        stages: Vec::new(),
    }
}

/// The block of a program.
fn program_block(
    program: &ProgramDefinition,
    planned: &TaskProgram,
    name: &str,
    rungs: Vec<ProjectRung>,
) -> ProjectBlock {
    let kind = match planned.turn {
        ProgramTurn::Scan => ProjectBlockKind::Program,
        ProgramTurn::Every(_) => ProjectBlockKind::Task,
        ProgramTurn::Never => ProjectBlockKind::StartedProgram,
    };
    let doc = program.doc.clone();
    ProjectBlock { kind, name: name.to_owned(), doc, rungs, stages: Vec::new() }
}

/// The calls of a routine.
struct RoutineCalls<'r> {
    routine: &'r RoutineDefinition,
    instructions: Vec<rll::RllInstruction>,
    /// The routines that it calls, in small letters.
    own: Vec<String>,
}

/// Whether a routine reaches itself by JSRs.
fn calls_itself(all: &[RoutineCalls<'_>], name: &str) -> bool {
    let mut seen: Vec<&str> = Vec::new();
    let mut waiting: Vec<&str> = vec![name];
    while let Some(next) = waiting.pop() {
        let of = all.iter().find(|one| one.routine.name.eq_ignore_ascii_case(next));
        for callee in of.map_or(&[][..], |one| &one.own) {
            if callee == name {
                return true;
            }
            if !seen.contains(&callee.as_str()) {
                seen.push(callee);
                waiting.push(callee);
            }
        }
    }
    false
}

/// What happens before the first scan, and what starts Tasks.
struct Begins<'b> {
    memory: &'b LogixMemory,
    prescan: &'b Prescan,
    scopes: &'b [usize],
}

impl Begins<'_> {
    fn blocks(&self, starts: Vec<String>) -> Vec<ProjectBlock> {
        let mut blocks = Vec::new();
        let mut first = Vec::new();
        for scope in self.scopes {
            let homes = [0, self.memory.scopes[*scope].home];
            let tags: Vec<&ProjectTag> =
                homes.iter().flat_map(|home| &self.memory.homes[*home]).collect();
            let name = kebab_name(&self.memory.scopes[*scope].name);
            let texts = self.prescan.texts(*scope, &tags);
            if !texts.is_empty() {
                first.push(rung(&format!("prescan-{name}"), texts));
            }
            first.extend(self.prescan.uses(*scope));
        }
        let has_starts = !starts.is_empty();
        blocks.push(ProjectBlock {
            kind: ProjectBlockKind::Program,
            name: "Main".to_owned(),
            doc: "The programs of the original start by themselves".to_owned(),
            rungs: if has_starts { vec![rung("tasks", starts)] } else { Vec::new() },
            stages: Vec::new(),
        });
        if !first.is_empty() {
            blocks.push(ProjectBlock {
                kind: ProjectBlockKind::Task,
                name: "FirstScan".to_owned(),
                doc: "What Logix does before its first scan (prescan)".to_owned(),
                rungs: first,
                stages: Vec::new(),
            });
        }
        blocks
    }
}

fn rung(name: &str, body: Vec<String>) -> ProjectRung {
    let body = RungBody::Ladder { when: vec!["$On".to_owned()], body, branches: Vec::new() };
    ProjectRung { name: Some(name.to_owned()), doc: String::new(), body }
}

fn kebab_name(name: &str) -> String {
    let kebab = rungd_language::source::renaming::kebab(name);
    if kebab.is_empty() { "program".to_owned() } else { kebab }
}

/// Declares the tags that no rung names, as far as rungd has a place for them.
fn unused(memory: &mut LogixMemory, outcome: &mut Outcome) {
    let templates: Vec<usize> =
        memory.scopes.iter().filter(|scope| !scope.is_open).map(|scope| scope.home).collect();
    for id in 0..memory.variables.len() {
        let variable = memory.variables[id].clone();
        let is_plain = variable.kind.plain().is_some();
        let elements: u32 = variable.dimensions.iter().fold(1, |all, one| all.saturating_mul(*one));
        if !variable.parts.is_empty()
            || variable.alias.is_some()
            || variable.module.is_some()
            || templates.contains(&variable.home)
        {
            continue;
        }
        if !is_plain || elements > 64 {
            outcome.left_out.push(format!("the tag {}, which no rung names", variable.original));
            continue;
        }
        let part =
            super::memory::PartType { kind: &variable.kind, dimensions: &variable.dimensions };
        if memory.part(id, "", part).is_ok()
            && let Some(tag) = memory.homes[variable.home].last_mut()
        {
            tag.more.push("spare = true".to_owned());
        }
    }
}
