//! What was recorded is executed again: every image of every scan, and every state's hash, is as it
//! was. Random ladders of the reference model's generator, with forces, writes, stops and starts.
//!
//! `RUNGD_RECORD_PROGRAMS` (25) of them from `RUNGD_RECORD_SEED` (1) on.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::ControlFlow;

use crate::drawn::Numbers;
use crate::support::model::clock;
use crate::support::model::generate::generate;
use crate::support::run::{load, target};
use rungd::calendar::parse_seconds;
use rungd::engine::{BitCell, Cell, Engine, EngineCall, EngineState, ScanTimes, WordCell};
use rungd::lower::lower;
use rungd::record::{
    Recent, RecordBlock, RecordedFile, RecordedProgram, Recorder, Recording, Replay, SegmentStart,
    TapeClock,
};
use rungd::reload::{ReloadPlan, Side};
use rungd::runtime::command::CommandId;
use rungd::runtime::exchange::{Mode, StopReason, Ticket};
use rungd::runtime::{Machine, Origin, ScanStart, TapeEntry, TapeReader, Taped, tape};
use rungd::sim::stimulus::{Change, Stimulus};

const UNIX_NS: i64 = 1_700_000_000_000_000_000;

fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// A program of one ladder.
pub fn recorded(ladder: &str, generation: u32) -> RecordedProgram {
    let file = RecordedFile { name: "main.toml".into(), text: ladder.into() };
    RecordedProgram {
        version: "0.1.0".into(),
        process_start_ns: UNIX_NS,
        generation,
        source: "start".into(),
        hash: "00ff".into(),
        files: vec![file],
    }
}

/// The engine of a recorded ladder.
pub fn engine(program: &RecordedProgram) -> Result<Engine, String> {
    load(&program.files[0].text).map(|program| Engine::new(lower(&program).0))
}

/// The hash of bits and words.
fn hashed(image: (&[u8], &[i32])) -> u64 {
    let mut hasher = DefaultHasher::new();
    image.hash(&mut hasher);
    hasher.finish()
}

/// A scan thread and its recorder.
pub struct Line {
    pub taped: Taped,
    pub reader: TapeReader,
    pub recorder: Recorder,
    pub blocks: Vec<RecordBlock>,
    /// All entries of the tape but its states.
    pub entries: Vec<TapeEntry>,
    /// The hash of the image behind each scan, with the scan's number.
    pub images: Vec<(u64, u64)>,
    pub keeps_images: bool,
    pub now_ns: u64,
    number: u64,
    ladder: String,
}

impl Line {
    pub fn new(ladder: &str) -> Line {
        let program = recorded(ladder, 0);
        let engine = engine(&program).unwrap_or_else(|error| panic!("{error}"));
        let (taped, reader) = tape(engine);
        Line {
            taped,
            reader,
            recorder: Recorder::new(program),
            blocks: Vec::new(),
            entries: Vec::new(),
            images: Vec::new(),
            keeps_images: true,
            now_ns: 5_000_000_000,
            number: 0,
            ladder: ladder.into(),
        }
    }

    pub fn clock(&self) -> TapeClock {
        let unix_offset_ns = UNIX_NS;
        TapeClock { unix_ns: UNIX_NS + self.now_ns as i64, unix_offset_ns }
    }

    /// Reads the tape to its end.
    pub fn read(&mut self) {
        while let Some((entry, state)) = self.reader.next() {
            if !matches!(entry, TapeEntry::State { .. } | TapeEntry::Lost { .. }) {
                self.entries.push(entry);
            }
            self.blocks.extend(self.recorder.take(entry, state.as_deref(), self.clock()));
            state.into_iter().for_each(|state| self.reader.give_back(state));
        }
    }

    pub fn flush(&mut self) {
        self.read();
        self.blocks.extend(self.recorder.flush(self.clock()));
    }

    pub fn start(&mut self) {
        self.taped.start(self.now_ns);
        self.taped.enters(Mode::Run);
        self.taped.settle();
    }

    pub fn scan(&mut self, period_ns: u64, come_in: impl FnOnce(&mut Taped)) -> bool {
        self.now_ns += period_ns;
        let times = ScanTimes { mean_us: 300, min_us: 290, max_us: 320, last_us: 310 };
        let local_s = (self.now_ns / 1_000_000_000) as i64 + 7200;
        let start = ScanStart { number: self.number, now_ns: self.now_ns, times, local_s };
        Machine::begin_scan(&mut self.taped, &start);
        come_in(&mut self.taped);
        let last = self.taped.execute();
        if self.keeps_images {
            self.images.push((self.number, hashed(Machine::image(&self.taped))));
        }
        self.number += 1;
        self.taped.settle();
        last
    }

