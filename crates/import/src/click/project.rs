//! The project of a CLICK ladder: one Program, its tags, and what became of each rung.

use std::collections::HashSet;

use super::grid::{ClickGrid, contact_text};
use super::nicknames::ClickNicknames;
use super::operand::ClickMemory;
use super::sheet::SheetRung;
use super::timers::SCAN_MS;
use super::work::{ClickCall, PoweredCall, RungWork};
use crate::model::{
    Fate, ForeignProject, LadderFile, Outcome, PartCount, ProjectBlock, ProjectBlockKind,
    ProjectRung, ProjectTag, RungBody, RungOutcome, RungStep,
};
use crate::rungs::{ForeignRung, rungs};

/// Warnings that a CLICK ladder's own habits cause.
const HABITS: [&str; 5] =
    ["out-elsewhere", "set-never-reset", "reset-never-set", "never-written", "unused-tag"];
/// The scan period, in ms: a CLICK scans as fast as it can.
const PERIOD_MS: u32 = 10;

/// The project of a file.
pub(super) fn project(sheet: &[SheetRung], nicknames: ClickNicknames) -> ForeignProject {
    let mut memory = ClickMemory::with(nicknames);
    let mut outcome = Outcome {
        differences: vec![
            format!("A CLICK scans as fast as it can; here every {PERIOD_MS} ms."),
            "In STOP coils are OFF; a CLICK keeps retentive addresses.".to_owned(),
        ],
        ..Outcome::default()
    };
    let mut ladder = LadderFile {
        name: "main".to_owned(),
        doc: "The main program".to_owned(),
        allow: HABITS.to_vec(),
        ..LadderFile::default()
    };
    memory.names.fresh("Main");
    let mut all = vec![clock(&mut memory, &mut ladder.tags)];
    let mut driven = HashSet::new();
    for (number, rung) in sheet.iter().enumerate() {
        let place = SheetPlace { number, is_last: number + 1 == sheet.len() };
        let made = steps(rung, place, &mut memory, &mut driven);
        let fate = match &made {
            Ok(_) => Fate::Exact,
            Err(reason) => Fate::Todo(reason.clone()),
        };
        outcome.rungs.push(RungOutcome {
            place: "main".to_owned(),
            number,
            text: text(rung),
            parts: parts(rung),
            fate,
        });
        let name = format!("r{}", number + 1);
        let doc = rung.comment.clone();
        match made {
            Ok(steps) => {
                let prefix = format!("r{}", number + 1);
                let mut tags = Vec::new();
                let names = &mut memory.names;
                let foreign = ForeignRung { name, doc, prefix, names, tags: &mut tags };
                all.extend(rungs(steps, foreign));
                ladder.tags.extend(tags);
            }
            Err(reason) => {
                let body = RungBody::Todo { reason, was: text(rung) };
                all.push(ProjectRung { name: Some(name), doc, body });
            }
        }
    }
    outcome.renamed = memory.renamed();
    named(&memory, &mut outcome);
    ladder.tags.extend(memory.all());
    ladder.blocks.push(ProjectBlock {
        kind: ProjectBlockKind::Program,
        name: "Main".to_owned(),
        doc: String::new(),
        rungs: all,
        stages: Vec::new(),
    });
    ForeignProject {
        name: "main".to_owned(),
        origin: "CLICK ladder, CSV".to_owned(),
        period_ms: PERIOD_MS,
        files: vec![ladder],
        outcome,
        ..ForeignProject::default()
    }
}

/// Says what the nickname file has that the project has not.
fn named(memory: &ClickMemory, outcome: &mut Outcome) {
    if memory.unused() > 0 {
        let count = memory.unused();
        outcome
            .left_out
            .push(format!("{count} nicknames of addresses that the ladder never names"));
    }
    if memory.has_initial {
        outcome.differences.push(
            "Initial values are those of a cold start; a CLICK sets those of addresses that are \
             not retentive at each start of the program."
                .to_owned(),
        );
    }
    if !memory.retentive.is_empty() {
        outcome.differences.push(format!(
            "{} addresses are retentive: name their tags in [retain] of the controller file ({})",
            memory.retentive.len(),
            memory.retentive.join(", ")
        ));
    }
}

