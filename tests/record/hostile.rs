//! A foreign recording with valid checksums may contain base images and entries that no rungd has
//! written. Reading or executing such a recording must not panic or hang.
//!
//! Tests `RUNGD_HOSTILE` (10) changed copies of each of `RUNGD_HOSTILE_PROGRAMS` (10) recordings,
//! from the seed `RUNGD_HOSTILE_SEED` (1) on. All copies are executed; every tenth copy also gets
//! all queries.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::thread::scope;

use crate::record::drawn::{DrawnRecord, Numbers, mode, origin, write};
use crate::record::line::{COUNTER, Line, engine, in_memory, on_disk};
use crate::record::replayed::random_line;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::{BitCell, Cell, Engine, EngineCall, EngineState, WordCell};
use rungd_history::observe::{Limits, Past, QuestionTime, Subject};
use rungd_history::playback::{MakeEngine, Playback};
use rungd_history::record::{BlockHead, RecordBlock, RecordedProgram, Recording, SectionBody};
use rungd_lab::testing::{ScenarioOf, scenario};
use rungd_language::lower::lower;
use rungd_runtime::{ScannedMachine, TapeEntry, TapeSection};
use rungd_test_support::run::load;
use rungd_test_support::setting::setting;

/// The number of recordings that are tested at the same time.
const LANES: u64 = 2;

/// A block, unpacked.
#[derive(Clone)]
struct Part {
    program: Arc<RecordedProgram>,
    head: BlockHead,
    base: Option<Vec<u8>>,
    section: SectionBody,
}

fn parts(line: &Line) -> Vec<Part> {
    let recording = Recording::of_bytes(in_memory(&line.blocks));
    let part = |at: usize| {
        let (state, section) = recording.read(at).unwrap().expect("it is whole");
        let base = state.map(|state| bytes(&state));
        Part {
            program: recording.program(at).clone(),
            head: recording.head(at).clone(),
            base,
            section,
        }
    };
    (0..recording.count()).map(part).collect()
}

fn bytes(state: &EngineState) -> Vec<u8> {
    let mut bytes = Vec::new();
    state.write(&mut bytes);
    bytes
}

impl Part {
    fn block(&self) -> RecordBlock {
        let Part { program, head, base, section } = self;
        RecordBlock::new(program.clone(), head.clone(), base.as_deref(), section)
    }
}

/// A recording of these blocks, with all of their base images.
fn in_memory_of(parts: &[Part]) -> Vec<u8> {
    in_memory(&parts.iter().map(Part::block).collect::<Vec<_>>())
}

/// The positions of the parts of a base image.
struct Places {
    bits: (usize, usize),
    words: (usize, usize),
    forced: usize,
    blocks: usize,
}

fn u32_at(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
}

fn places(bytes: &[u8]) -> Places {
    let bits = (29, u32_at(bytes, 25));
    let words = (bits.0 + bits.1 + 4, u32_at(bytes, bits.0 + bits.1));
    let forced = words.0 + 4 * words.1;
    let mut blocks = forced;
    for _ in 0..2 {
        blocks += 4 + 4 * u32_at(bytes, blocks);
    }
    Places { bits, words, forced, blocks }
}

