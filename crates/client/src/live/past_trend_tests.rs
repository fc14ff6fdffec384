//! The values of an operand over a recorded past: every change once, stops and unrecorded times as
//! gaps, of an output what it was driven to. The past is recorded in virtual time.

use std::sync::Arc;

use expect_test::expect;

use super::{LiveProgram, PastGap, PastPiece, TagValue, TrendPast};
use rungd_engine::isa::Real;
use rungd_engine::{Engine, EngineState, ScanTimes};
use rungd_history::record::{
    Recent, RecordedFile, RecordedProgram, Recorder, Recording, TapeClock,
};
use rungd_runtime::exchange::{Mode, StopReason};
use rungd_runtime::{ScanStart, ScannedMachine, TapeReader, Taped, tape};

const CONTROLLER: &str = "ladder = [\"l.toml\"]\n[outputs]\non = [\"Y1\"]\n";

const LADDER: &str = r#"
[ladder]
name = "tank"
[tags]
full = { at = "X0" }
lamp = { at = "Y1" }
horn = { at = "Y2" }
level = { at = "D0" }
ratio = { at = "R0" }
[[program]]
name = "Main"
rung = [{ when = ["full"], do = ["OUT lamp", "OUT horn"] }]
"#;

/// The wall clock at monotonic time 0.
const UNIX_NS: i64 = 1_700_000_000_000_000_000;

/// A time in seconds, as ns since 1970.
fn at(seconds: f64) -> i64 {
    UNIX_NS + (seconds * 1e9) as i64
}

fn recorded(ladder: &str) -> RecordedProgram {
    let file = |name: &str, text: &str| RecordedFile { name: name.into(), text: text.into() };
    let files = vec![file("c.toml", CONTROLLER), file("l.toml", ladder)];
    RecordedProgram { process_start_ns: UNIX_NS, files, ..RecordedProgram::default() }
}

/// A controller with its scan log. A scan every 100 ms.
struct RecordedPlant {
    program: LiveProgram,
    taped: Taped,
    reader: TapeReader,
    recorder: Recorder,
    recent: Recent,
    now_ns: u64,
    scans: u64,
}

impl RecordedPlant {
    /// A controller in RUN at 0 s. `written`: the ladder that its scan log names.
    fn new(written: &str) -> RecordedPlant {
        let program = LiveProgram::of(Arc::new(recorded(LADDER))).expect("it loads");
        let (mut taped, reader) = tape(Engine::new(program.subject.whole_code()));
        taped.start(0);
        taped.enters(Mode::Run);
        taped.settle();
        let (recorder, recent) = (Recorder::new(recorded(written)), Recent::new(1 << 20));
        RecordedPlant { program, taped, reader, recorder, recent, now_ns: 0, scans: 0 }
    }

    /// Scans, in the first of which an operand gets a value, and the end of a section.
    fn scans(&mut self, count: u64, operand: &str, value: i32) {
        for scan in 0..count {
            self.now_ns += 100_000_000;
            self.scans += 1;
            let (number, now_ns) = (self.scans, self.now_ns);
            let start = ScanStart { number, now_ns, times: ScanTimes::default(), local_s: 0 };
            ScannedMachine::begin_scan(&mut self.taped, &start);
            if scan == 0 {
                self.taped.write(self.program.subject.cell(operand).expect("it has it"), value);
            }
            self.taped.execute();
            self.taped.settle();
        }
        self.ends_section();
    }

    fn ends_section(&mut self) {
        let unix_ns = UNIX_NS + self.now_ns as i64;
        let clock = TapeClock { unix_ns, unix_offset_ns: UNIX_NS };
        while let Some((entry, state)) = self.reader.take() {
            let block = self.recorder.take(entry, state.as_deref(), clock);
            block.iter().for_each(|block| self.recent.put(block));
            state.into_iter().for_each(|state| self.reader.give_back(state));
        }
        self.recorder.flush(clock).iter().for_each(|block| self.recent.put(block));
    }

    /// A stop of so many seconds, in which an operand gets a value every second.
    fn stops(&mut self, seconds: u64, operand: &str) {
        self.taped.terminate();
        self.taped.enters(Mode::Stop(StopReason::Operator));
        self.taped.settle();
        for second in 0..seconds {
            self.taped.write(self.program.subject.cell(operand).expect("it has it"), 7);
            self.taped.settle();
            self.now_ns += 1_000_000_000;
            if second + 1 < seconds {
                self.ends_section();
            }
        }
        self.taped.start(self.now_ns);
        self.taped.enters(Mode::Run);
        self.taped.settle();
    }

    /// Scans that the scan log does not get.
    fn loses(&mut self, scans: u64) {
        self.now_ns += scans * 100_000_000;
        self.scans += scans;
        let steps = rungd_runtime::TapeEntry::Lost { steps: scans };
        let unix_ns = UNIX_NS + self.now_ns as i64;
        let clock = TapeClock { unix_ns, unix_offset_ns: UNIX_NS };
        self.recorder.take(steps, None, clock);
        let state = EngineState::of(self.taped.engine());
        let (number, mode) = (self.scans + 1, Mode::Run);
        let entry = rungd_runtime::TapeEntry::State { generation: 0, number, mode };
        self.recorder.take(entry, Some(&state), clock);
    }

