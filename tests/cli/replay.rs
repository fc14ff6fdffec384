//! `rungd replay` as a user runs it, on recordings made by the tape and the recorder of the
//! controller; and the page about it.

use rungd_config::load::recorded_files;
use rungd_engine::{BitCell, Cell, Engine, ScanTimes, WordCell};
use rungd_history::record::{
    Recent, RecordBlock, RecordedFile, RecordedProgram, Recorder, Recording, TapeClock,
};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;
use rungd_language::resolve::scope::Scope;
use rungd_language::source::span::SourceFile;
use rungd_runtime::exchange::{Mode, StopReason};
use rungd_runtime::{ImageCells, ScanStart, ScannedMachine, TapeReader, Taped, tape};
use rungd_state::reload::{LoweredProgram, ReloadPlan};
use rungd_test_support::model::generate::generate;
use rungd_test_support::shown::lines_match;
use std::path::PathBuf;
use std::process::{Command, Output};

/// 2026-11-22 10:00:00 UTC.
const BEGIN_NS: i64 = 1_795_341_600_000_000_000;
const PERIOD_NS: u64 = 10_000_000;

const CONVEYOR: &str = r#"[tags]
part   = { at = "X0" }
feeder = { at = "Y0" }
jam    = { at = "C0", alarm = "a part stays in front of the eye" }
wait   = { at = "T0" }
parts  = { at = "CT0" }

[[program]]
name = "Main"
rung = [
  { when = ["part"], do = ["ONDTMR wait preset=2s output=jam"] },
  { when = ["!jam"], do = ["OUT feeder"] },
  { leg.up = ["part"], leg.rst = ["$Off"], do = ["CNT parts preset=9"] },
]
"#;

/// A recorded controller.
pub struct Line {
    taped: Taped,
    reader: TapeReader,
    recorder: Recorder,
    pub blocks: Vec<RecordBlock>,
    symbols: Symbols,
    scope: Scope,
    now_ns: u64,
    number: u64,
    /// The time between two scans.
    pub period_ns: u64,
}

/// A program as it is recorded, with its engine.
fn recorded(ladder: &str, generation: u32) -> (RecordedProgram, Program) {
    recorded_with("", ladder, generation)
}

/// The same with more keys of its controller file.
fn recorded_with(keys: &str, ladder: &str, generation: u32) -> (RecordedProgram, Program) {
    let file = |name: &str, text: &str| (name.to_owned(), text.to_owned());
    let controller = format!("ladder = [\"main.toml\"]\n{keys}");
    let all = [file("plant.toml", &controller), file("main.toml", ladder)];
    let files = all.clone().map(|(name, text)| RecordedFile { name, text: text.into() }).to_vec();
    let loaded = recorded_files(&all.map(|(name, text)| SourceFile { name, text }));
    let program = loaded.program.unwrap_or_else(|| panic!("{:?}", loaded.findings));
    let recorded = RecordedProgram {
        version: env!("CARGO_PKG_VERSION").into(),
        process_start_ns: BEGIN_NS,
        generation,
        source: "start".into(),
        hash: "00ff".into(),
        files,
    };
    (recorded, program)
}

impl Line {
    pub fn new(ladder: &str) -> Line {
        Line::with_keys("", ladder)
    }

    /// A controller whose file has more keys.
    pub fn with_keys(keys: &str, ladder: &str) -> Line {
        let (recorded, program) = recorded_with(keys, ladder, 0);
        let (engine, symbols) = lower(&program);
        let (taped, reader) = tape(Engine::new(engine));
        let (recorder, blocks) = (Recorder::new(recorded), Vec::new());
        let scope = Scope::of(&program);
        let mut line = Line {
            taped,
            reader,
            recorder,
            blocks,
            symbols,
            scope,
            now_ns: 0,
            number: 1,
            period_ns: PERIOD_NS,
        };
        line.taped.start(line.now_ns);
        line.taped.enters(Mode::Run);
        line.taped.settle();
        line
    }

