//! `how` about recorded random ladders: what it says works when it is tried, and no way is shorter.
//!
//! The judge is written apart: conditions are compares of cells, a trial executes the program of
//! the recording, and a search tries every combination of three inputs in up to four scans.
//! `RUNGD_HOW_QUESTIONS` (12) is the number of questions, `RUNGD_RECORD_SEED` (1) the first seed.

use std::fmt::Write as _;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use crate::record::drawn::Numbers;
use crate::record::line::{Line, engine, in_memory};
use crate::record::replayed::random_line;
use rungd_base::calendar::LocalTime;
use rungd_engine::isa::status::dst;
use rungd_engine::isa::{Word, WordSpace};
use rungd_engine::{Cell, Engine, EngineState, ScanTimes};
use rungd_history::observe::{Edit, Limits, QuestionTime, Remedy, Subject};
use rungd_history::playback::{PlayableProgram, Playback, RecordedMoment};
use rungd_history::record::{RecordedFile, RecordedProgram, Recording};
use rungd_lab::testing::AskedCondition;
use rungd_prove::decide::DecideLimits;
use rungd_prove::how::{HowAnswer, HowQuestion, HowVerdict, InputChange};
use rungd_runtime::TapeSection;
use rungd_test_support::model::generate::generate;
use rungd_test_support::setting::setting;

const PERIOD_NS: u64 = 10_000_000;
const CONTROLLER: &str = "ladder = [\"main.toml\"]\n[scan]\nperiod = \"10ms\"\n";
/// The inputs of the exhaustive search, and its depth.
const TRIED: [&str; 3] = ["X0", "X1", "X2"];
const DEPTH: usize = 4;
/// The time for a question; one that takes longer is left open.
const TIME: Duration = Duration::from_secs(20);

/// A part of a condition: a cell, a sign, and a number.
#[derive(Clone, Copy)]
struct Part {
    cell: Cell,
    sign: &'static str,
    number: i32,
}

/// A condition whose parts are all true.
struct Drawn {
    text: String,
    parts: Vec<Part>,
}

impl Drawn {
    fn is_true(&self, engine: &Engine) -> bool {
        self.parts.iter().all(|Part { cell, sign, number }| {
            let value = engine.image().value(*cell);
            match *sign {
                "" | "!" => (value != 0) == sign.is_empty(),
                "==" => value == *number,
                "<" => value < *number,
                _ => value >= *number,
            }
        })
    }
}

fn drawn(program: &PlayableProgram, names: &[String], numbers: &mut Numbers) -> Drawn {
    let (mut text, mut parts) = (String::new(), Vec::new());
    let count = 1 + numbers.below(2);
    while parts.len() < count as usize {
        let name = &names[numbers.below(names.len() as u64) as usize];
        let Some(cell) = program.cell(name) else { continue };
        let reals = matches!(cell, Cell::Word(word) if program.layout().is_real(word));
        if reals {
            continue;
        }
        let number = numbers.below(6) as i32 - 1;
        let sign = match cell {
            Cell::Word(_) => ["==", "<", ">="][numbers.below(3) as usize],
            Cell::Bit(_) | Cell::WordBit(_) => ["", "!"][numbers.below(2) as usize],
        };
        let and = if parts.is_empty() { "" } else { " & " };
        let _ = match cell {
            Cell::Word(_) => write!(text, "{and}{name} {sign} {number}"),
            Cell::Bit(_) | Cell::WordBit(_) => write!(text, "{and}{sign}{name}"),
        };
        parts.push(Part { cell, sign, number });
    }
    Drawn { text, parts }
}

/// Executes one scan of the program of the recording. The times of scans and the time of day stay
/// those of the state.
fn scan(engine: &mut Engine, changes: impl Iterator<Item = (Cell, i32)>) -> bool {
    let word = |n| {
        let cell = engine.program().layout.word(Word::Space(WordSpace::Dst, n));
        engine.image().value(Cell::Word(cell))
    };
    let times = ScanTimes {
        mean_us: word(dst::SCAN_TIME_US),
        min_us: word(dst::MIN_SCAN_TIME_US),
        max_us: word(dst::MAX_SCAN_TIME_US),
        last_us: word(dst::LAST_SCAN_TIME_US),
    };
    let local = LocalTime {
        year: word(dst::YEAR),
        month: word(dst::MONTH),
        day: word(dst::DAY),
        weekday: word(dst::WEEKDAY),
        hour: word(dst::HOUR),
        minute: word(dst::MINUTE),
        second: word(dst::SECOND),
        day_number: word(dst::DAY_NUMBER),
        second_of_day: word(dst::SECOND_OF_DAY),
    };
    engine.begin_scan(engine.now_ns() + PERIOD_NS, &times, &local);
    for (cell, value) in changes {
        match cell {
            Cell::Bit(bit) => engine.write_bit(bit, value != 0),
            Cell::Word(word) => engine.write_word(word, value),
            Cell::WordBit(_) => unreachable!("an input is a whole cell"),
        }
    }
    engine.execute().last
}

