//! Files → settings: a controller file and its ladders, read, judged, and made ready to run.
//!
//! Options mirror the files, settings are resolved: what comes out of [`load`] has every default
//! in its place and every address found. What is wrong comes out as one text with all findings,
//! for a person at a terminal or in a log.

use std::path::Path;

use crate::engine;
use crate::isa::{Bit, BitSpace};
use crate::lower::{Symbols, lower};
use crate::resolve::controller::{self as resolved, resolve_controller};
use crate::resolve::program::Program;
use crate::resolve::{LoadOptions, load_ladders};
use crate::runtime::{Memory, Pace, Posture, Safe, Watched};
use crate::source::controller::{self as written, Realtime};
use crate::source::finding::{Finding, Severity};
use crate::source::render::{Style, render};
use crate::source::span::{FileId, SourceFile};

use super::narration::Narration;

const MS_NS: u64 = 1_000_000;

/// Why a controller file is not run: a text of one or more lines that names file, place, cause
/// and remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal(pub String);

/// A controller, ready to be started.
pub struct Setup {
    /// The controller file, as given.
    pub controller: String,
    /// What the log tells of the ladder.
    pub ladder: LadderFacts,
    /// All warnings as text; empty without any.
    pub warnings: String,
    pub(super) program: engine::Program,
    pub(super) symbols: Symbols,
    pub(super) narration: Narration,
    pub(super) watched: Watched,
    pub(super) pace: Pace,
    pub(super) memory: Memory,
    pub(super) posture: Posture,
    pub(super) modbus: Option<resolved::Modbus>,
    pub(super) rules: Vec<resolved::Device>,
}

/// What is told of a ladder at start.
#[derive(Clone, Debug)]
pub struct LadderFacts {
    /// Its name.
    pub name: String,
    /// Its files.
    pub files: String,
    /// SHA-256 of the files' bytes one behind the other: `cat FILES | sha256sum` gives the same.
    pub sha256: String,
    /// How many Programs and Tasks.
    pub blocks: usize,
    /// How many rungs.
    pub rungs: usize,
}

/// Loads a controller file and its ladders.
///
/// # Errors
/// All that is wrong with them, as text.
pub fn load(path: &Path) -> Result<Setup, Refusal> {
    let mut files = vec![read(path, None)?];
    let (controller, found) = written::read(&files[0].text, FileId(0));
    let Some(controller) = controller.filter(|_| !any_error(&found)) else {
        return Err(refusal(&found, &files));
    };
    for ladder in &controller.ladder {
        let named_in = Some((&files[0], ladder.span.start));
        let ladder = path.parent().unwrap_or(Path::new("")).join(&ladder.text);
        files.push(read(&ladder, named_in)?);
    }
    let order = controller.order.clone();
    let options = LoadOptions { sizes: controller.memory.clone(), order, first_file: FileId(1) };
    let (program, found) = load_ladders(&files[1..], &options);
    let Some(program) = program else { return Err(refusal(&found, &files)) };
    judge(path, &controller, &program, found, &files)
}

/// The cross-checks: does what the controller file asks for fit the program, and this version?
fn judge(
    path: &Path,
    written: &written::Controller,
    program: &Program,
    mut findings: Vec<Finding>,
    files: &[SourceFile],
) -> Result<Setup, Refusal> {
    let (controller, found) = resolve_controller(written, program);
    findings.extend(found);
    findings.sort_by_key(|f| (f.span.file, f.span.start));
    if any_error(&findings) {
        return Err(refusal(&findings, files));
    }
    if let Some(range) = written.retain.first() {
        let place = place(&files[0], range.span.start);
        return Err(Refusal(format!(
            "{place}: `[retain] ranges` asks for memory that survives a restart, and this version \
             has no store for it: it would start cold without a word. Take the table out to run \
             without."
        )));
    }
    let mut setup = settle(&controller, program, files);
    setup.controller = path.display().to_string();
    if !findings.is_empty() {
        setup.warnings = render(&findings, files, Style::default());
    }
    Ok(setup)
}