    /// The program goes on as another one.
    pub fn reload(&mut self, ladder: &str, generation: u32) {
        let loaded = |ladder: &str| lower(&load(ladder).unwrap_or_else(|error| panic!("{error}")));
        let (old, new) = (loaded(&self.ladder), loaded(ladder));
        let plan = ReloadPlan::new(
            Side { program: &old.0, symbols: &old.1 },
            Side { program: &new.0, symbols: &new.1 },
        );
        let mut taped = Taped::new(Engine::new(new.0)).with_spares(4);
        taped.adopt(&mut self.taped, &plan.transfer, true, &[]);
        taped.swapped(generation);
        taped.settle();
        self.taped = taped;
        self.ladder = ladder.into();
        self.recorder.program(recorded(ladder, generation));
    }

    pub fn stop(&mut self) {
        self.taped.terminate();
        self.taped.enters(Mode::Stop(StopReason::Operator));
        self.taped.settle();
    }
}

/// The blocks as a recording on disk: with a base image only where there must be one.
pub fn on_disk(blocks: &[RecordBlock]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut start: Option<(u32, SegmentStart)> = None;
    for (at, block) in blocks.iter().enumerate() {
        let generation = block.program.generation;
        let is_new = start.as_ref().is_none_or(|(of, _)| *of != generation);
        if is_new {
            start = Some((generation, SegmentStart::new(&block.program)));
            out.extend_from_slice(&start.as_ref().unwrap().1.bytes);
        }
        let sum = start.as_ref().unwrap().1.sum;
        block.write(sum, is_new || !block.head.follows || at % 5 == 4, &mut out);
    }
    out
}

pub fn in_memory(blocks: &[RecordBlock]) -> Vec<u8> {
    let mut recent = Recent::new(1 << 26);
    blocks.iter().for_each(|block| recent.put(block));
    recent.write()
}

fn random_line(seed: u64) -> Line {
    let case = generate(seed);
    let ladder = case.ladder();
    let program = load(&ladder).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
    let (_, symbols) = lower(&program);
    let stimulus = Stimulus::parse(&case.stimulus(), &|name| target(&program, &symbols, name));
    let stimulus = stimulus.unwrap_or_else(|e| panic!("seed {seed}: {}", e.message));
    assert!(parse_seconds(&clock::text(case.clock)).is_some());
    let mut numbers = Numbers(seed);
    let mut line = Line::new(&ladder);
    line.start();
    let mut next = 0;
    for scan in 0..case.scans as u64 {
        if numbers.below(20) == 0 {
            line.taped.request_stop();
        }
        if numbers.below(10) == 0 {
            force(&mut line, &mut numbers, scan);
        }
        let period_ns = 1_000_000 + numbers.below(300_000_000);
        let last = line.scan(period_ns, |taped| {
            for change in stimulus.of_scan(scan, &mut next) {
                taped.comes_from(Origin::Batch(Ticket(scan)));
                match change {
                    Change::Input(n, on) => taped.set_input(n, on),
                    Change::Bit(cell, on) => Machine::write_bit(taped, cell, on),
                    Change::Word(cell, value) => Machine::write_word(taped, cell, value),
                }
            }
        });
        if last {
            line.stop();
            line.now_ns += numbers.below(3_000_000_000);
            line.start();
        }
        match numbers.below(12) {
            0 => line.flush(),
            1..6 => line.read(),
            _ => {}
        }
    }
    line.flush();
    line
}

/// Forces or releases a cell, as an operator does.
fn force(line: &mut Line, numbers: &mut Numbers, scan: u64) {
    let (bits, words) = Machine::image(&line.taped);
    let (bits, words) = (bits.len() as u64, words.len() as u64);
    let cell = match numbers.below(2) {
        // The first ones are memory, the last ones the program's own.
        0 => Cell::Bit(BitCell(numbers.below(bits.min(4000)) as u32)),
        _ => Cell::Word(WordCell(numbers.below(words.min(2000)) as u32)),
    };
    line.taped.comes_from(Origin::Command(CommandId(scan + 1)));
    line.recorder.note(Origin::Command(CommandId(scan + 1)), format!("operator {scan}"));
    match numbers.below(3) {
        0 => line.taped.release(cell),
        _ => line.taped.force(cell, numbers.below(2) as i32),
    }
    line.taped.settle();
}

