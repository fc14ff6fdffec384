//! What a reader of the scan log shows of an output is what was driven: by the mode, the safe
//! values, and the `.Ok` of its device.

use std::sync::Arc;

use super::change_run::{ChangeRun, SectionName};
use super::logged_program::{ChooseCells, LoggedProgram};
use super::{LiveProgram, LiveView};
use crate::operator::protocol::{PresentOutputs, UnknownOutput};
use rungd_config::controller::{OUTPUT_UNKNOWN, OutputState};
use rungd_engine::{Cell, Engine, EngineCall, EngineState, ScanTimes};
use rungd_history::observe::PowerRun;
use rungd_history::record::{RecordedFile, RecordedProgram};
use rungd_runtime::exchange::{FaultReason, Mode, StopReason};
use rungd_runtime::{SectionStart, TapeEntry, TapeSection};

const CONTROLLER: &str = r#"
ladder = ["l.toml"]
[outputs]
on = ["Y1", "Y4"]
hold = ["Y2"]
[[device]]
name = "cabinet"
driver = "modbus-tcp"
address = "127.0.0.1:1"
map = [{ from = "Y3", to = "coil 0" }]
"#;

const LADDER: &str = r#"
[ladder]
name = "oven"
devices = ["cabinet"]
[tags]
off = { at = "Y0" }
on = { at = "Y1" }
held = { at = "Y2" }
wired = { at = "Y3" }
coil = { at = "Y4" }
plain = { at = "Y5" }
copy = { at = "C5" }
level = { at = "D0" }
[[program]]
name = "Main"
rung = [
  { when = ["X0"], do = ["SET off", "SET held", "SET wired", "MOVE 7 to=level"] },
  { when = ["X1"], do = ["OUT coil", "OUT plain", "OUT copy"] },
]
"#;

const MS: u64 = 1_000_000;

/// A log that is written by hand.
struct Log {
    program: Arc<LiveProgram>,
    engine: Engine,
    section: TapeSection,
    scans: u64,
}

impl Log {
    fn new() -> Log {
        let file = |name: &str, text: &str| RecordedFile { name: name.into(), text: text.into() };
        let files = vec![file("c.toml", CONTROLLER), file("l.toml", LADDER)];
        let recorded = RecordedProgram { files, ..RecordedProgram::default() };
        let program = Arc::new(LiveProgram::of(Arc::new(recorded)).expect("it loads"));
        let mut engine = Engine::new(program.subject.whole_code());
        engine.apply(EngineCall::Start { now_ns: 0 });
        let start = SectionStart {
            generation: 0,
            number: 1,
            mode: Mode::Run,
            unix_offset_ns: 0,
            lost: 0,
            follows: false,
        };
        let state = EngineState::of(&engine);
        let section = TapeSection { start, state, entries: Vec::new(), who: Vec::new() };
        Log { program, engine, section, scans: 0 }
    }

    fn cell(&self, operand: &str) -> Cell {
        self.program.subject.cell(operand).expect("it has it")
    }

    fn call(&mut self, call: EngineCall) {
        self.engine.apply(call);
        self.section.entries.push(TapeEntry::Call(call));
    }

    /// A scan in which these operands come from outside.
    fn scan(&mut self, writes: &[(&str, i32)]) {
        self.scans += 1;
        let (now_ns, times) = (self.scans * 100 * MS, ScanTimes::default());
        self.call(EngineCall::Begin { now_ns, times, local_s: 0 });
        for (operand, value) in writes {
            self.call(EngineCall::Write(self.cell(operand), *value));
        }
        self.call(EngineCall::Execute);
    }

    fn mode(&mut self, mode: Mode) {
        self.section.entries.push(TapeEntry::Mode(mode));
    }

    fn view(&self, present: Option<PresentOutputs>) -> LiveView {
        let program = Arc::clone(&self.program);
        let mut run = PowerRun::new(Arc::clone(&program.subject));
        let power = Arc::new(run.last_of(&self.section).expect("it has scans"));
        let sections = vec![Arc::new(self.section.clone())];
        LiveView {
            program,
            power,
            has_minute: true,
            present: present.map(Arc::new),
            sections,
            earlier: None,
        }
    }

    /// The state of an output in the last scan.
    fn output(&self, operand: &str) -> Option<OutputState> {
        let view = self.view(None);
        view.output(&view.power, self.cell(operand))
    }