    /// Exchanges the program for one of the same cells.
    pub fn reload(&mut self, old: &str, new: &str, generation: u32) {
        self.read();
        let (recorded, program) = recorded(new, generation);
        let before = lower(&self::recorded(old, 0).1);
        let (engine, symbols) = lower(&program);
        let plan = ReloadPlan::new(
            LoweredProgram { program: &before.0, symbols: &before.1 },
            LoweredProgram { program: &engine, symbols: &symbols },
        );
        let mut taped = Taped::new(Engine::new(engine)).with_spares();
        taped.adopt(&mut self.taped, &plan.transfer, true, &[]);
        taped.swapped(generation);
        taped.settle();
        (self.taped, self.symbols, self.scope) = (taped, symbols, Scope::of(&program));
        self.recorder.program(recorded);
    }

    fn clock(&self) -> TapeClock {
        TapeClock { unix_ns: BEGIN_NS + self.now_ns as i64, unix_offset_ns: BEGIN_NS }
    }

    pub fn cell(&self, name: &str) -> Cell {
        self.symbols.layout.cell(self.scope.address(name).unwrap()).unwrap()
    }

    /// Makes a scan with these writes, by the operands' names.
    pub fn scan(&mut self, writes: &[(&str, i32)]) -> bool {
        let times = ScanTimes { mean_us: 300, min_us: 290, max_us: 320, last_us: 310 };
        let local_s = BEGIN_NS / 1_000_000_000 + (self.now_ns / 1_000_000_000) as i64;
        let start = ScanStart { number: self.number, now_ns: self.now_ns, times, local_s };
        ScannedMachine::begin_scan(&mut self.taped, &start);
        for (name, value) in writes {
            let cell = self.cell(name);
            self.taped.write(cell, *value);
        }
        let last = self.taped.execute();
        self.taped.settle();
        self.now_ns += self.period_ns;
        self.number += 1;
        self.read();
        last
    }

    fn read(&mut self) {
        while let Some((entry, state)) = self.reader.take() {
            self.blocks.extend(self.recorder.take(entry, state.as_deref(), self.clock()));
            state.into_iter().for_each(|state| self.reader.give_back(state));
        }
    }

    pub fn bytes(&mut self) -> Vec<u8> {
        self.read();
        self.blocks.extend(self.recorder.flush(self.clock()));
        let mut recent = Recent::new(1 << 26);
        self.blocks.iter().for_each(|block| recent.put(block));
        recent.write()
    }
}

/// Twenty seconds of a conveyor: some parts are in front of the eye for half a second, one at 6 s
/// for 1.5 s, and one at 10 s for 3 s.
pub fn conveyor() -> Line {
    let mut line = Line::new(CONVEYOR);
    for scan in 0..2_000 {
        let is_there = |from: i32, to: i32| (from..to).contains(&scan);
        let part = is_there(200, 250)
            || is_there(400, 450)
            || is_there(600, 750)
            || is_there(1_000, 1_300)
            || is_there(1_800, 1_850);
        line.scan(&[("X0", i32::from(part))]);
    }
    line
}

/// A folder of this test's own.
pub struct Place(pub PathBuf);

impl Place {
    pub fn new(test: &str) -> Place {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("replay_cli").join(test);
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let place = Place(folder);
        place.write("new.toml", CONVEYOR.replace("2s", "1s").as_bytes());
        place.write("plant.rungd-log", &conveyor().bytes());
        place
    }

    pub fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.0.join(name), bytes).unwrap();
    }

    pub fn remove(&self, name: &str) {
        let _ = std::fs::remove_file(self.0.join(name));
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join(name)).unwrap()
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.rungd(&[&["replay"], arguments].concat())
    }

    pub fn rungd(&self, words: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
        command.current_dir(&self.0).env("TZ", "UTC0").env("NO_COLOR", "1");
        command.args(words).output().unwrap()
    }

    /// Standard output and standard error of a replay that ends with a code.
    #[track_caller]
    fn replay(&self, code: i32, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        assert_eq!(output.status.code(), Some(code), "{}", said.concat());
        said.concat()
    }
}

#[track_caller]
pub fn shown(text: &str, shown: &str) {
    let (shown, lines): (Vec<&str>, Vec<&str>) = (shown.lines().collect(), text.lines().collect());
    assert!(lines_match(&shown, &lines), "{text}");
}

#[test]
fn a_replay_verifies_all_hashes_and_lists_the_alarms() {
    let place = Place::new("proof");
    shown(
        &place.replay(0, &["plant.rungd-log"]),
        "alarm jam on at 2026-11-22 10:00:12.000 (scan 1201) for 1.000 s: a part stays in front of the eye\n\
         2,000 scans replayed in … s, … × real time; … of … hashes equal\n",
    );
    // A folder counts as one recording too.
    let folder = place.replay(0, &["."]);
    assert!(folder.contains("2,000 scans"), "{folder}");
}