/// Replays a recording whole, and holds it against the run.
fn assert_replays(line: &Line, bytes: Vec<u8>, seed: u64) {
    let recording = Recording::of_bytes(bytes);
    assert_eq!((recording.flaws.len(), recording.count()), (0, line.blocks.len()), "seed {seed}");
    let mut replay = Replay::new(recording, engine);
    let count = replay.recording().count();
    let verified = replay.verify(0..count);
    assert_eq!(verified.first_difference, None, "seed {seed}");
    assert_eq!((verified.gaps, verified.unreplayable), (0, 0), "seed {seed}");
    assert_eq!((verified.scans, verified.sections), (line.images.len() as u64, count as u64));
    let hashes = line.blocks.iter().filter(|block| block.head.end_hash.is_some()).count();
    assert_eq!(verified.compared, hashes as u64);
    let mut images = line.images.iter();
    let visited = replay.scans(0..count, |scan, engine| {
        let image = engine.image();
        let found = (scan.number, hashed((image.bits(), image.words())));
        assert_eq!(Some(&found), images.next(), "seed {seed}: {scan:?}");
        ControlFlow::Continue(())
    });
    visited.unwrap();
    assert!(images.next().is_none());
    let sections = (0..count).map(|at| replay.section(at).unwrap());
    let entries: Vec<_> = sections.flat_map(|section| section.entries).collect();
    assert!(entries == line.entries, "seed {seed}");
}

#[test]
fn random_programs_are_replayed_as_they_ran() {
    let first = setting("RUNGD_RECORD_SEED", 1);
    for seed in first..first + setting("RUNGD_RECORD_PROGRAMS", 25) {
        let line = random_line(seed);
        assert_replays(&line, in_memory(&line.blocks), seed);
        assert_replays(&line, on_disk(&line.blocks), seed);
    }
}

const COUNTER: &str = r#"
[[program]]
name = "Main"
rung = [
  { when = ["$On"], do = ["ADD D0 1 to=D0", "TMRAG T0 preset=1s"] },
  { when = ["X0"], do = ["OUT Y0"] },
]
"#;

#[test]
fn a_section_is_had_from_anywhere_and_is_the_same() {
    let mut line = Line::new(COUNTER);
    line.start();
    for scan in 0..900 {
        line.scan(10_000_000, |taped| taped.set_input(0, scan % 7 < 3));
        line.read();
    }
    line.flush();
    let whole = |bytes| {
        let mut replay = Replay::new(Recording::of_bytes(bytes), engine);
        (0..line.blocks.len()).map(|at| replay.section(at).unwrap()).collect::<Vec<_>>()
    };
    let sections = whole(in_memory(&line.blocks));
    assert!(sections.len() >= 9, "{}", sections.len());
    let disk = on_disk(&line.blocks);
    assert_eq!(sections, whole(disk.clone()));
    for at in (0..sections.len()).rev() {
        let mut replay = Replay::new(Recording::of_bytes(disk.clone()), engine);
        assert_eq!(replay.section(at).unwrap(), sections[at]);
        let state = EngineState::of(replay.engine_at(at).unwrap());
        assert_eq!(state, sections[at].state);
    }
    let recording = Recording::of_bytes(disk);
    for (scan, _) in &line.images {
        let at = recording.place_of_scan(*scan).unwrap();
        let head = recording.head(at);
        assert!((head.number..head.number + u64::from(head.scans)).contains(scan));
        let unix_ns = UNIX_NS + 5_010_000_000 + *scan as i64 * 10_000_000;
        assert_eq!(recording.place_of_time(unix_ns), Some(at), "scan {scan}");
    }
    assert_eq!(recording.place_of_scan(900), None);
    assert_eq!(recording.place_of_time(UNIX_NS - 1), None);
    let mut cut = Vec::new();
    recording.cut(3..6, &mut cut).unwrap();
    let cut = Recording::of_bytes(cut);
    assert_eq!((cut.flaws.len(), cut.head(cut.count() - 1)), (0, recording.head(5)));
    assert!(cut.has_base(0) && cut.head(0).sequence <= 3);
}

#[test]
fn an_entry_that_was_changed_shows_as_the_first_difference() {
    let mut line = Line::new(COUNTER);
    line.start();
    for _ in 0..500 {
        line.scan(10_000_000, |_| {});
        line.read();
    }
    line.flush();
    // A hash that belongs to another state.
    line.blocks[2].head.end_hash = Some([7; 16]);
    let mut replay = Replay::new(Recording::of_bytes(on_disk(&line.blocks)), engine);
    let count = replay.recording().count();
    assert_eq!(replay.verify(0..count).first_difference, Some(2));
}