/// Changes a base image as somebody who knows the format would.
fn change_base(bytes: &mut Vec<u8>, numbers: &mut Numbers) {
    let places = places(bytes);
    let mut put = |at: usize, new: &[u8]| bytes[at..at + new.len()].copy_from_slice(new);
    let word = numbers.any() as u32;
    match numbers.below(12) {
        0 => put(8 * numbers.below(3) as usize, &numbers.any().to_le_bytes()),
        1 => put(24, &[numbers.any() as u8]),
        2 => put(places.bits.0 + numbers.below(places.bits.1 as u64) as usize, &[2]),
        3 => (0..200).for_each(|_| {
            let at = places.bits.0 + numbers.below(places.bits.1 as u64) as usize;
            put(at, &[numbers.below(2) as u8]);
        }),
        4 | 5 => {
            // The last words belong to the program itself.
            let at = match numbers.below(2) {
                0 => numbers.below(places.words.1 as u64),
                _ => places.words.1 as u64 - 1 - numbers.below(40.min(places.words.1 as u64)),
            };
            put(places.words.0 + 4 * at as usize, &word.to_le_bytes());
        }
        6 => (0..places.words.1).for_each(|at| {
            put(places.words.0 + 4 * at, &(numbers.any() as u32).to_le_bytes());
        }),
        7 => {
            let forced = [places.forced, bytes.len()][numbers.below(2) as usize];
            let cells = if numbers.below(2) == 0 { places.bits.1 } else { places.words.1 };
            let cell = numbers.below(cells as u64 + 2) as u32;
            if forced + 4 <= bytes.len() {
                let count = u32_at(bytes, forced) as u32;
                bytes[forced..forced + 4].copy_from_slice(&(count + 1).to_le_bytes());
                bytes.splice(forced + 4..forced + 4, cell.to_le_bytes());
            }
        }
        8 | 9 => {
            // Flags, times, intervals.
            let rest = bytes.len() - places.blocks;
            let at = places.blocks + numbers.below(rest as u64) as usize;
            let new = numbers.any().to_le_bytes();
            let count = new.len().min(bytes.len() - at);
            bytes[at..at + count].copy_from_slice(&new[..count]);
        }
        10 => bytes.truncate(numbers.below(bytes.len() as u64) as usize),
        _ => {
            let at = [25, places.words.0 - 4, places.forced, places.blocks];
            let at = at[numbers.below(4) as usize];
            bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        }
    }
}

/// Changes the recorded entries.
fn change_entries(section: &mut SectionBody, numbers: &mut Numbers) {
    let count = section.entries.len() as u64;
    if count == 0 {
        return;
    }
    let at = numbers.below(count) as usize;
    let (cell, value) = match numbers.below(2) {
        0 => write(numbers),
        _ => {
            let cell = numbers.below(20_000) as u32;
            let bit = (Cell::Bit(BitCell(cell)), numbers.below(2) as i32);
            let word = (Cell::Word(WordCell(cell)), numbers.any() as i32);
            if numbers.below(2) == 0 { bit } else { word }
        }
    };
    let call = match numbers.below(10) {
        0 => EngineCall::Start { now_ns: numbers.any() },
        1 => EngineCall::RequestStop,
        2 => EngineCall::Terminate,
        3 => EngineCall::Execute,
        4 => EngineCall::Write(cell, value),
        5 => EngineCall::Force(cell, value),
        6 => EngineCall::Release(cell),
        _ => return change_scan(section, at, numbers),
    };
    match numbers.below(8) {
        0 => section.unix_offset_ns = numbers.any() as i64,
        1 => section.lost = numbers.any(),
        2 => section.mode = mode(numbers),
        3 => section.entries.insert(at, TapeEntry::Number(numbers.any())),
        4 => section.entries.insert(at, TapeEntry::Origin(origin(numbers))),
        5 => drop(section.entries.remove(at)),
        _ => section.entries.insert(at, TapeEntry::Call(call)),
    }
}

/// Changes the times of the next scan or of the next thousand.
fn change_scan(section: &mut SectionBody, from: usize, numbers: &mut Numbers) {
    let scans = section.entries[from..].iter_mut().filter_map(|entry| match entry {
        TapeEntry::Call(EngineCall::Begin { now_ns, times, local_s }) => {
            Some((now_ns, times, local_s))
        }
        _ => None,
    });
    let count = 1 + 1000 * numbers.below(2) as usize;
    for (now_ns, times, local_s) in scans.take(count) {
        match numbers.below(4) {
            0 => *now_ns = numbers.any(),
            1 => *now_ns = now_ns.saturating_sub(numbers.any()),
            2 => *local_s = numbers.any() as i64,
            _ => {
                times.mean_us = numbers.any() as i32;
                times.min_us = numbers.any() as i32;
                times.max_us = numbers.any() as i32;
                times.last_us = numbers.any() as i32;
            }
        }
    }
}

