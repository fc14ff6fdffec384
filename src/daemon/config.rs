//! From loaded files to settings: makes a program and a controller file ready to run.
//!
//! `load` reads the files and finds the mistakes in them. This module makes the engine's program
//! from the ladder, and the settings of the runtime and the drivers from the controller file.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use rungd_base::progress::{LoadStep, Progress};
use rungd_client::operator::names::OperandNames;
use rungd_config::controller::Controller;
use rungd_config::controller::alarms::AlarmSettings;
use rungd_config::controller::device::Device;
use rungd_config::controller::log::LogSettings;
use rungd_config::controller::operator::Operator;
use rungd_config::controller::record::RecordSettings;
use rungd_config::controller::watch::WatchSettings;
use rungd_config::controller::web::WebSettings;
use rungd_config::load::{self, Loaded, sha256_of};
use rungd_engine as engine;
use rungd_history::record::RecordedFile;
use rungd_io::modbus::settings::ModbusServerSettings;
use rungd_io::plant::settings::InputRule;
use rungd_language::lower::{Symbols, lower_within};
use rungd_language::resolve::program::Program;
use rungd_language::source::finding::Finding;
use rungd_language::source::render::{Style, refuses, render_within};
use rungd_language::source::span::{SourceFile, Span};
use rungd_runtime::exchange::Tempo;
use rungd_runtime::wiring::Wiring;
use rungd_runtime::{Posture, PublicMemory, ScannerSettings, WatchedCells};
use rungd_state::retain::RetainPlan;

use super::narration::Narration;
use super::retain::{RetainSettings, place};

const MS_NS: u64 = 1_000_000;

/// A controller, ready to be started.
pub struct ControllerSetup {
    /// The controller file's name, as given.
    pub controller: String,
    /// The log's facts about the ladder.
    pub ladder: LadderFacts,
    /// SHA-256 sums over all files including the controller file: one of the names, one of the
    /// texts.
    pub(super) source: String,
    /// The warnings of the check.
    pub warnings: Vec<LoadWarning>,
    pub(super) symbols: Symbols,
    pub(super) names: Arc<OperandNames>,
    pub(super) operator: Operator,
    /// What users of pages may write and hold.
    pub(super) pages: Arc<WebSettings>,
    pub(super) narration: Narration,
    pub(super) watched: WatchedCells,
    pub(super) pace: ScannerSettings,
    pub(super) memory: PublicMemory,
    pub(super) posture: Posture,
    pub(super) modbus: Option<ModbusServerSettings>,
    pub(super) rules: Vec<InputRule>,
    pub(super) devices: Vec<rungd_config::controller::device::Device>,
    /// The wiring of each of `devices`, in the same order.
    pub(super) field: Vec<Wiring>,
    /// The trial time of a reloaded program; zero: no trial.
    pub(super) probation: Duration,
    pub(super) retain: Option<RetainSettings>,
    pub(super) record: RecordSettings,
    /// The lines that the recording's thread judges.
    pub(super) watches: WatchSettings,
    pub(super) alarms: AlarmSettings,
    pub(super) log: LogSettings,
    /// The files, for the scan log: the controller file first.
    pub(super) files: Arc<[RecordedFile]>,
    /// Who may read the files.
    pub(super) access: FileAccess,
}

/// A program that is or was running, with its settings.
pub struct RunningProgram {
    pub program: engine::EngineProgram,
    pub setup: ControllerSetup,
}

/// A warning of the check.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadWarning {
    /// Its place.
    pub span: Span,
    /// The message, with the warning's name.
    pub text: String,
}

/// Who could read the files of a program when it was loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileAccess {
    Everybody,
    NotEverybody,
}

impl FileAccess {
    /// The program's generation, if not everybody could read its files.
    pub(super) fn private(self, generation: u32) -> Option<u32> {
        match self {
            FileAccess::Everybody => None,
            FileAccess::NotEverybody => Some(generation),
        }
    }
}

/// The facts about a ladder that the log shows at the start.
#[derive(Clone, Debug)]
pub struct LadderFacts {
    /// The ladder's name.
    pub name: String,
    /// The number of the program's ladder files.
    pub ladders: usize,
    /// The names of these files.
    pub files: String,
    /// SHA-256 of the files' bytes, concatenated: `cat FILES | sha256sum` gives the same.
    pub sha256: String,
    /// The number of Programs and Tasks.
    pub blocks: usize,
    /// The number of rungs.
    pub rungs: usize,
}

