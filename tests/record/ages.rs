//! The age of the files of a recording: whatever the clock says, and whenever a process begins, the
//! oldest files go first, and no file goes before the time to keep was recorded after it.

use std::fs;
use std::path::Path;

use crate::record::folder::Handle;
use crate::record::stored::{
    SECOND_NS, UNIX_NS, all_found, blocks, clock, known, owned_folder, settings,
};
use rungd_history::record::{
    RecordBlock, RecordFolder, Recording, Store, StoreSettings, TapeClock,
};

const JUMP_NS: i64 = 1000 * 86_400 * SECOND_NS;

/// A clock that is ahead by a thousand days for some seconds, twice, and set back by as much once.
fn with_jumps(blocks: &[RecordBlock]) -> Vec<RecordBlock> {
    let jump = |block: &RecordBlock| {
        let jump_ns = match block.head.sequence {
            100..105 | 200..203 => JUMP_NS,
            250..255 => -JUMP_NS,
            _ => 0,
        };
        by(block, jump_ns)
    };
    blocks.iter().map(jump).collect()
}

/// The block as it is with a clock that is ahead by this time.
fn by(block: &RecordBlock, jump_ns: i64) -> RecordBlock {
    let mut block = block.clone();
    block.head.begin_ns += jump_ns;
    block.head.end_ns += jump_ns;
    block
}

/// Records with a clock that jumps. The process ends and begins again at these sections.
/// `unplaced`: the sections whose place is not known after the next start.
fn jumps(mut starts: Vec<usize>, is_order_lost: bool, unplaced: std::ops::Range<u64>) {
    let plain = blocks(400);
    let jumping = with_jumps(&plain);
    let known = known(&jumping);
    let keep_ns = 60 * SECOND_NS;
    let disk = Handle::new();
    let settings = || StoreSettings { keep_ns: keep_ns as u64, ..settings() };
    let mut store = Store::new(disk.clone(), settings());
    for (at, block) in jumping.iter().enumerate() {
        if starts.last().is_some_and(|start| at >= *start) && block.has_base() {
            starts.pop();
            assert!(store.finish(clock(block)).is_none());
            store = Store::new(disk.clone(), settings());
            if is_order_lost {
                disk.0.borrow_mut().order.clear();
            }
        }
        // A monotonic clock does not jump with the wall clock.
        let jump_ns = block.head.end_ns - plain[at].head.end_ns;
        let now = TapeClock { unix_ns: block.head.end_ns, unix_offset_ns: UNIX_NS + jump_ns };
        assert!(store.put(block, now).is_none());
        if at % 7 > 0 {
            continue;
        }
        let found = all_found(&disk.0.borrow(), &known);
        let age_ns = |sequence: u64| plain[at].head.end_ns - plain[sequence as usize].head.end_ns;
        let young = (0..=at as u64).filter(|sequence| age_ns(*sequence) <= keep_ns);
        assert!(young.into_iter().all(|sequence| found.contains(&sequence)), "{at}: {found:?}");
        // Files of ten seconds go as a whole, and the heads of one file are read at a time.
        let old = found.iter().filter(|sequence| age_ns(**sequence) > keep_ns + 60 * SECOND_NS);
        let old: Vec<_> = old.filter(|sequence| !unplaced.contains(*sequence)).collect();
        assert!(old.is_empty(), "{at}: {old:?}");
    }
    assert!(starts.is_empty());
    let first = all_found(&disk.0.borrow(), &known)[0];
    assert!(first > 250, "old files go: {first}");
}

#[test]
fn a_jump_of_the_clock_deletes_no_recording_younger_than_the_limit() {
    // Processes begin while the clock is right, ahead and behind.
    jumps(vec![270, 252, 180, 102, 90], false, 0..0);
}

#[test]
fn a_file_from_a_clock_that_was_ahead_is_not_deleted_without_a_noted_order() {
    jumps(vec![180, 102, 90], true, 100..120);
}

/// The sequences of sections in a folder, with those of a first section.
fn sequences(folder: &Path) -> Vec<u64> {
    let recording = Recording::open(folder).unwrap();
    let mut all: Vec<_> = (0..recording.count()).map(|at| recording.head(at).sequence).collect();
    all.sort_unstable();
    all
}

#[test]
fn recordings_of_a_slow_clock_keep_their_order() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("record-behind");
    let _ = fs::remove_dir_all(&folder);
    let all = blocks(90);
    let processes = [(0..30, 0), (30..60, -JUMP_NS), (60..90, 0)];
    let total = {
        let mut bytes = 0;
        for (range, jump_ns) in processes {
            let settings = StoreSettings { bytes_max: 1 << 20, ..settings() };
            let settings = StoreSettings {
                bytes_max: if range.start == 60 { bytes + 5_000 } else { settings.bytes_max },
                ..settings
            };
            let mut store = Store::new(owned_folder(&folder), settings);
            for block in &all[range] {
                let block = by(block, jump_ns);
                let now =
                    TapeClock { unix_ns: block.head.end_ns, unix_offset_ns: UNIX_NS + jump_ns };
                // The first blocks of a process without a base image are left out.
                assert!(store.put(&block, now).is_none());
                assert!(store.finish(now).is_none());
            }
            bytes = store.status().bytes;
        }
        bytes
    };
    let left = sequences(&folder);
    let lost: Vec<u64> = (0..90).filter(|sequence| !left.contains(sequence)).collect();
    assert!(!lost.is_empty() && lost.iter().all(|sequence| *sequence < 30), "{lost:?} of {total}");
}

#[test]
fn an_incomplete_order_file_is_ignored_and_foreign_files_are_not_changed() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("record-order");
    let _ = fs::remove_dir_all(&path);
    let order = [5_000_000, 3_000_000, 9_000_000];
    let lock = path.join("line.lock");
    let opened = || owned_folder(&path);
    opened().note_order(&order);
    assert_eq!(opened().order(), order);
    opened().note_order(&order[1..]);
    assert_eq!(opened().order(), order[1..]);
    let whole = fs::read(&lock).unwrap();
    for length in 1..whole.len() - 1 {
        fs::write(&lock, &whole[..length]).unwrap();
        assert_eq!(opened().order(), [0; 0], "{length}");
    }
    // An order of which a power cut left a part is written anew.
    fs::write(&lock, "").unwrap();
    opened().note_order(&order);
    assert_eq!(opened().order(), order);
    fs::write(&lock, "notes of somebody\n").unwrap();
    opened().note_order(&order);
    assert_eq!(
        (opened().order(), fs::read(&lock).unwrap()),
        (vec![], b"notes of somebody\n".into())
    );
}