#[test]
fn a_replay_lists_alarms_after_their_delays_as_the_controller_does() {
    let place = Place::new("delays");
    let mut line = Line::new(
        "[tags]\neye = { at = \"X0\", alarm = \"An eye\", delay = \"100ms\", off-delay = \"50ms\" }\n\
         [[program]]\nname = \"Main\"\nrung = [{ when = [\"eye\"], do = [\"OUT Y0\"] }]\n",
    );
    for scan in 0..200 {
        let is_there = (10..15).contains(&scan) || (100..150).contains(&scan) && scan != 130;
        line.scan(&[("X0", i32::from(is_there))]);
    }
    place.write("plant.rungd-log", &line.bytes());
    shown(
        &place.replay(0, &["plant.rungd-log"]),
        "alarm eye on at 2026-11-22 10:00:01.100 (scan 101) for 0.450 s: An eye\n\
         200 scans replayed in … s, … × real time; … of … hashes equal\n",
    );
}

#[test]
fn a_wrong_hash_gives_exit_code_1_and_its_place() {
    let place = Place::new("differs");
    let mut line = conveyor();
    line.bytes();
    line.blocks[7].head.end_hash = Some([7; 16]);
    place.write("plant.rungd-log", &line.bytes());
    let said = place.replay(1, &["plant.rungd-log"]);
    let count = line.blocks.len();
    let (count, equal) = (count - 1, count - 2);
    assert!(said.contains(&format!("; {equal} of {count} hashes equal")), "{said}");
    assert!(
        said.contains(
            "the first difference is in 2026-11-22 10:00:06.010 to 10:00:07.000 (scan 602 and"
        ),
        "{said}"
    );
}

#[test]
fn a_gap_of_the_recording_is_reported() {
    let place = Place::new("gap");
    let mut line = conveyor();
    line.bytes();
    line.blocks.remove(5);
    let mut recent = Recent::new(1 << 26);
    line.blocks.iter().for_each(|block| recent.put(block));
    place.write("plant.rungd-log", &recent.write());
    let said = place.replay(0, &["plant.rungd-log"]);
    assert!(said.contains("; 1 gap at 2026-11-22 10:00:0"), "{said}");
    let said = place.replay(0, &["plant.rungd-log", "--ladder", "new.toml"]);
    assert!(said.contains("the recording has gaps (1): after each"), "{said}");
}

#[test]
fn a_span_between_two_times_can_be_traced() {
    let place = Place::new("window");
    let rows = |arguments: &[&str]| {
        let all = [&["plant.rungd-log", "--watch", "part,wait.Acc,feeder"], arguments].concat();
        let output = place.run(&all);
        assert_eq!(output.status.code(), Some(0));
        assert!(String::from_utf8(output.stderr).unwrap().contains("hashes equal"));
        let text = String::from_utf8(output.stdout).unwrap();
        let mut lines = text.lines().map(str::to_owned);
        assert_eq!(lines.next().unwrap(), "scan,time_ms,part,wait.Acc,feeder");
        lines.collect::<Vec<_>>()
    };
    assert_eq!(rows(&[]).len(), 2_000);
    let middle = rows(&["--from", "10:00:11.99", "--to", "scan 1202"]);
    assert_eq!(middle, ["1200,0,1,1990,1", "1201,10,1,2000,0", "1202,20,1,2010,0"]);
    assert_eq!(rows(&["--from=-100ms"]).len(), 11);
    assert_eq!(rows(&["--to", "10:00:00.02"]).len(), 3);
    let said = place.replay(1, &["plant.rungd-log", "--from", "2026-11-23T10:00:00"]);
    let span = "it is of 2026-11-22 10:00:00.000 to 2026-11-22 10:00:19.990";
    assert!(said.contains(span), "{said}");
    let said = place.replay(1, &["plant.rungd-log", "--from", "scan 9", "--to", "scan 8"]);
    assert!(said.contains("the end of this part lies before its beginning"), "{said}");
    let said = place.replay(2, &["plant.rungd-log", "--from", "soon"]);
    assert!(said.contains("`soon` is not a time: write it as 10:02"), "{said}");
}