fn change_head(head: &mut BlockHead, numbers: &mut Numbers) {
    match numbers.below(7) {
        0 => head.sequence = numbers.any(),
        1 => head.number = numbers.any(),
        2 => head.scans = numbers.any() as u32,
        3 => head.begin_ns = numbers.any() as i64,
        4 => head.end_ns = numbers.any() as i64,
        5 => head.follows = !head.follows,
        _ => head.end_hash = None,
    }
}

fn changed(parts: &[Part], line: &Line, numbers: &mut Numbers) -> Vec<u8> {
    let (mut parts, mut blocks) = (parts.to_vec(), line.blocks.clone());
    for _ in 0..1 + numbers.below(3) {
        let at = numbers.below(parts.len() as u64) as usize;
        let part = &mut parts[at];
        match (numbers.below(8), &mut part.base) {
            (0, _) => change_head(&mut part.head, numbers),
            (1..=4, Some(base)) if base.len() > 25 => {
                let whole = EngineState::read(base).is_some();
                if whole {
                    change_base(base, numbers);
                }
            }
            _ => change_entries(&mut part.section, numbers),
        }
        blocks[at] = part.block();
    }
    on_disk(&blocks)
}

/// The past of a recording, as `rungd why` has it.
struct Sections<M: MakeEngine>(Playback<M>);

impl<M: MakeEngine> Past for Sections<M> {
    fn count(&self) -> usize {
        self.0.recording().count()
    }

    fn section(&mut self, at: usize) -> Option<Arc<TapeSection>> {
        self.0.section(at).ok().map(Arc::new)
    }
}

/// Executes a recording.
fn execute(bytes: &[u8], program: &rungd_engine::EngineProgram) {
    let make = |_: &RecordedProgram| Ok(Engine::new(program.clone()));
    let mut replay = Playback::new(Recording::of_bytes(bytes.to_vec()), make);
    let count = replay.recording().count();
    let _ = replay.scans(0..count, |_, engine| {
        assert!(engine.image().bits().iter().all(|bit| *bit <= 1));
        ControlFlow::Continue(())
    });
}

/// Sends every kind of query to a recording.
fn ask(bytes: &[u8], subject: &Subject, numbers: &mut Numbers) {
    let recording = Recording::of_bytes(bytes.to_vec());
    let count = recording.count();
    let mut cut = Vec::new();
    recording.cut(0..count, &mut cut).unwrap();
    let mut replay = Playback::new(recording, engine);
    let _ = replay.verify(0..count);
    let sections: Vec<_> = (0..count).map_while(|at| replay.section(at).ok()).collect();
    if !sections.is_empty() {
        let (ladders, name) = (vec!["main.toml".to_owned()], String::new());
        // A short period would take minutes if times are far apart.
        let period = ScanPeriod::of_ms(u32::MAX);
        let _ = scenario(&ScenarioOf { subject, ladders, period, sections: &sections, name });
    }
    let mut past = Sections(replay);
    for name in ["Y0", "Y3", "C1", "D0", "V1"] {
        let Ok(cell) = subject.cell(name) else { continue };
        let scan = numbers.below(60);
        for at in [QuestionTime::Now, QuestionTime::Scan(scan)] {
            if let Ok(answer) = subject.why(&mut past, cell, at, Limits::default()) {
                let _ = (answer.text(), answer.json().to_string());
            }
        }
    }
}

#[test]
fn no_hostile_recording_causes_a_panic_or_hang() {
    let first = setting("RUNGD_HOSTILE_SEED", 1);
    let end = first + setting("RUNGD_HOSTILE_PROGRAMS", 10);
    scope(|scope| {
        for lane in 0..LANES {
            scope.spawn(move || (first + lane..end).step_by(LANES as usize).for_each(use_copies));
        }
    });
}