    /// The points of a trend, as scan and value.
    fn trend(&self, operand: &str) -> Vec<(u64, Option<i32>)> {
        let trend = self.view(None).trend(operand).expect("an operand");
        trend.points.iter().map(|point| (point.scan, point.value)).collect()
    }

    /// The published values of a tag.
    fn published(&self, tag: &str) -> Vec<i32> {
        let cell = self.cell(tag);
        let choose: ChooseCells = Arc::new(move |_, _| vec![("tag".to_owned(), cell)]);
        let logged = LoggedProgram::of(&self.program.recorded, &choose).expect("it loads");
        let mut values = Vec::new();
        let mut tell = |change: super::LoggedChange| values.push(change.value);
        let name = SectionName { process_start_ns: 1, sequence: 1 };
        assert!(ChangeRun::new(Arc::new(logged)).take(name, &self.section, &mut tell));
        values
    }
}

/// Two scans in RUN: the bits go ON in the second one.
fn in_run() -> Log {
    let mut log = Log::new();
    log.scan(&[("cabinet.Ok", 1)]);
    log.scan(&[("X0", 1)]);
    log
}

#[test]
fn an_output_equals_memory_in_run() {
    let log = in_run();
    for tag in ["off", "on", "held", "wired"] {
        assert_eq!(log.output(tag), Some(OutputState::AsMemory), "{tag}");
    }
    assert_eq!(log.output("level"), None);
    assert_eq!(log.trend("off"), [(0, Some(0)), (2, Some(1))]);
    assert_eq!(log.published("off"), [0, 1]);
}

#[test]
fn an_output_has_its_safe_value_outside_run() {
    let modes = [Mode::Stop(StopReason::Operator), Mode::Fault(FaultReason::ScanNeverEnds)];
    for mode in modes {
        let mut log = in_run();
        log.mode(mode);
        assert_eq!(log.output("off"), Some(OutputState::Safe(false)));
        assert_eq!(log.output("on"), Some(OutputState::Safe(true)));
        assert_eq!(log.output("held"), Some(OutputState::Safe(true)));
        assert_eq!(log.trend("off"), [(0, Some(0)), (2, Some(1)), (2, Some(0))]);
        assert_eq!(log.trend("held"), [(0, Some(0)), (2, Some(1))]);
        assert_eq!(log.published("off"), [0, 1, 0]);
        assert_eq!(log.published("on"), [0, 1]);
        assert_eq!(log.published("held"), [0, 1]);
        let why = log.view(None).why("off", None).expect("an answer").text();
        let head = format!(
            "off (Y0) is ON in memory; its output is OFF, the safe value in {}\n",
            mode.name()
        );
        assert!(why.starts_with(&head), "{why}");
        // An earlier scan shows what was driven then.
        let view = log.view(None);
        let power = view.at(1).expect("a scan");
        assert_eq!(view.output(&power, log.cell("on")), Some(OutputState::AsMemory));
        // RUN goes on with its first scan, in which memory is driven again.
        log.mode(Mode::Run);
        log.call(EngineCall::Start { now_ns: 250 * MS });
        log.scan(&[]);
        let points = [(0, Some(0)), (2, Some(1)), (2, Some(0)), (3, Some(1))];
        assert_eq!(log.trend("off"), points);
        assert_eq!(log.published("off"), [0, 1, 0, 1]);
    }
}

/// A STOP: the last scan, in which memory is as before, the passes, which turn OFF what OUT drives,
/// and the mode. The scan thread drives the outputs before the passes and after the mode.
#[test]
fn the_passes_of_a_stop_are_never_driven() {
    let mut log = Log::new();
    log.scan(&[("X1", 1), ("cabinet.Ok", 1)]);
    log.call(EngineCall::RequestStop);
    log.scan(&[]);
    log.call(EngineCall::Terminate);
    // Somebody looks right now.
    assert_eq!(log.trend("coil"), [(0, Some(0)), (1, Some(1))]);
    assert_eq!(log.published("coil"), [1]);
    log.mode(Mode::Stop(StopReason::Operator));
    assert_eq!(log.trend("coil"), [(0, Some(0)), (1, Some(1))], "its safe value is ON");
    assert_eq!(log.published("coil"), [1]);
    assert_eq!(log.trend("plain"), [(0, Some(0)), (1, Some(1)), (2, Some(0))]);
    assert_eq!(log.published("plain"), [1, 0]);
    // Memory is shown as it is.
    assert_eq!(log.trend("copy"), [(0, Some(0)), (1, Some(1)), (2, Some(0))]);
    assert_eq!(log.published("copy"), [1, 0]);
    log.mode(Mode::Run);
    log.call(EngineCall::Start { now_ns: 250 * MS });
    log.scan(&[("X1", 0)]);
    assert_eq!(log.trend("coil"), [(0, Some(0)), (1, Some(1)), (3, Some(0))]);
    assert_eq!(log.published("coil"), [1, 0]);
}