#[test]
fn a_trace_can_be_written_in_every_file_format() {
    let place = Place::new("forms");
    for (name, begins) in [("a.csv", "scan,time_ms,"), ("a.svg", "<svg "), ("a.vcd", "$version ")] {
        let said = place.replay(0, &["plant.rungd-log", "--trace", name]);
        assert!(said.contains("hashes equal"), "{said}");
        assert!(place.read(name).starts_with(begins), "{name}");
    }
    let said = place.replay(2, &["plant.rungd-log", "--trace", "a.png"]);
    assert!(said.contains("the ending must be"), "{said}");
    std::fs::copy(place.0.join("plant.rungd-log"), place.0.join("plant.csv")).unwrap();
    let said = place.replay(2, &["plant.csv", "--trace", "plant.csv"]);
    assert!(said.contains("would overwrite plant.csv"), "{said}");
    place.replay(74, &["nothing.rungd-log"]);
    place.write("empty.rungd-log", b"");
    assert!(place.replay(1, &["empty.rungd-log"]).contains("the recording is empty"));
}

#[test]
fn a_new_ladder_is_compared_with_the_recorded_one() {
    let place = Place::new("ladder");
    let arguments = ["plant.rungd-log", "--ladder", "new.toml", "--watch", "parts.Acc,wait.Done"];
    shown(
        &place.replay(0, &arguments),
        "feeder (Y0): old ON, new OFF first at 2026-11-22 10:00:07.000 (scan 701); 2 times, 1.500 \
         s and 150 scans in all\nalarm jam: old OFF, new ON first at 2026-11-22 10:00:07.000 (scan \
         701); 2 times, 1.500 s and 150 scans in all\nwait.Done: old OFF, new ON first at \
         2026-11-22 10:00:07.000 (scan 701); 2 times, 1.500 s and 150 scans in all\n1 of 1 output, \
         1 of 1 alarm, 1 of 2 watched operands differ\n…\n\x20       jam (C0) is ON\n…\n2,000 \
         scans replayed in … s, … × real time; … of … hashes of the old program equal\nopen loop: \
         the inputs are the recorded ones; the reaction of the plant to different outputs is not \
         simulated\n",
    );
    place.replay(0, &[&arguments[..3], &["--trace", "both.csv", "--from", "scan 701"]].concat());
    let csv = place.read("both.csv");
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("scan,time_ms,feeder@old,feeder@new,jam@old,jam@new"));
    assert_eq!(lines.next(), Some("701,0,1,0,0,1"));
    place.replay(0, &[&arguments[..3], &["--trace", "both.svg"]].concat());
    let svg = place.read("both.svg");
    assert!(svg.find(">feeder@old<") < svg.find(">feeder@new<"));
}

#[test]
fn the_same_ladder_shows_no_difference() {
    let place = Place::new("same");
    place.write("same.toml", CONVEYOR.as_bytes());
    for from in ["scan 1", "scan 1150", "scan 1250"] {
        let said = place.replay(0, &["plant.rungd-log", "--ladder", "same.toml", "--from", from]);
        assert!(said.contains("0 of 1 output, 0 of 1 alarm differ"), "{said}");
    }
}

#[test]
fn recorded_writes_reach_a_moved_tag_of_the_new_ladder() {
    let place = Place::new("moved");
    let ladder = |tags: &str| {
        format!(
            "[tags]\n{tags}x = {{ type = \"bit\" }}\nlevel = {{ type = \"int\" }}\n\
             lamp = {{ at = \"Y0\" }}\n[[program]]\nname = \"Main\"\nrung = [\n\
             {{ when = [\"x\", \"level > 5\"], do = [\"OUT lamp\"] }},\n]\n"
        )
    };
    let mut line = Line::new(&ladder(""));
    for scan in 0..300 {
        match scan {
            100 => line.scan(&[("x", 1), ("level", 7)]),
            200 => line.scan(&[("level", 3)]),
            _ => line.scan(&[]),
        };
    }
    place.write("moved.rungd-log", &line.bytes());
    place
        .write("moved.toml", ladder("a = { type = \"bit\" }\nb = { type = \"int\" }\n").as_bytes());
    let arguments =
        ["moved.rungd-log", "--ladder", "moved.toml", "--watch", "x,level", "--trace", "t.csv"];
    let said = place.replay(0, &arguments);
    assert!(said.contains("0 of 1 output, 0 of 2 watched operands differ"), "{said}");
    let csv = place.read("t.csv");
    assert!(csv.contains("\n101,1000,1,1,7,7\n") && csv.contains("\n201,2000,1,1,3,3\n"), "{csv}");
}

