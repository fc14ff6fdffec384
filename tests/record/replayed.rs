//! Recordings are executed again: every image of every scan and every state's hash must be the
//! same. The ladders are random, from the reference model's generator, with forces, writes, stops
//! and starts.
//!
//! Tests `RUNGD_RECORD_PROGRAMS` (25) ladders from the seed `RUNGD_RECORD_SEED` (1) on.

use std::cell;
use std::ops::ControlFlow;
use std::sync::Arc;

use crate::record::drawn::Numbers;
use crate::record::line::{COUNTER, Line, UNIX_NS, engine, hashed, in_memory, on_disk, recorded};
use rungd_base::calendar::parse_seconds;
use rungd_engine::{BitCell, Cell, EngineState, WordCell};
use rungd_history::playback::Playback;
use rungd_history::record::{LastProgram, RecordedProgram, Recording};
use rungd_lab::traces::stimulus::{Stimulus, StimulusChange};
use rungd_language::lower::lower;
use rungd_runtime::command::CommandId;
use rungd_runtime::exchange::Ticket;
use rungd_runtime::{ImageCells, Origin, ScannedMachine, TapeSection};
use rungd_test_support::model::clock;
use rungd_test_support::model::generate::generate;
use rungd_test_support::run::{load, target};
use rungd_test_support::setting::setting;