/// The last scan itself is driven.
#[test]
fn the_last_scan_of_a_stop_is_driven() {
    let mut log = Log::new();
    log.scan(&[("cabinet.Ok", 1)]);
    log.call(EngineCall::RequestStop);
    log.scan(&[("X1", 1)]);
    log.call(EngineCall::Terminate);
    log.mode(Mode::Stop(StopReason::Operator));
    assert_eq!(log.trend("plain"), [(0, Some(0)), (2, Some(1)), (2, Some(0))]);
    assert_eq!(log.published("plain"), [0, 1, 0]);
}

#[test]
fn the_output_of_a_lost_device_is_unknown() {
    let mut log = in_run();
    log.scan(&[("cabinet.Ok", 0)]);
    assert_eq!(log.output("wired"), Some(OutputState::Unknown(Some(true))));
    assert_eq!(log.output("off"), Some(OutputState::AsMemory), "it has no device");
    assert_eq!(log.trend("wired"), [(0, None), (1, Some(0)), (2, Some(1)), (3, None)]);
    assert_eq!(log.published("wired"), [0, 1, OUTPUT_UNKNOWN]);
    let why = log.view(None).why("wired", None).expect("an answer").text();
    let words =
        "wired (Y3) is ON in memory; its output is not known, last ON: its device is lost\n";
    assert!(why.starts_with(words), "{why}");
    log.scan(&[("cabinet.Ok", 1)]);
    assert_eq!(log.output("wired"), Some(OutputState::AsMemory));
    assert_eq!(log.published("wired"), [0, 1, OUTPUT_UNKNOWN, 1]);
}

#[test]
fn the_present_outputs_of_the_controller_override_the_log() {
    let log = in_run();
    let lost = UnknownOutput { device: "cabinet".to_owned(), last: Some(false) };
    let unix_ns = 60_000_000_000;
    let present = PresentOutputs {
        mode: "FAULT".to_owned(),
        reason: None,
        unix_ns,
        on: Some(vec![1]),
        unknown: vec![(3, lost)],
    };
    // A scan hangs: the log still says RUN.
    let view = log.view(Some(present));
    let output = |operand| view.output(&view.power, log.cell(operand));
    assert_eq!(output("off"), Some(OutputState::Safe(false)));
    assert_eq!(output("on"), Some(OutputState::Safe(true)));
    assert_eq!(output("wired"), Some(OutputState::Unknown(Some(false))));
    assert!(!view.executes(&view.power));
    let trend = view.trend("off").expect("an operand");
    assert_eq!(trend.points.last().map(|point| point.value), Some(Some(0)));
    assert_eq!(trend.span_ns, Some((100_000_000, 10_200_000_000)), "the last value is seen");
    let why = view.why("wired", None).expect("an answer").text();
    assert!(why.contains("its output is not known, last OFF: its device is lost"), "{why}");
}

/// The end of RUN belongs to the scan before it, even if a section begins with it.
#[test]
fn a_change_at_the_start_of_a_section_has_the_time_of_the_last_scan() {
    let mut log = in_run();
    let before = Arc::new(log.section.clone());
    let start = SectionStart { number: 3, follows: true, ..before.start };
    let (state, entries) = (EngineState::of(&log.engine), Vec::new());
    log.section = TapeSection { start, state, entries, who: Vec::new() };
    log.call(EngineCall::Terminate);
    let running = log.cell("Main.Running");
    let sections = [before, Arc::new(log.section.clone())];
    let changes = log.program.subject.changes(&sections, &[running]);
    let seen: Vec<_> = changes.iter().map(|of| (of.scan, of.unix_ns, of.after)).collect();
    let ms = MS as i64;
    assert_eq!(seen, [(0, 100 * ms, 1), (2, 200 * ms, 0)]);
}