#[test]
fn a_reload_begins_a_segment_and_goes_on() {
    let ladders = [COUNTER.to_owned(), COUNTER.replace("ADD D0 1", "ADD D0 2")];
    let mut line = Line::new(&ladders[0]);
    line.start();
    for generation in 1..5 {
        for _ in 0..170 {
            line.scan(10_000_000, |_| {});
            line.read();
        }
        line.reload(&ladders[generation as usize % 2], generation);
        if generation % 2 == 0 {
            line.flush();
        }
    }
    (0..170).for_each(|_| assert!(!line.scan(10_000_000, |_| {})));
    line.flush();
    for bytes in [on_disk(&line.blocks), in_memory(&line.blocks)] {
        let mut replay = Replay::new(Recording::of_bytes(bytes), engine);
        let recording = replay.recording();
        let count = recording.count();
        assert!((1..count).all(|at| recording.follows(at)));
        let first = recording.place_of_scan(170).unwrap();
        assert_eq!((recording.program(first).generation, recording.has_base(first)), (1, true));
        let verified = replay.verify(0..count);
        assert_eq!((verified.first_difference, verified.gaps, verified.unreplayable), (None, 0, 0));
        assert_eq!(verified.scans, 850);
        let mut images = line.images.iter();
        let visited = replay.scans(0..count, |scan, engine| {
            let image = engine.image();
            let found = (scan.number, hashed((image.bits(), image.words())));
            assert_eq!(Some(&found), images.next());
            ControlFlow::Continue(())
        });
        visited.unwrap();
        for at in (0..count).rev() {
            let section = replay.section(at).unwrap();
            assert_eq!(section.start.generation, replay.recording().program(at).generation);
        }
        let mut cut = Vec::new();
        replay.recording().cut(1..count, &mut cut).unwrap();
        let cut = Recording::of_bytes(cut);
        assert_eq!(cut.head(cut.count() - 1), replay.recording().head(count - 1));
        assert_eq!(Replay::new(cut, engine).verify(0..count - 1).unreplayable, 0);
    }
}

#[test]
fn a_reload_whose_state_comes_late_makes_a_gap() {
    let mut line = Line::new(COUNTER);
    let state = EngineState::of(line.taped.engine());
    let clock = line.clock();
    line.recorder.program(recorded(COUNTER, 1));
    let at = |generation, number| TapeEntry::State { generation, number, mode: Mode::Run };
    let scan = |now_ns| {
        let times = ScanTimes::default();
        TapeEntry::Call(EngineCall::Begin { now_ns, times, local_s: 0 })
    };
    let execute = TapeEntry::Call(EngineCall::Execute);
    let mut take = |entry| line.recorder.take(entry, Some(&state), clock);
    assert!(take(at(0, 1)).is_none());
    for entry in [scan(1000), execute, TapeEntry::Swap { generation: 1 }, scan(2000), execute] {
        assert!(take(entry).is_none());
    }
    let block = take(at(1, 3)).expect("the section of the old program");
    assert_eq!((block.head.scans, block.head.end_hash, block.head.number), (1, None, 1));
    assert!(take(scan(3000)).is_none() && take(execute).is_none());
    let block = take(at(1, 4)).expect("the first of the new program");
    assert!(!block.head.follows && block.has_base() && block.head.end_hash.is_some());
    assert_eq!((block.program.generation, block.head.number), (1, 3));
}

#[test]
fn a_second_of_a_busy_plant_becomes_several_sections() {
    let mut line = Line::new(COUNTER);
    let state = EngineState::of(line.taped.engine());
    let clock = line.clock();
    let state_entry = TapeEntry::State { generation: 0, number: 1, mode: Mode::Run };
    assert!(line.recorder.take(state_entry, Some(&state), clock).is_none());
    let (mut entries, mut blocks) = (Vec::new(), Vec::new());
    for scan in 0..100_u64 {
        let (now_ns, times) = (scan * 10_000_000, ScanTimes::default());
        entries.push(TapeEntry::Number(scan * 2));
        entries.push(TapeEntry::Call(EngineCall::Begin { now_ns, times, local_s: 0 }));
        for cell in 0..3000 {
            let value = (scan as i32) * cell as i32;
            entries.push(TapeEntry::Call(EngineCall::Write(Cell::Word(WordCell(cell)), value)));
        }
        entries.push(TapeEntry::Call(EngineCall::Execute));
    }
    // Nothing but commands: there is no scan at which to split.
    let bits = (0..300_000).map(|at| EngineCall::Force(Cell::Bit(BitCell(at % 50)), 1));
    entries.extend(bits.map(TapeEntry::Call));
    for entry in &entries {
        blocks.extend(line.recorder.take(*entry, None, clock));
    }
    blocks.extend(line.recorder.flush(clock));
    let recording = Recording::of_bytes(in_memory(&blocks));
    assert!(recording.count() == blocks.len() && blocks.len() >= 6, "{}", blocks.len());
    let mut read = Vec::new();
    for at in 0..recording.count() {
        assert!(at == 0 || recording.follows(at));
        let (state, section) = recording.read(at).unwrap().expect("it is whole");
        assert_eq!(state.is_some(), at == 0);
        let is_scan = recording.head(at).scans > 0;
        assert_eq!(is_scan, matches!(section.entries[0], TapeEntry::Number(_)));
        read.extend(section.entries);
    }
    assert!(read == entries);
}