/// Executes changed copies of one recording.
fn use_copies(seed: u64) {
    let line = random_line(seed);
    let parts = parts(&line);
    let program = load(&line.blocks[0].program.files[0].text).unwrap();
    let (code, _) = lower(&program);
    let subject = Subject::new(Arc::new(program), Vec::new());
    for copy in 0..setting("RUNGD_HOSTILE", 10) {
        let mut numbers = Numbers(1000 * seed + copy);
        let bytes = changed(&parts, &line, &mut numbers);
        let used = catch_unwind(AssertUnwindSafe(|| {
            execute(&bytes, &code);
            if copy % 10 == 0 {
                ask(&bytes, &subject, &mut numbers);
            }
        }));
        if let Err(panic) = used {
            println!("seed {seed}, copy {copy}");
            resume_unwind(panic);
        }
    }
}

/// Damaged bytes, as a bad disk leaves them: every query has an answer.
#[test]
fn a_damaged_recording_answers_every_query() {
    for seed in 0..6 {
        let line = random_line(seed);
        let whole = on_disk(&line.blocks);
        let program = load(&line.blocks[0].program.files[0].text).unwrap();
        let subject = Subject::new(Arc::new(program), Vec::new());
        let mut numbers = Numbers(seed);
        for copy in 0..6 {
            let mut bytes = whole.clone();
            for _ in 0..=copy {
                mangle(&mut bytes, &mut numbers);
            }
            ask(&bytes, &subject, &mut numbers);
        }
    }
}

/// Changes bytes as a bad disk, a cut copy or an editor would.
pub fn mangle(bytes: &mut Vec<u8>, numbers: &mut Numbers) {
    let mut at = || numbers.below(bytes.len().max(1) as u64) as usize;
    let (one, other) = (at(), at());
    let (from, to) = (one.min(other), one.max(other));
    match numbers.below(6) {
        0 => bytes.truncate(to),
        1 if !bytes.is_empty() => bytes[from] ^= 1 << (to % 8),
        2 => drop(bytes.drain(from..to)),
        3 => bytes[from..to].fill(0),
        4 => drop(bytes.splice(to..to, bytes[from..to].to_vec())),
        _ => bytes.insert(from, b'\r'),
    }
}

/// A program with words that have limits, a real, and words of 16 bits.
const RANGES: &str = r#"
[tags]
low  = { at = "D10", min = 5, max = 9 }
high = { at = "D11", min = 0, max = 70 }
[[program]]
name = "Main"
rung = [
  { when = ["$On"], do = ["ADD D0 1 to=D0", "COPY D20..D21 to=D10..D11", "MATH R1 = R0 * 2.5"] },
  { when = ["D0 > 7"], do = ["MOVE V0 to=V1", "ENTASK Often every=1s"] },
]
[[task]]
name = "Often"
rung = [{ when = ["$On"], do = ["ADD V2 1 to=V2"] }]
"#;

/// The number of sections of `RANGES` that can be executed after a change of a base image and its
/// section, and the number that cannot.
fn executed(change: impl Fn(&mut Vec<u8>, &Places, &mut SectionBody)) -> (u64, u64) {
    let mut line = Line::new(RANGES);
    line.start();
    for scan in 0..300 {
        line.scan(10_000_000, |taped| taped.set_input(0, scan % 7 < 3));
        line.read();
    }
    line.flush();
    let mut parts = parts(&line);
    let part = parts.iter_mut().rfind(|part| part.base.is_some()).unwrap();
    let base = part.base.as_mut().unwrap();
    let places = places(base);
    change(base, &places, &mut part.section);
    let mut replay = Playback::new(Recording::of_bytes(in_memory_of(&parts)), engine);
    let count = replay.recording().count();
    let verified = replay.verify(0..count);
    (count as u64, verified.unreplayable)
}