impl ControllerSetup {
    /// Whether the field devices of two setups differ in name, polling, driver or wiring.
    pub(super) fn devices_differ(&self, other: &ControllerSetup) -> bool {
        let same = |(a, b): (&Device, &Device)| {
            a.name == b.name && a.poll_ms == b.poll_ms && a.driver == b.driver
        };
        let (ours, theirs) = (&self.devices, &other.devices);
        self.field != other.field
            || ours.len() != theirs.len()
            || !ours.iter().zip(theirs).all(same)
    }
}

/// The reason why a load has no result that nobody waits for any more.
const TIME_OVER: &str = "its time was over";

/// Makes loaded files ready to run. `loaded` must have no errors.
///
/// # Errors
/// Nothing was loaded, or the load must end.
pub fn settle(
    loaded: &Loaded,
    progress: &Progress,
) -> Result<(engine::EngineProgram, ControllerSetup), String> {
    let Loaded { files, program: Some(program), controller: Some(controller), .. } = loaded else {
        return Err("nothing was loaded".to_owned());
    };
    let access = access(files, progress);
    progress.begin(LoadStep::Lowering);
    let lowered = lower_within(program, progress);
    let (code, symbols) = lowered.ok_or_else(|| TIME_OVER.to_owned())?;
    let pace = pace(controller);
    let (narration, watched) = Narration::new(program, &symbols);
    let narration = narration.at(pace.tempo).telling(controller.log.blocks);
    let narration = narration.watching(&controller.watches, &controller.alarms);
    let setup = ControllerSetup {
        controller: files[0].name.clone(),
        ladder: facts(program, &files[1..=loaded.ladders]),
        source: source(files),
        warnings: loaded.findings.iter().map(warning).collect(),
        narration,
        watched,
        names: Arc::new(OperandNames::new(program, &symbols)),
        operator: controller.operator.clone(),
        pages: Arc::new(controller.web.clone()),
        pace,
        memory: PublicMemory::new(&symbols.layout, controller.safe_values(program.sizes.y)),
        posture: controller.realtime.clone(),
        modbus: controller.modbus.clone(),
        rules: controller.rules.clone(),
        field: controller.wirings(&symbols),
        devices: controller.devices.clone(),
        probation: Duration::from_millis(controller.probation_ms.into()),
        retain: retain(controller, program, &symbols, &files[0].name),
        record: controller.record.clone(),
        watches: controller.watches.clone(),
        alarms: controller.alarms.clone(),
        log: controller.log.clone(),
        files: files.iter().map(recorded).collect(),
        access,
        symbols,
    };
    Ok((code, setup))
}

/// The reason why no program was loaded.
pub enum LoadFailure {
    /// The controller file cannot be read.
    Unreadable(anyhow::Error),
    /// The files cannot run: their findings as text, or that the time was over.
    Refused(String),
}

impl LoadFailure {
    /// The reason as text.
    pub fn text(self) -> String {
        match self {
            LoadFailure::Unreadable(failure) => format!("{failure:#}"),
            LoadFailure::Refused(why) => why,
        }
    }
}

/// Loads the files and makes them ready to run. Only the scan log keeps the texts of the files.
///
/// # Errors
/// The controller file cannot be read, or the files cannot run.
pub fn load(
    path: &Path,
    style: Style,
    progress: &Progress,
) -> Result<(engine::EngineProgram, ControllerSetup), LoadFailure> {
    let loaded = load::controller_file_within(path, progress).map_err(LoadFailure::Unreadable)?;
    if progress.is_over() {
        return Err(LoadFailure::Refused(TIME_OVER.to_owned()));
    }
    if refuses(&loaded.findings, style) {
        progress.begin(LoadStep::Findings);
        let findings = render_within(&loaded.findings, &loaded.files, style, progress);
        return Err(LoadFailure::Refused(findings));
    }
    let settled = settle(&loaded, progress).map_err(LoadFailure::Refused);
    drop(loaded);
    rungd_runtime::return_freed_memory();
    settled
}

/// Who may read the files.
fn access(files: &[SourceFile], progress: &Progress) -> FileAccess {
    let is_public = progress.during(files).all(|file| {
        progress.begin(LoadStep::Reading(file.name.clone()));
        load::may_all_read(Path::new(&file.name))
    });
    if is_public { FileAccess::Everybody } else { FileAccess::NotEverybody }
}

