//! The recorder: gaps, lost steps, late states, names, and sections that are too long for one
//! block.

use crate::record::line::{COUNTER, Line, engine, in_memory, on_disk, recorded};
use rungd_engine::{BitCell, Cell, EngineCall, EngineState, ScanTimes, WordCell};
use rungd_history::playback::Playback;
use rungd_history::record::{Recent, RecordBlock, Recorder, Recording};
use rungd_runtime::command::CommandId;
use rungd_runtime::exchange::{Mode, Ticket};
use rungd_runtime::{Origin, ScanStart, ScannedMachine, TapeEntry, tape_of};

#[test]
fn a_late_state_after_a_reload_makes_a_gap() {
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
    // Only commands, without a scan at which the section could be split.
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
fn an_unannounced_program_makes_a_gap() {
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
fn lost_entries_make_a_gap_and_the_recording_continues_after_it() {
    let mut line = Line::new(COUNTER);
    line.start();
    for _ in 0..100 {
        line.scan(10_000_000, |_| {});
        line.read();
    }
    line.keeps_images = false;
    // The tape is not read until it is full.
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
    let mut replay = Playback::new(recording, engine);
    let section = replay.section(gaps[0]).unwrap();
    assert!(section.start.lost > 100 && !section.start.follows);
    let count = replay.recording().count();
    let verified = replay.verify(0..count);
    assert_eq!((verified.first_difference, verified.gaps, verified.unreplayable), (None, 1, 0));
}

#[test]
fn the_sender_of_a_write_is_recorded_even_if_it_is_reported_late() {
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
    let mut replay = Playback::new(Recording::of_bytes(on_disk(&line.blocks)), engine);
    let at = replay.recording().place_of_scan(130).unwrap();
    let who = replay.section(at).unwrap().who;
    assert!(who.contains(&(early, "Modbus client 10.0.0.7".to_owned())), "{who:?}");
    assert!(who.contains(&(late, "root".to_owned())), "{who:?}");
}

/// A request returns the section under way, and does not change how it continues.
#[test]
fn an_unfinished_section_is_readable() {
    let mut lines = [Line::new(COUNTER), Line::new(COUNTER)];
    lines.iter_mut().for_each(Line::start);
    let mut seen = 0;
    for scan in 0..250_u64 {
        for line in &mut lines {
            line.scan(10_000_000, |taped| ScannedMachine::set_input(taped, 0, scan % 7 < 3));
            line.read();
        }
        let asked = &lines[0];
        let mut kept = Recent::new(1 << 22);
        asked.blocks.iter().for_each(|block| kept.put(block));
        // Right after a state there is no section under way.
        let Some(block) = asked.recorder.under_way() else { continue };
        seen += 1;
        let recording = Recording::of_bytes(kept.write_from(0, Some(&block), usize::MAX));
        assert!(recording.flaws.is_empty() && recording.count() == asked.blocks.len() + 1);
        let last = recording.head(asked.blocks.len());
        assert_eq!(last.number + u64::from(last.scans), scan + 2);
        if scan % 50 == 0 {
            let count = recording.count();
            let verified = Playback::new(recording, engine).verify(0..count);
            assert_eq!((verified.scans, verified.unreplayable), (scan + 1, 0));
        }
    }
    let [asked, other] = lines.map(|mut line| {
        line.flush();
        in_memory(&line.blocks)
    });
    assert!(asked == other && seen > 240);
}

/// On a tape that nobody reads, each scan is either recorded or counted as lost.
#[test]
fn lost_scans_at_the_end_of_a_tape_are_counted() {
    for room in [4, 8, 40, 1000] {
        let (mut machine, mut reader) = tape_of(engine(&recorded(COUNTER, 0)).unwrap(), room);
        machine.start(0);
        for number in 1..=50 {
            let (now_ns, times) = (number * 10_000_000, ScanTimes::default());
            machine.begin_scan(&ScanStart { number, now_ns, times, local_s: 0 });
            machine.execute();
            machine.settle();
        }
        drop(machine);
        let mut told = 0;
        while let Some((entry, _)) = reader.take() {
            told += match entry {
                TapeEntry::Call(EngineCall::Execute) => 1,
                TapeEntry::Lost { steps } => steps,
                _ => 0,
            };
        }
        assert_eq!(told + reader.unheard(), 50, "room for {room} entries");
    }
}

/// The clock is set by a month in each direction while a recording in memory goes on.
#[test]
fn the_reach_of_memory_is_elapsed_time_and_not_clock_time() {
    const MONTH_NS: i64 = 30 * 86_400 * 1_000_000_000;
    let mut line = Line::new(COUNTER);
    line.start();
    for _ in 0..6_000 {
        line.scan(10_000_000, |_| {});
        line.read();
    }
    line.flush();
    let (first_ns, count) = (line.blocks[0].head.begin_ns, line.blocks.len());
    let reach_ns = line.blocks[count - 1].head.end_ns - first_ns;
    let kept = |blocks: &[RecordBlock], most: usize| {
        let mut recent = Recent::new(most);
        blocks.iter().for_each(|block| recent.put(block));
        (recent.reach_ns(), Recording::of_bytes(recent.write()).count())
    };
    assert_eq!(kept(&line.blocks, 1 << 26), (reach_ns as u64, count));
    for month_ns in [MONTH_NS, -MONTH_NS] {
        let mut blocks = line.blocks.clone();
        for block in &mut blocks[10..] {
            block.head.begin_ns += month_ns;
            block.head.end_ns += month_ns;
        }
        // The pause between two scans, around which the clock is set, has no known length.
        assert_eq!(kept(&blocks, 1 << 26), (reach_ns as u64 - 10_000_000, count));
    }
    // The blocks that go take their time with them.
    let bytes = Recording::of_bytes(in_memory(&line.blocks)).bytes() as usize;
    let (part_ns, left) = kept(&line.blocks, bytes / 2);
    assert!((10..count).contains(&left), "{left} of {count}");
    let oldest = &line.blocks[count - left - 1].head;
    assert_eq!(part_ns as i64, reach_ns - (oldest.end_ns - first_ns));
}