fn settle(controller: &resolved::Controller, program: &Program, files: &[SourceFile]) -> Setup {
    let (code, symbols) = lower(program);
    let (narration, watched) = Narration::new(program, &symbols);
    let layout = &symbols.layout;
    let first_output = layout.bit(Bit::Space(BitSpace::Y, 0)).0 as usize;
    Setup {
        controller: String::new(),
        ladder: facts(program, &files[1..]),
        warnings: String::new(),
        narration,
        watched,
        pace: pace(controller),
        memory: Memory {
            inputs: program.sizes.x,
            bits: layout.bit_count() as usize,
            words: layout.word_count() as usize,
            first_output,
            safe: safe_values(controller, program.sizes.y),
        },
        posture: posture(&controller.realtime),
        modbus: controller.modbus.clone(),
        rules: controller.devices.clone(),
        program: code,
        symbols,
    }
}

fn pace(controller: &resolved::Controller) -> Pace {
    let statistics = match controller.statistics_ms {
        0 => u64::MAX / 2,
        ms => u64::from(ms) * MS_NS,
    };
    Pace {
        period_ns: u64::from(controller.period_ms) * MS_NS,
        watchdog_ns: u64::from(controller.watchdog_ms) * MS_NS,
        scans: None,
        statistics_every_ns: statistics,
    }
}

fn posture(realtime: &Realtime) -> Posture {
    Posture {
        priority: (realtime.priority > 0).then_some(realtime.priority),
        lock_memory: realtime.lock_memory,
        cpu_dma_latency: realtime.cpu_dma_latency,
        cpu: realtime.cpu,
        strict: realtime.strict,
    }
}

fn safe_values(controller: &resolved::Controller, outputs: u32) -> Vec<Safe> {
    let mut safe = vec![Safe::Off; outputs as usize];
    let kinds = [(&controller.outputs_on, Safe::On), (&controller.outputs_hold, Safe::Hold)];
    for (ranges, kind) in kinds {
        for range in ranges {
            for output in range.first..=range.last {
                safe[output as usize] = kind;
            }
        }
    }
    safe
}

fn facts(program: &Program, files: &[SourceFile]) -> LadderFacts {
    let rungs = |block: &crate::resolve::program::Block| {
        block.rungs.len() + block.stages.iter().map(|stage| stage.rungs.len()).sum::<usize>()
    };
    let names: Vec<_> = files.iter().map(|file| file.name.as_str()).collect();
    LadderFacts {
        name: program.name.clone(),
        files: names.join(" "),
        sha256: sha256(files),
        blocks: program.blocks.len(),
        rungs: program.blocks.iter().map(rungs).sum(),
    }
}

fn sha256(files: &[SourceFile]) -> String {
    let mut hash = hmac_sha256::Hash::new();
    for file in files {
        hash.update(file.text.as_bytes());
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

fn read(path: &Path, named_in: Option<(&SourceFile, u32)>) -> Result<SourceFile, Refusal> {
    let name = path.display().to_string();
    let from = named_in.map(|(file, at)| format!("{}: ", place(file, at))).unwrap_or_default();
    let bytes = std::fs::read(path)
        .map_err(|error| Refusal(format!("{from}cannot read {name}: {error}")))?;
    let text = String::from_utf8(bytes)
        .map_err(|_| Refusal(format!("{from}{name} is not UTF-8 text, so it is not TOML")))?;
    Ok(SourceFile { name, text })
}

fn place(file: &SourceFile, offset: u32) -> String {
    let (line, column) = file.line_column(offset);
    format!("{}:{line}:{column}", file.name)
}

fn any_error(findings: &[Finding]) -> bool {
    findings.iter().any(|finding| finding.severity() == Severity::Error)
}

fn refusal(findings: &[Finding], files: &[SourceFile]) -> Refusal {
    Refusal(render(findings, files, Style::default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_the_bytes_one_behind_the_other() {
        let file = |text: &str| SourceFile { name: String::new(), text: text.into() };
        let whole = sha256(&[file("abc")]);
        assert!(whole.starts_with("ba7816bf8f01cfea") && whole.len() == 64);
        assert_eq!(sha256(&[file("a"), file("bc")]), whole);
    }
}