fn retain(
    controller: &Controller,
    program: &Program,
    symbols: &Symbols,
    file: &str,
) -> Option<RetainSettings> {
    let retention = &controller.retention;
    let plan = RetainPlan::new(&controller.retain, program, symbols);
    (!plan.is_empty()).then(|| RetainSettings {
        path: place(retention.file.as_deref(), Path::new(file)),
        plan,
        interval: Duration::from_millis(u64::from(retention.interval_ms)),
        runs_cold: retention.runs_cold,
        has_operator: false,
        budget: u64::from(retention.budget_mb) * 1_000_000,
    })
}

fn recorded(file: &SourceFile) -> RecordedFile {
    RecordedFile { name: file.name.clone(), text: file.text.as_str().into() }
}

fn warning(finding: &Finding) -> LoadWarning {
    let text = format!("{} ({})", finding.message, finding.code.name());
    LoadWarning { span: finding.span, text }
}

fn pace(controller: &Controller) -> ScannerSettings {
    let statistics_ms = u64::from(controller.log.statistics_ms);
    ScannerSettings {
        tempo: Tempo {
            period_ns: controller.period.ns(),
            watchdog_ns: u64::from(controller.watchdog_ms) * MS_NS,
        },
        scans: None,
        statistics_every_ns: (statistics_ms > 0).then_some(statistics_ms * MS_NS),
        start_in_stop: None,
    }
}

fn facts(program: &Program, files: &[SourceFile]) -> LadderFacts {
    let names: Vec<_> = files.iter().map(|file| file.name.as_str()).collect();
    LadderFacts {
        name: program.name.clone(),
        ladders: files.len(),
        files: names.join(" "),
        sha256: sha256(files),
        blocks: program.blocks.len(),
        rungs: super::narration::rungs(program),
    }
}

fn sha256(files: &[SourceFile]) -> String {
    sha256_of(files.iter().map(|file| file.text.as_str()))
}

/// A text that is equal for files with equal names and contents.
fn source(files: &[SourceFile]) -> String {
    let parts = files.iter().map(|file| format!("{} {}\n", file.name, file.text.len()));
    let names = SourceFile { name: String::new(), text: parts.collect() };
    sha256(std::slice::from_ref(&names)) + &sha256(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A program with a number of rungs, and the settings of a controller file.
    fn loaded(rungs: usize) -> Loaded {
        let file = |name: &str, text: String| SourceFile { name: name.into(), text };
        let rung = |at: usize| format!("{{ when = [\"X0\"], do = [\"OUT C{at}\"] }}, ");
        let rungs: String = (0..rungs).map(rung).collect();
        let ladder = format!("[[program]]\nname = \"Main\"\nrung = [{rungs}]\n");
        let controller = "ladder = [\"no-such-ladder.toml\"]\n".to_owned();
        let files =
            [file("no-such-controller.toml", controller), file("no-such-ladder.toml", ladder)];
        load::recorded_files(&files)
    }

    /// The number of looks while a program is lowered.
    fn looks(loaded: &Loaded) -> usize {
        let progress = Progress::over_within(LoadStep::Lowering, usize::MAX);
        assert!(settle(loaded, &progress).is_ok(), "{:?}", loaded.findings);
        usize::MAX - progress.looks_left()
    }

    #[test]
    fn a_load_that_times_out_ends_while_lowering_the_program() {
        let (some, more) = (loaded(20), loaded(40));
        let looks = (looks(&some), looks(&more));
        assert!(looks.1 >= looks.0 + 20, "{looks:?}");
        for before in 0..looks.0 {
            let progress = Progress::over_within(LoadStep::Lowering, before);
            let settled = settle(&some, &progress);
            assert_eq!(settled.err().as_deref(), Some(TIME_OVER), "after {before} looks");
            assert_eq!(progress.current(), Some(LoadStep::Lowering));
        }
    }

    #[test]
    fn the_hash_covers_the_concatenated_bytes_of_all_files() {
        let file = |text: &str| SourceFile { name: String::new(), text: text.into() };
        let whole = sha256(&[file("abc")]);
        assert!(whole.starts_with("ba7816bf8f01cfea") && whole.len() == 64);
        assert_eq!(sha256(&[file("a"), file("bc")]), whole);
    }
}