fn word(name: &str) -> usize {
    let subject = Subject::new(Arc::new(load(RANGES).unwrap()), Vec::new());
    match subject.cell(name).unwrap() {
        Cell::Word(WordCell(at)) => at as usize,
        Cell::Bit(_) | Cell::WordBit(_) => panic!("{name} is a bit"),
    }
}

fn put_word(base: &mut [u8], places: &Places, at: usize, value: i32) {
    let at = places.words.0 + 4 * at;
    base[at..at + 4].copy_from_slice(&value.to_le_bytes());
}

#[test]
fn an_unreachable_base_image_is_refused() {
    let (count, none) = executed(|_, _, _| {});
    assert!(count > 2 && none == 0);
    let is_refused = |what: &str, change: &dyn Fn(&mut Vec<u8>, &Places, &mut SectionBody)| {
        assert_eq!(executed(change).1, 1, "{what}");
    };
    for (name, value) in [("V0", 70_000), ("V1", -1), ("R0", i32::MAX), ("R1", i32::MIN)] {
        let at = word(name);
        is_refused(name, &|base, places, _| put_word(base, places, at, value));
    }
    is_refused("a limit above the other", &|base, places, _| {
        (places.words.1 - 6..places.words.1).for_each(|at| put_word(base, places, at, 1 << 30));
    });
    is_refused("a bit of 2", &|base, places, _| base[places.bits.0 + 3] = 2);
    is_refused("a time at the end", &|base, _, _| base[7] = 0x40);
    is_refused("a length", &|base, _, _| base[26] ^= 1);
    is_refused("a flag", &|base, _, _| base[24] |= 4);
    is_refused("an interval", &|base, places, _| base[places.blocks + 4 + 17 + 7] = 1);
    is_refused("a force twice", &|base, places, _| {
        let twice = [2_u32, 5, 5].map(u32::to_le_bytes).concat();
        base.splice(places.forced..places.forced + 4, twice);
    });
    is_refused("a force of its own", &|base, places, _| {
        let own = [1_u32, places.bits.1 as u32 - 1].map(u32::to_le_bytes).concat();
        base.splice(places.forced..places.forced + 4, own);
    });
    is_refused("more forces than cells", &|base, places, _| {
        base[places.forced..places.forced + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    });
    let calls = [
        EngineCall::Write(Cell::Word(WordCell(word("V0") as u32)), 70_000),
        EngineCall::Force(Cell::Word(WordCell(word("R0") as u32)), i32::MAX),
        EngineCall::Write(Cell::Word(WordCell(u32::MAX)), 0),
        EngineCall::Release(Cell::Bit(BitCell(u32::MAX))),
        EngineCall::Start { now_ns: 1 << 62 },
    ];
    for call in calls {
        is_refused(&format!("{call:?}"), &|_, _, section| {
            section.entries.insert(0, TapeEntry::Call(call));
        });
    }
}

/// A section that cannot be executed is not retried for each section that depends on it.
#[test]
fn sections_after_damage_cost_no_more_time() {
    let mut line = Line::new(COUNTER);
    line.start();
    for _ in 0..2_000 {
        line.scan(10_000_000, |_| {});
        line.flush();
    }
    let mut parts = parts(&line);
    parts.iter_mut().skip(1).for_each(|part| part.base = None);
    let call = EngineCall::Write(Cell::Word(WordCell(u32::MAX)), 0);
    parts[1_000].section.entries.insert(0, TapeEntry::Call(call));
    let mut replay = Playback::new(Recording::of_bytes(in_memory_of(&parts)), engine);
    let (count, mut scans) = (parts.len() as u64, 0);
    let (verified, _) = replay.verify_seen(0..parts.len(), |_, _| scans += 1);
    assert_eq!((verified.sections, verified.unreplayable), (1_000, count - 1_000));
    assert!(scans <= 1_000 && replay.section(1_500).is_err());
}