/// A program, and its state.
#[derive(Clone, Copy)]
struct Begin<'a> {
    program: &'a PlayableProgram,
    state: &'a EngineState,
}

/// Whether the condition is true behind the scans of an answer.
fn works(begin: Begin, changes: &[InputChange], last: u64, asked: &Drawn) -> bool {
    let mut engine = begin.program.engine();
    assert!(engine.resume(begin.state));
    for number in 1..=last {
        let now = changes.iter().filter(|change| change.scan == number);
        let cell = |name: &str| begin.program.cell(name).expect("an input");
        scan(&mut engine, now.map(|change| (cell(&change.name), change.value)));
    }
    asked.is_true(&engine)
}

/// The smallest number of scans, up to [`DEPTH`], behind which the condition is true.
fn shortest(Begin { program, state }: Begin, asked: &Drawn) -> Option<u64> {
    let cells = TRIED.map(|name| program.cell(name).expect("an input"));
    let mut level = vec![state.clone()];
    let mut engine = program.engine();
    for depth in 1..=DEPTH {
        let mut next = Vec::new();
        for state in &level {
            for inputs in 0..1 << TRIED.len() {
                engine.resume(state);
                let value = |at: usize| inputs >> at & 1;
                let last =
                    scan(&mut engine, cells.iter().enumerate().map(|(at, c)| (*c, value(at))));
                if asked.is_true(&engine) {
                    return Some(depth as u64);
                }
                let after = EngineState::of(&engine);
                if !last && depth < DEPTH && !next.contains(&after) {
                    next.push(after);
                }
            }
        }
        level = next;
    }
    None
}

#[derive(Debug, Default)]
struct Tally {
    holds: u32,
    found: u32,
    never: u32,
    open: u32,
    near: u32,
}

fn judge(
    answer: &HowAnswer,
    near: Option<u64>,
    works: impl Fn(&[InputChange], u64) -> bool,
    tally: &mut Tally,
) {
    let told = || format!("{answer:?}\nexhaustive: {near:?}");
    tally.near += u32::from(near.is_some());
    match &answer.verdict {
        HowVerdict::Holds => tally.holds += 1,
        HowVerdict::Found { scan, changes, .. } => {
            assert!(works(changes, *scan), "it does not work: {}", told());
            assert!(near.is_none_or(|near| *scan <= near), "it is longer: {}", told());
            tally.found += 1;
        }
        HowVerdict::Never { .. } => {
            assert_eq!(near, None, "there is a way: {}", told());
            tally.never += 1;
        }
        HowVerdict::Open { .. } => {
            assert_eq!(near, None, "a near way is not found: {}", told());
            tally.open += 1;
        }
    }
}

fn playable(ladder: &str) -> PlayableProgram {
    let file = |name: &str, text: &str| RecordedFile { name: name.into(), text: text.into() };
    let files = vec![file("rungd.toml", CONTROLLER), file("main.toml", ladder)];
    let program = RecordedProgram {
        version: String::new(),
        process_start_ns: 0,
        generation: 0,
        source: String::new(),
        hash: String::new(),
        files,
    };
    PlayableProgram::of(&program).unwrap_or_else(|error| panic!("{error}\n{ladder}"))
}