    fn past(&self) -> TrendPast {
        TrendPast::new(Recording::of_bytes(self.recent.write()))
    }
}

/// A piece as text: `0.1=5 0.6=?`, then its gaps: `0.0..0.1 (not recorded)`.
fn text(piece: &PastPiece) -> String {
    let s = |ns: i64| format!("{:.1}", (ns - UNIX_NS) as f64 / 1e9);
    let value = |value: Option<TagValue>| match value {
        Some(TagValue::Bit(on)) => u8::from(on).to_string(),
        Some(TagValue::Integer(value)) => value.to_string(),
        Some(TagValue::Real(value)) => format!("{value:?}"),
        None => "?".to_owned(),
    };
    let values = piece.values.iter().map(|at| format!("{}={}", s(at.unix_ns), value(at.value)));
    let gap = |PastGap { from_ns, to_ns, mode }: &PastGap| {
        format!("{}..{} ({})", s(*from_ns), s(*to_ns), mode.unwrap_or("not recorded"))
    };
    values.chain(piece.gaps.iter().map(gap)).collect::<Vec<_>>().join(", ")
}

fn piece(plant: &RecordedPlant, operand: &str, from: f64, to: f64) -> String {
    text(&plant.past().piece(operand, at(from), at(to)))
}

#[test]
fn every_change_is_told_once_with_its_time_over_all_sections() {
    let mut plant = RecordedPlant::new(LADDER);
    plant.scans(10, "level", 5);
    plant.scans(10, "level", 5);
    plant.scans(10, "level", -3);
    assert_eq!(plant.past().end_ns(), Some(at(3.0)));
    expect!["0.1=0, 0.1=5, 2.1=-3"].assert_eq(&piece(&plant, "level", 0.1, 3.0));
    expect!["0.1=0"].assert_eq(&piece(&plant, "lamp", 0.1, 3.0));
    let mut past = plant.past();
    assert_eq!(past.piece("level", at(0.1), at(3.0)), past.piece("level", at(0.1), at(3.0)));
    // A part of it begins with the value that stands there.
    expect!["1.0=5"].assert_eq(&piece(&plant, "level", 1.5, 1.8));
}

#[test]
fn what_lies_outside_of_the_recording_is_not_recorded() {
    let mut plant = RecordedPlant::new(LADDER);
    plant.scans(10, "level", 5);
    expect!["0.0=0, 0.1=5, -60.0..0.0 (not recorded), 0.0..0.1 (STOP), 1.0..60.0 (not recorded)"]
        .assert_eq(&piece(&plant, "level", -60.0, 60.0));
    expect!["-60.0..-30.0 (not recorded)"].assert_eq(&piece(&plant, "level", -60.0, -30.0));
    let mut empty = TrendPast::new(Recording::of_bytes(Vec::new()));
    assert_eq!(empty.end_ns(), None);
    expect!["0.0..1.0 (not recorded)"].assert_eq(&text(&empty.piece("level", at(0.0), at(1.0))));
}

#[test]
fn lost_scans_are_a_gap_between_two_values() {
    let mut plant = RecordedPlant::new(LADDER);
    plant.scans(10, "level", 5);
    plant.loses(20);
    plant.scans(10, "level", 8);
    expect!["0.1=0, 0.1=5, 1.0=5, 3.1=8, 1.0..3.1 (not recorded)"]
        .assert_eq(&piece(&plant, "level", 0.1, 4.0));
}

#[test]
fn a_stop_over_several_sections_is_one_gap_and_an_output_has_its_safe_value() {
    let mut plant = RecordedPlant::new(LADDER);
    plant.scans(10, "full", 1);
    plant.stops(5, "level");
    plant.scans(10, "level", 8);
    expect!["0.1=0, 6.1=8, 1.0..6.1 (STOP)"].assert_eq(&piece(&plant, "level", 0.1, 7.0));
    expect!["0.1=0, 0.1=1, 1.0=0, 6.1=1"].assert_eq(&piece(&plant, "horn", 0.1, 7.0));
}

#[test]
fn what_this_version_cannot_load_and_what_the_program_did_not_have_is_not_recorded() {
    let mut plant =
        RecordedPlant::new("[[program]]\nname = \"Main\"\nrung = [{ do = [\"NEW Y0\"] }]\n");
    plant.scans(10, "level", 5);
    expect!["0.1..1.0 (not recorded)"].assert_eq(&piece(&plant, "level", 0.1, 1.0));
    let mut plant = RecordedPlant::new(LADDER);
    plant.scans(10, "level", 5);
    expect!["0.1..1.0 (not recorded)"].assert_eq(&piece(&plant, "weight", 0.1, 1.0));
}

#[test]
fn a_real_and_a_bit_have_their_values() {
    let mut plant = RecordedPlant::new(LADDER);
    plant.scans(10, "ratio", Real::stored(-0.5).real.cell());
    plant.scans(10, "full", 1);
    expect!["0.1=0.0, 0.1=-0.5"].assert_eq(&piece(&plant, "ratio", 0.1, 2.0));
    expect!["0.1=0, 1.1=1"].assert_eq(&piece(&plant, "full", 0.1, 2.0));
}
