//! A resolved test file: its programs, its `always` conditions, its scenarios and random tests.
//!
//! `reading` makes it from the files; `player` executes it. `docs/testing.md` describes the form of
//! the file. No file is read here, and nothing runs.

use std::sync::Arc;

use super::condition::Condition;
use super::view::View;
use super::written_prove::ProofEvent;
use crate::rig::{PowerOff, SimulatedDevice};
use rungd_config::controller::Controller;
use rungd_engine::Cell;
use rungd_engine::isa::DeviceId;
use rungd_language::resolve::program::Program;
use rungd_language::source::span::{Located, SourceFile, Span};

/// A test file that can be executed.
#[derive(Clone, Debug)]
pub struct Suite {
    /// The name of the test file, as the caller wrote it.
    pub name: String,
    /// The test file with its text. Places of steps are places in this file.
    pub file: SourceFile,
    /// The program with which scenarios begin, then the programs of `reload` steps.
    pub programs: Vec<TestProgram>,
    /// The conditions of `always`, for each of `programs` in the same order.
    pub always: Vec<Vec<Condition>>,
    /// The number of the last conditions of `always` that are those of `[[interlock]]`.
    pub interlocked: usize,
    /// `[[simulated]]`: the field devices whose own side is a ladder.
    pub devices: Vec<SimulatedDevice>,
    /// `[[scenario]]`, in file order.
    pub scenarios: Vec<Scenario>,
    /// `[[random]]`, in file order.
    pub randoms: Vec<RandomTest>,
    /// `[prove]`, or what a proof without it assumes.
    pub proof: ProofSettings,
}

impl Suite {
    /// The text of a place in the test file.
    pub(super) fn text(&self, span: Span) -> &str {
        self.file.text.get(span.start as usize..span.end as usize).unwrap_or_default()
    }

    /// The line and column of a place, from 1.
    pub(super) fn place(&self, span: Span) -> (u32, u32) {
        self.file.line_column(span.start)
    }

    /// The line of a place, from 1.
    pub(super) fn line(&self, span: Span) -> u32 {
        self.place(span).0
    }
}

/// A program under test, with its settings.
#[derive(Clone, Debug)]
pub struct TestProgram {
    /// The ladder.
    pub program: Arc<Program>,
    /// The settings of a controller file, or `period` and `[retain]` of the test file.
    pub controller: Arc<Controller>,
    /// All files of its load; places in `program` refer to them by index.
    pub files: Vec<SourceFile>,
    /// The program as conditions see it; `None`: they see the memory of the controller alone.
    pub view: Option<Arc<View>>,
}

impl TestProgram {
    /// A place in its files, as text: `plant.toml:12`.
    pub fn place(&self, span: Span) -> String {
        let span = self.program.layers.in_file(span);
        let Some(file) = self.files.get(span.file.0 as usize) else { return String::new() };
        format!("{}:{}", file.name, file.line_column(span.start).0)
    }
}

/// The number of a program in [`Suite::programs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramId(pub usize);

/// One `[[scenario]]`.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Its name; unique in its file.
    pub name: String,
    /// Its place.
    pub span: Span,
    /// Memory before the first scan.
    pub set: Vec<(TestOperand, i32)>,
    /// Its steps, each with its place in the file: the text between the quotes.
    pub steps: Vec<Located<TestStep>>,
}

/// A bit or word, with its name in the test file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TestOperand {
    /// Its name.
    pub name: String,
    /// Its cell, in the program that is running when the operand is used.
    pub cell: Cell,
    /// The number of the X, for an input; `None` for any other operand.
    pub input: Option<u32>,
    /// The device in whose ladder it is; `None`: it is the controller's.
    pub device: Option<DeviceId>,
}

/// A time of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TestTime {
    /// A duration, ms. It is rounded up to scans, at least one.
    Ms(u32),
    /// A number of scans; at least one.
    Scans(u64),
}

/// A step of a scenario. `docs/testing.md` describes its meaning.
#[derive(Clone, Debug)]
pub enum TestStep {
    /// `set OP VALUE`: an X keeps the value; any other operand is written once.
    Set(TestOperand, i32),
    /// `force OP VALUE`
    Force(TestOperand, i32),
    /// `unforce OP`
    Unforce(TestOperand),
    /// `pulse OP D [every D times N]`
    Pulse {
        /// A bit that is OFF.
        operand: TestOperand,
        /// The time for which it is ON.
        on: TestTime,
        /// The time from one pulse to the next; equal to `on` if not given.
        every: TestTime,
        /// The number of pulses; at least 1.
        times: u32,
    },
    /// `beat OP D every D`: pulses in the background, until a `set` of OP.
    Beat {
        /// A bit.
        operand: TestOperand,
        /// The time for which it is ON.
        on: TestTime,
        /// The time from one pulse to the next.
        every: TestTime,
    },
    /// `run D`, `run N scans`
    Run(TestTime),
    /// `late N`: the next scan comes N periods after it was due; at least 1.
    Late(u32),
    /// `expect: CONTACTS`
    Expect(Condition),
    /// `within D: CONTACTS`
    Within(TestTime, Condition),
    /// `hold D: CONTACTS`
    Hold(TestTime, Condition),
    /// `stop`: executes the last scan, then STOP.
    Stop,
    /// `start`: from STOP to RUN.
    Start,
    /// `restart [for D]`: an orderly stop, and after D a new process.
    Restart {
        /// D: the time without a process, ms.
        down_ms: u32,
    },
    /// `power-cut [lose D] [for D]`: a new process after a crash.
    PowerCut(PowerOff),
    /// `reload FILE…`
    Reload(Reload),
    /// `lose DEVICE`
    Lose(DeviceId),
    /// `restore DEVICE`
    Restore(DeviceId),
    /// `clock TIME`: the local time, as seconds since 1970-01-01 00:00:00 of the local clock.
    Clock(i64),
}