/// The rung that measures the time since the last scan, for the timers.
fn clock(memory: &mut ClickMemory, tags: &mut Vec<ProjectTag>) -> ProjectRung {
    let timer = memory.names.fresh("click_clock");
    let own = |name: &str, kind: &str, doc: &str| ProjectTag {
        name: name.to_owned(),
        kind: kind.to_owned(),
        doc: doc.to_owned(),
        is_own: true,
        ..ProjectTag::default()
    };
    tags.push(own(&timer, "timer", "Measures the time since the last scan"));
    let scan = memory.names.fresh(SCAN_MS);
    tags.push(own(&scan, "int", "ms since the last scan; the period in the first one"));
    let body = RungBody::Ladder {
        when: vec!["$On".to_owned()],
        body: vec![
            format!("TMR {timer} preset=1h"),
            format!("MOVE {timer}.Acc to={scan}"),
            format!("MOVE 0 to={timer}.Acc"),
        ],
        branches: vec![crate::model::ProjectBranch {
            when: vec!["$FirstScan".to_owned()],
            body: vec![format!("MOVE {PERIOD_MS} to={scan}")],
        }],
    };
    let doc = "The time since the last scan, for the timers".to_owned();
    ProjectRung { name: Some("click-clock".to_owned()), doc, body }
}

/// Where a rung stands.
#[derive(Clone, Copy)]
struct SheetPlace {
    number: usize,
    is_last: bool,
}

/// What a rung does.
fn steps(
    rung: &SheetRung,
    place: SheetPlace,
    memory: &mut ClickMemory,
    driven: &mut HashSet<String>,
) -> Result<Vec<RungStep>, String> {
    let mut grid = ClickGrid::of(&rung.rows, |contact| memory.contact(contact))?;
    let mut calls: Vec<PoweredCall> = Vec::new();
    for (row, sheet_row) in rung.rows.iter().enumerate() {
        let text = sheet_row.call.as_str();
        let is_empty = sheet_row.cells.iter().all(String::is_empty);
        match text {
            "" | "NOP" | "NOP()" => continue,
            "end()" if place.is_last && is_empty => continue,
            _ => {}
        }
        let power = grid.power(row)?;
        let Some(pin) = text.strip_prefix('.') else {
            let call = ClickCall::of(text)?;
            calls.push(PoweredCall { call, power, reset: None, down: None });
            continue;
        };
        let last = calls.last_mut().ok_or_else(|| format!("`{text}` before an instruction"))?;
        match pin {
            "reset()" => last.reset = Some(power),
            "down()" => last.down = Some(power),
            _ => return Err(format!("the input `{text}`")),
        }
    }
    if calls.is_empty() && rung.rows.iter().any(has_contact) {
        return Err(format!("contacts without an instruction in rung {}", place.number + 1));
    }
    let mut work = RungWork { memory, driven, steps: Vec::new() };
    for call in &calls {
        work.act(call)?;
    }
    Ok(work.steps)
}

fn has_contact(row: &super::sheet::SheetRow) -> bool {
    row.cells.iter().any(|cell| contact_text(cell).is_some())
}

/// The text of a rung for the report: its cells and instructions, row by row.
fn text(rung: &SheetRung) -> String {
    let rows = rung.rows.iter().map(|row| {
        let cells = row.cells.iter().filter(|cell| !matches!(cell.as_str(), "" | "-"));
        let cells = cells.map(String::as_str);
        cells.chain([row.call.as_str()]).collect::<Vec<_>>().join(" ")
    });
    rows.collect::<Vec<_>>().join("; ")
}

/// How many parts of each kind a rung has.
fn parts(rung: &SheetRung) -> Vec<PartCount> {
    let mut parts: Vec<PartCount> = Vec::new();
    let mut add = |kind: &str| match parts.iter_mut().find(|part| part.kind == kind) {
        Some(part) => part.count += 1,
        None => parts.push(PartCount { kind: kind.to_owned(), count: 1 }),
    };
    for row in &rung.rows {
        row.cells.iter().filter_map(|cell| contact_text(cell)).for_each(|_| add("contact"));
        match row.call.split('(').next() {
            Some("") | None => {}
            Some(name) => add(name),
        }
    }
    parts
}