pub fn random_line(seed: u64) -> Line {
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
                    StimulusChange::Input(n, on) => taped.set_input(n, on),
                    StimulusChange::Bit(cell, on) => taped.write(cell, on.into()),
                    StimulusChange::Word(cell, value) => {
                        ScannedMachine::write_word(taped, cell, value)
                    }
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
    let ImageCells { bits, words } = ScannedMachine::image(&line.taped);
    let (bits, words) = (bits.len() as u64, words.len() as u64);
    let cell = match numbers.below(2) {
        // The first cells are memory, the last ones belong to the program itself.
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

/// Replays a whole recording, and compares it with the run.
fn assert_replays(line: &Line, bytes: Vec<u8>, seed: u64) {
    let recording = Recording::of_bytes(bytes);
    assert_eq!((recording.flaws.len(), recording.count()), (0, line.blocks.len()), "seed {seed}");
    let mut replay = Playback::new(recording, engine);
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
        let found = (scan.number, hashed(ImageCells { bits: image.bits(), words: image.words() }));
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
fn random_programs_replay_exactly() {
    let first = setting("RUNGD_RECORD_SEED", 1);
    for seed in first..first + setting("RUNGD_RECORD_PROGRAMS", 25) {
        let line = random_line(seed);
        assert_replays(&line, in_memory(&line.blocks), seed);
        assert_replays(&line, on_disk(&line.blocks), seed);
    }
}

#[test]
fn a_section_gives_the_same_values_from_any_start_position() {
    let mut line = Line::new(COUNTER);
    line.start();
    for scan in 0..900 {
        line.scan(10_000_000, |taped| taped.set_input(0, scan % 7 < 3));
        line.read();
    }
    line.flush();
    let whole = |bytes| {
        let mut replay = Playback::new(Recording::of_bytes(bytes), engine);
        (0..line.blocks.len()).map(|at| replay.section(at).unwrap()).collect::<Vec<_>>()
    };
    let sections = whole(in_memory(&line.blocks));
    assert!(sections.len() >= 9, "{}", sections.len());
    let disk = on_disk(&line.blocks);
    assert_eq!(sections, whole(disk.clone()));
    for at in (0..sections.len()).rev() {
        let mut replay = Playback::new(Recording::of_bytes(disk.clone()), engine);
        assert_eq!(replay.section(at).unwrap(), sections[at]);
        let state = EngineState::of(replay.engine().unwrap());
        assert_eq!(state, sections[at].state);
    }
    let recording = Recording::of_bytes(disk);
    for (scan, _) in &line.images {
        let at = recording.place_of_scan(*scan).unwrap();
        let head = recording.head(at);
        assert!((head.number..head.number + u64::from(head.scans)).contains(scan));
        let unix_ns = UNIX_NS + 5_000_000_000 + *scan as i64 * 10_000_000;
        assert_eq!(recording.place_of_time(unix_ns), Some(at), "scan {scan}");
    }
    assert_eq!(recording.place_of_scan(901), None);
    assert_eq!(recording.place_of_time(UNIX_NS - 1), None);
    let mut cut = Vec::new();
    recording.cut(3..6, &mut cut).unwrap();
    let cut = Recording::of_bytes(cut);
    assert_eq!((cut.flaws.len(), cut.head(cut.count() - 1)), (0, recording.head(5)));
    assert!(cut.has_base(0) && cut.head(0).sequence <= 3);
}

#[test]
fn a_changed_entry_is_found_as_the_first_difference() {
    let mut line = Line::new(COUNTER);
    line.start();
    for _ in 0..500 {
        line.scan(10_000_000, |_| {});
        line.read();
    }
    line.flush();
    // A hash that belongs to a different state.
    line.blocks[2].head.end_hash = Some([7; 16]);
    let mut replay = Playback::new(Recording::of_bytes(on_disk(&line.blocks)), engine);
    let count = replay.recording().count();
    assert_eq!(replay.verify(0..count).first_difference, Some(2));
}

#[test]
fn a_reload_begins_a_new_segment_of_the_recording() {
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
        let mut replay = Playback::new(Recording::of_bytes(bytes), engine);
        let recording = replay.recording();
        let count = recording.count();
        assert!((1..count).all(|at| recording.follows(at)));
        let first = recording.place_of_scan(171).unwrap();
        assert_eq!((recording.program(first).generation, recording.has_base(first)), (1, true));
        let verified = replay.verify(0..count);
        assert_eq!((verified.first_difference, verified.gaps, verified.unreplayable), (None, 0, 0));
        assert_eq!(verified.scans, 850);
        let mut images = line.images.iter();
        let visited = replay.scans(0..count, |scan, engine| {
            let image = engine.image();
            let found =
                (scan.number, hashed(ImageCells { bits: image.bits(), words: image.words() }));
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
        assert_eq!(Playback::new(cut, engine).verify(0..count - 1).unreplayable, 0);
    }
}

#[test]
fn a_recording_that_does_not_fit_its_program_is_refused() {
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
    let mut replay = Playback::new(Recording::of_bytes(bytes.clone()), other);
    let count = replay.recording().count() as u64;
    assert_eq!(replay.verify(0..count as usize).unreplayable, count);
    let none = |_: &RecordedProgram| Err("no such file".to_owned());
    let error = Playback::new(Recording::of_bytes(bytes), none).seek(0).unwrap_err();
    assert_eq!(error.to_string(), "its program cannot be loaded: no such file");
}

/// Repeated replays of the newest part read a program once and need one engine.
#[test]
fn a_program_of_repeated_replays_is_read_once() {
    let counted = |ladder: &str| {
        let mut line = Line::new(ladder);
        line.start();
        for _ in 0..200 {
            line.scan(10_000_000, |taped| taped.set_input(0, true));
            line.read();
        }
        line.flush();
        in_memory(&line.blocks)
    };
    let (bytes, other) = (counted(COUNTER), counted("[[program]]\nname = \"Main\"\nrung = []\n"));
    let mut last = LastProgram::default();
    let first = Recording::newest(bytes.clone(), &mut last);
    let again = Recording::newest(bytes.clone(), &mut last);
    assert!(Arc::ptr_eq(first.program(0), again.program(0)));
    let others = Recording::newest(other, &mut last);
    assert_ne!(others.program(0), first.program(0));
    let mut torn = bytes.clone();
    torn[60] ^= 1;
    assert_eq!(Recording::newest(torn, &mut last).count(), 0);
    let back = Recording::newest(bytes, &mut last);
    assert_eq!(back.program(0), first.program(0));
    // The engine is reused; the states are those of a separate replay.
    let made = cell::Cell::new(0);
    let make = |program: &RecordedProgram| {
        made.set(made.get() + 1);
        engine(program)
    };
    let mut alone = Playback::new(first, make);
    let state = |section: TapeSection| (section.state, section.entries);
    let expected = state(alone.section(1).expect("it is whole"));
    alone.set_recording(again);
    assert_eq!(state(alone.section(1).expect("it is whole")), expected);
    assert_eq!(made.get(), 1);
}