#[test]
fn a_new_ladder_with_a_mistake_is_refused_with_its_finding() {
    let place = Place::new("mistake");
    place.write("new.toml", CONVEYOR.replace("OUT feeder", "OUT feder").as_bytes());
    let said = place.replay(78, &["plant.rungd-log", "--ladder", "new.toml"]);
    assert!(said.contains("feder") && said.contains("new.toml:"), "{said}");
    place.write("good.toml", CONVEYOR.as_bytes());
    let said = place.replay(74, &["plant.rungd-log", "--ladder", "none.toml"]);
    assert!(said.contains("none.toml"), "{said}");
    let said = place.replay(2, &["plant.rungd-log", "--ladder", "good.toml", "--watch", "nothing"]);
    assert!(said.contains("neither program has a bit or word `nothing`"), "{said}");
}

#[test]
fn a_new_ladder_that_stops_itself_is_reported() {
    let place = Place::new("stops");
    let stops =
        CONVEYOR.replace("rung = [\n", "rung = [\n  { when = [\"jam\"], do = [\"STOP\"] },\n");
    place.write("new.toml", stops.as_bytes());
    let said = place.replay(0, &["plant.rungd-log", "--ladder", "new.toml"]);
    assert!(said.contains("the new program stops itself at 2026-11-22 10:00:12.0"), "{said}");
    assert!(said.contains("nothing is compared after it"), "{said}");
}

#[test]
fn random_programs_replay_without_differences() {
    let place = Place::new("random");
    for seed in 1..=4 {
        let case = generate(seed);
        let mut line = Line::new(&case.ladder());
        let (bits, words) = {
            let ImageCells { bits, words } = ScannedMachine::image(&line.taped);
            (bits.len() as u64, words.len() as u64)
        };
        for scan in 0..150 {
            let number = (seed * 1_000_003 + scan).wrapping_mul(6_364_136_223_846_793_005) >> 33;
            let inputs = [("X0", number & 1), ("X1", number >> 1 & 1), ("X2", number >> 2 & 1)];
            let writes = inputs.map(|(name, on)| (name, on as i32));
            if scan % 50 == 20 {
                let (bit, word) = ((number % bits) as u32, (number % words) as u32);
                ScannedMachine::force(&mut line.taped, Cell::Bit(BitCell(bit)), 1);
                ScannedMachine::force(&mut line.taped, Cell::Word(WordCell(word)), 3);
            }
            if scan % 50 == 40 {
                let number =
                    (seed * 1_000_003 + scan - 20).wrapping_mul(6_364_136_223_846_793_005) >> 33;
                ScannedMachine::release(
                    &mut line.taped,
                    Cell::Bit(BitCell((number % bits) as u32)),
                );
            }
            if line.scan(&writes) {
                line.taped.terminate();
                line.taped.enters(Mode::Stop(StopReason::Instruction));
                line.taped.settle();
                break;
            }
        }
        let recording = line.bytes();
        assert!(Recording::of_bytes(recording.clone()).count() > 0);
        place.write("random.rungd-log", &recording);
        place.write("random.toml", case.ladder().as_bytes());
        let said = place.replay(0, &["random.rungd-log"]);
        assert!(!said.contains("difference"), "seed {seed}: {said}");
        let said = place.replay(0, &["random.rungd-log", "--ladder", "random.toml"]);
        let differs = said.lines().any(|line| line.contains(" first at "));
        assert!(!differs, "seed {seed}: {said}");
    }
}

/// The commands of `docs/replay.md`, in a folder with the recording of that page.
#[test]
fn the_commands_of_the_replay_page_print_what_the_page_shows() {
    let place = Place::new("page");
    let page = include_str!("../../docs/replay.md");
    let mut commands = 0;
    for block in page.split("```console\n").skip(1) {
        let block = block.split("```").next().unwrap();
        for part in block.split("$ rungd replay ").skip(1) {
            let (command, output) = part.split_once('\n').unwrap();
            let command = command.replace('"', "");
            let arguments: Vec<&str> = command.split_whitespace().collect();
            shown(&place.replay(0, &arguments), output);
            commands += 1;
        }
    }
    assert!(commands >= 3);
}