impl TestStep {
    /// The program that a `reload` brings; `None` for other steps, and for a refused reload.
    pub fn reloaded(&self) -> Option<ProgramId> {
        let TestStep::Reload(Reload::To(program)) = self else { return None };
        Some(*program)
    }
}

/// The result of a `reload` step.
#[derive(Clone, Debug)]
pub enum Reload {
    /// The program that is swapped in.
    To(ProgramId),
    /// `rungd reload` refuses these files, with the text of the findings. The scenario has no
    /// further steps.
    Refused(String),
}

/// One `[[random]]`.
#[derive(Clone, Debug)]
pub struct RandomTest {
    /// Its name; unique in its file.
    pub name: String,
    /// Its place.
    pub span: Span,
    /// The number of runs.
    pub runs: u32,
    /// The number of scans of each run.
    pub scans: u64,
    /// The seed.
    pub seed: u64,
    /// Memory before the first scan of each run.
    pub set: Vec<(TestOperand, i32)>,
    /// What happens to the controller and its field devices at random, before the changes of a
    /// scan.
    pub incidents: Vec<RandomIncident>,
    /// The random changes: those of `change`, then the operator's writes, each in file order.
    pub changes: Vec<RandomChange>,
}

impl RandomTest {
    /// The probability of each incident, then of each change.
    pub(super) fn chances(&self) -> impl Iterator<Item = Chance> {
        let incidents = self.incidents.iter().map(|incident| incident.chance);
        incidents.chain(self.changes.iter().map(|change| change.chance))
    }

    /// The incident or change with a number among these.
    pub(super) fn source(&self, number: usize) -> RandomSource<'_> {
        match self.incidents.get(number) {
            Some(incident) => RandomSource::Incident(&incident.incident),
            None => RandomSource::Change(&self.changes[number - self.incidents.len()]),
        }
    }

    /// Whether a run begins new processes.
    pub(super) fn begins_processes(&self) -> bool {
        self.incidents
            .iter()
            .any(|one| matches!(one.incident, Incident::PowerCut | Incident::Restart))
    }
}

/// What a random event comes from.
pub(super) enum RandomSource<'t> {
    Incident(&'t Incident),
    Change(&'t RandomChange),
}

/// Something that happens to the controller or a field device at random.
#[derive(Clone, Debug)]
pub struct RandomIncident {
    /// What happens.
    pub incident: Incident,
    /// The probability that it happens in a scan.
    pub chance: Chance,
}

/// Something that happens to the controller or a field device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Incident {
    /// The device is lost, or comes back.
    Device {
        /// The device.
        id: DeviceId,
        /// Its name.
        name: String,
    },
    /// A crash, and a new process before the scan.
    PowerCut,
    /// An orderly stop, whose last scan this is, and a new process before the next one.
    Restart,
    /// An orderly stop, whose last scan this is; RUN before the next one.
    Stop,
}

/// A random change of an operand.
#[derive(Clone, Debug)]
pub struct RandomChange {
    /// The operand.
    pub operand: TestOperand,
    /// The probability of a change in a scan.
    pub chance: Chance,
    /// The kind of the change.
    pub motion: RandomMotion,
}

impl RandomChange {
    /// Whether it happens in every scan.
    pub(super) fn is_certain(&self) -> bool {
        self.chance.is_certain()
    }
}

/// A probability, in parts of a million.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chance(pub u32);

impl Chance {
    /// Whether it is 100 %.
    pub(super) fn is_certain(self) -> bool {
        self.0 >= 1_000_000
    }
}

/// The kind of a random change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RandomMotion {
    /// A bit toggles.
    Toggle,
    /// A word goes up or down by a step, within limits.
    Walk {
        /// The minimum.
        low: f64,
        /// The maximum.
        high: f64,
        /// The size of a step.
        step: f64,
    },
    /// A word gets any value within limits: a whole number; for a real, any number.
    Jump {
        /// The minimum.
        low: f64,
        /// The maximum.
        high: f64,
    },
}

/// `[prove]`, resolved in the names of the program with which scenarios begin.
#[derive(Clone, Debug)]
pub struct ProofSettings {
    /// What may change before each scan; `None`: every input that a line depends on.
    pub inputs: Option<Vec<FreeOperand>>,
    /// `assume`: what is ON in every scan, before its rungs.
    pub assume: Vec<Condition>,
    /// Of each line of `always` of the first program: why no proof is about it, with a remedy.
    pub outside: Vec<Option<String>>,
    /// `can`: what some sequence of inputs turns ON, from every state that can be reached.
    pub can: Vec<Condition>,
    /// The maximum number of periods from one scan to the next; 1: exactly a period.
    pub late_max: u32,
    /// Whether retained memory has any values before the first scan.
    pub from_retained: bool,
    /// What may happen to the controller.
    pub events: Vec<ProofEvent>,
    /// What an operator writes.
    pub writable: Vec<FreeOperand>,
    /// What has any value in every scan.
    pub any: Vec<FreeOperand>,
    /// The maximum number of states that are explored.
    pub states: Option<u64>,
    /// The maximum number of scans that are looked at.
    pub depth: Option<u64>,
    /// The time for each line, ms.
    pub time_ms: u32,
}

/// A bit or word that has any value within limits.
#[derive(Clone, Debug)]
pub struct FreeOperand {
    /// The operand.
    pub operand: TestOperand,
    /// The smallest content of its cell; 0 for a bit.
    pub low: i32,
    /// The largest content of its cell; 1 for a bit.
    pub high: i32,
}