/// Asks one question about a random section of a random recording.
fn ask(seed: u64, tally: &mut Tally) {
    let case = generate(seed);
    let (ladder, mut numbers) = (case.ladder(), Numbers(seed ^ 0x40));
    let line: Line = random_line(seed);
    let mut playback = Playback::new(Recording::of_bytes(in_memory(&line.blocks)), engine);
    let section = numbers.below(playback.recording().count() as u64) as usize;
    let section = playback.section(section).expect("a section");
    let moment = || RecordedMoment::in_section(playable(&ladder), &section, QuestionTime::Now);
    let RecordedMoment { program, state, runs, .. } = moment().expect("a moment");
    if !runs || state.stops() {
        return;
    }
    let asked = drawn(&program, &case.watch(), &mut numbers);
    let mut now = program.engine();
    assert!(now.resume(&state), "seed {seed}");
    let begin = Begin { program: &program, state: &state };
    let holds = asked.is_true(&now);
    let near = if holds { None } else { shortest(begin, &asked) };
    let answer = answered(moment().expect("a moment"), &asked.text);
    assert_eq!(matches!(answer.verdict, HowVerdict::Holds), holds, "seed {seed}: {answer:?}");
    let trial = |changes: &[InputChange], last| works(begin, changes, last, &asked);
    println!("seed {seed}: {} {near:?} {}: {} ms", asked.text, answer.word(), answer.ms);
    judge(&answer, near, trial, tally);
    compare_with_why(&Asked { program, section, state }, &case.watch(), &mut numbers);
}

fn answered(moment: RecordedMoment, condition: &str) -> HowAnswer {
    let asked = AskedCondition { condition, writes: &[] };
    let question = HowQuestion::recorded(moment, asked);
    let question = question.unwrap_or_else(|error| panic!("{condition}: {error}"));
    let given_up = Arc::new(AtomicBool::new(false));
    question.answer(&DecideLimits { time: TIME, memory: 50_000_000, given_up })
}

struct Asked {
    program: PlayableProgram,
    section: TapeSection,
    state: EngineState,
}

/// What `why` proposes to change a bit in the next scan, `how` finds, if it needs inputs alone.
fn compare_with_why(asked: &Asked, names: &[String], numbers: &mut Numbers) {
    let Asked { program, section, state } = asked;
    let bit = loop {
        let name = &names[numbers.below(names.len() as u64) as usize];
        match program.cell(name) {
            Some(cell @ Cell::Bit(_)) if !state.is_forced(cell) => break (name, cell),
            _ => {}
        }
    };
    let (name, cell) = bit;
    let subject = Subject::new(Arc::clone(&program.program), program.loaded.files.clone());
    let mut past = vec![Arc::new(section.clone())];
    let answer = subject.why(&mut past, cell, QuestionTime::Now, Limits::default());
    let Ok(Some(Remedy::Edits(edits))) = answer.map(|answer| answer.change) else { return };
    let write = |edit: &Edit| match edit {
        Edit::Write { operand, value } if operand.name.starts_with('X') => Some(InputChange {
            scan: 1,
            name: operand.name.clone(),
            value: *value,
            text: value.to_string(),
            is_bit: true,
            is_written: false,
            before: 1 - value,
        }),
        Edit::Write { .. } | Edit::Run { .. } => None,
    };
    let Some(changes) = edits.iter().map(write).collect::<Option<Vec<_>>>() else { return };
    let sign = if state.value(cell) == 0 { "" } else { "!" };
    let wanted =
        Drawn { text: format!("{sign}{name}"), parts: vec![Part { cell, sign, number: 0 }] };
    // The next scan of `why` comes after the time between the last two.
    if works(Begin { program, state }, &changes, 1, &wanted) {
        let case = playable(&program.loaded.files[1].text);
        let moment = RecordedMoment::in_section(case, section, QuestionTime::Now);
        let answer = answered(moment.expect("a moment"), &wanted.text);
        let HowVerdict::Found { scan: 1, .. } = answer.verdict else {
            panic!("why: {edits:?}\nhow: {answer:?}");
        };
    }
}

#[test]
fn what_how_says_about_recorded_ladders_works_and_is_no_longer_than_needed() {
    let (first, count) = (setting("RUNGD_RECORD_SEED", 1), setting("RUNGD_HOW_QUESTIONS", 12));
    let mut tally = Tally::default();
    (first..first + count).for_each(|seed| ask(seed, &mut tally));
    println!("{tally:?}");
}

#[test]
fn no_way_rests_on_other_times_of_scans_than_those_of_the_state() {
    ask(268, &mut Tally::default());
}

#[test]
fn no_way_is_longer_than_one_at_the_time_of_day_of_the_state() {
    ask(280, &mut Tally::default());
}