#[test]
fn a_program_that_nobody_has_told_makes_a_gap() {
    let mut line = Line::new(COUNTER);
    line.start();
    for _ in 0..170 {
        line.scan(10_000_000, |_| {});
        line.read();
    }
    line.recorder = Recorder::new(recorded(COUNTER, 7));
    for _ in 0..500 {
        line.scan(10_000_000, |_| {});
        line.read();
    }
    let blocks = line.blocks.len();
    line.recorder.program(recorded(COUNTER, 0));
    for _ in 0..500 {
        line.scan(10_000_000, |_| {});
        line.read();
    }
    let (known, late) = line.blocks.split_at(blocks);
    assert!(known.len() < 5 && late.len() > 2);
    assert!(!late[0].head.follows && late[0].has_base() && late[1].head.follows);
}

#[test]
fn what_is_lost_makes_a_gap_and_the_recording_goes_on_behind_it() {
    let mut line = Line::new(COUNTER);
    line.start();
    for _ in 0..100 {
        line.scan(10_000_000, |_| {});
        line.read();
    }
    line.keeps_images = false;
    // Nobody reads until the tape is full.
    for _ in 0..70_000 {
        line.scan(10_000_000, |_| {});
    }
    for _ in 0..300 {
        line.read();
        line.scan(10_000_000, |_| {});
    }
    line.flush();
    let recording = Recording::of_bytes(on_disk(&line.blocks));
    let gaps: Vec<_> = (1..recording.count()).filter(|at| !recording.follows(*at)).collect();
    assert_eq!(gaps.len(), 1);
    let mut replay = Replay::new(recording, engine);
    let section = replay.section(gaps[0]).unwrap();
    assert!(section.start.lost > 100 && !section.start.follows);
    let count = replay.recording().count();
    let verified = replay.verify(0..count);
    assert_eq!((verified.first_difference, verified.gaps, verified.unreplayable), (None, 1, 0));
}

#[test]
fn who_stands_behind_an_origin_is_known_though_it_is_told_late() {
    let mut line = Line::new(COUNTER);
    line.start();
    let (early, late) = (Origin::Batch(Ticket(1)), Origin::Command(CommandId(9)));
    line.recorder.note(early, "Modbus client 10.0.0.7");
    for scan in 0..350 {
        line.scan(10_000_000, |taped| {
            if scan == 120 {
                taped.comes_from(early);
                taped.set_input(0, true);
            }
        });
        if scan == 130 {
            line.taped.comes_from(late);
            line.taped.force(Cell::Bit(BitCell(3)), 1);
            line.taped.settle();
        }
        line.read();
        if scan == 220 {
            line.recorder.note(late, "root");
        }
    }
    line.flush();
    let mut replay = Replay::new(Recording::of_bytes(on_disk(&line.blocks)), engine);
    let at = replay.recording().place_of_scan(130).unwrap();
    let who = replay.section(at).unwrap().who;
    assert!(who.contains(&(early, "Modbus client 10.0.0.7".to_owned())), "{who:?}");
    assert!(who.contains(&(late, "root".to_owned())), "{who:?}");
}

#[test]
fn a_recording_that_fits_no_engine_is_refused() {
    let mut line = Line::new(COUNTER);
    line.start();
    for _ in 0..200 {
        line.scan(10_000_000, |taped| taped.set_input(0, true));
        line.read();
    }
    line.flush();
    let bytes = in_memory(&line.blocks);
    let other =
        |_: &RecordedProgram| engine(&recorded("[[program]]\nname = \"Main\"\nrung = []\n", 0));
    let mut replay = Replay::new(Recording::of_bytes(bytes.clone()), other);
    let count = replay.recording().count() as u64;
    assert_eq!(replay.verify(0..count as usize).unreplayable, count);
    let none = |_: &RecordedProgram| Err("no such file".to_owned());
    let error = Replay::new(Recording::of_bytes(bytes), none).engine_at(0).unwrap_err();
    assert_eq!(error.to_string(), "its program cannot be loaded: no such file");
}
