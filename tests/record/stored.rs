//! Whatever a disk does, the blocks found on it are those that were recorded. No durable block
//! within the limits is lost, and no foreign file is touched.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;
use std::rc::Rc;
use std::time::{Duration, Instant};

use crate::record::drawn::Numbers;
use crate::record::folder::{Disk, FailingCalls, Fault, Handle};
use crate::record::line::{Line, engine, in_memory};
use rungd_history::playback::Playback;
use rungd_history::record::{
    BlockHead, FolderOnDisk, RecordBlock, RecordFolder, RecordedFolder, Recording, SectionBody,
    Store, StoreNews, StoreSettings, TapeClock, index,
};
use rungd_runtime::ScannedMachine;
use rungd_test_support::patience::PATIENCE;
use rungd_test_support::system::shell;

pub const UNIX_NS: i64 = 1_700_000_000_000_000_000;
pub const SECOND_NS: i64 = 1_000_000_000;

const LADDER: &str = r#"
[[program]]
name = "Main"
rung = [ { when = ["X0"], do = ["ADD D0 1 to=D0", "TMRAG T0 preset=1s"] } ]
"#;

/// Blocks of about a second each.
pub fn blocks(count: usize) -> Vec<RecordBlock> {
    let mut line = Line::new(LADDER);
    let mut numbers = Numbers(5);
    line.start();
    while line.blocks.len() < count {
        line.scan(180_000_000, |taped| taped.set_input(0, numbers.below(2) == 0));
        line.read();
        if numbers.below(25) == 0 {
            line.flush();
        }
    }
    line.blocks
}

pub type Known = BTreeMap<u64, (BlockHead, SectionBody)>;

/// The recorded heads and sections, by the numbers of sections.
pub fn known(blocks: &[RecordBlock]) -> Known {
    let recording = Recording::of_bytes(in_memory(blocks));
    let section = |at| recording.read(at).unwrap().expect("it is whole").1;
    let count = recording.count();
    (0..count)
        .map(|at| (recording.head(at).sequence, (recording.head(at).clone(), section(at))))
        .collect()
}

/// The numbers of the sections in a file's bytes; checks that they are as recorded.
fn found(bytes: &[u8], known: &Known) -> Vec<u64> {
    let mut source = Cursor::new(bytes);
    let blocks = index(&mut source).unwrap().blocks;
    let mut found = Vec::new();
    for block in blocks {
        if let Some((_, section)) = block.read(&mut source).unwrap() {
            let (head, expected) = &known[&block.head.sequence];
            assert!(block.head == *head && section == *expected, "misread");
            found.push(block.head.sequence);
        }
    }
    found
}

pub fn all_found(disk: &Disk, known: &Known) -> Vec<u64> {
    let files = disk.files.iter().filter(|(name, _)| name.starts_with("line-"));
    let mut all: Vec<_> = files.flat_map(|(_, file)| found(&file.bytes, known)).collect();
    all.sort_unstable();
    all
}

pub fn settings() -> StoreSettings {
    StoreSettings {
        controller: "line".into(),
        keep_ns: 3600 * SECOND_NS as u64,
        bytes_max: 1 << 20,
        file_ns: 10 * SECOND_NS as u64,
        file_bytes: 1 << 20,
    }
}

/// The time at which a block is put: its end.
/// A folder of the file system, owned by this test. A child process that a different test starts
/// holds the lock of the folder's last owner from its clone to its exec.
pub fn owned_folder(path: &Path) -> FolderOnDisk {
    let begin = Instant::now();
    loop {
        let mut folder = FolderOnDisk::new(path);
        match folder.own("line") {
            Ok(()) => return folder,
            Err(error) => assert!(begin.elapsed() < PATIENCE, "{error}"),
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

pub fn clock(block: &RecordBlock) -> TapeClock {
    TapeClock { unix_ns: block.head.end_ns, unix_offset_ns: UNIX_NS }
}

#[test]
fn durable_data_survives_any_power_cut() {
    let blocks = blocks(24);
    let known = Rc::new(known(&blocks));
    let disk = Handle::new();
    let (durable, put, states) =
        (Rc::new(Cell::new(0)), Rc::new(Cell::new(0)), Rc::new(Cell::new(0)));
    {
        let (known, put) = (known.clone(), put.clone());
        let (durable, states) = (durable.clone(), states.clone());
        let syncs = Cell::new(0);
        disk.0.borrow_mut().watch = Some(Rc::new(move |disk: &Disk| {
            if disk.syncs > syncs.replace(disk.syncs) {
                durable.set(put.get());
            }
            let others = disk.files.iter().filter(|(name, _)| Some(*name) != disk.open.as_ref());
            let others: Vec<_> =
                others.flat_map(|(_, file)| found(&file.bytes[..file.synced], &known)).collect();
            let looked = disk.cuts(|bytes| {
                let mut all = found(bytes, &known);
                all.extend(&others);
                assert!((0..durable.get()).all(|sequence| all.contains(&sequence)));
            });
            states.set(states.get() + looked);
        }));
    }
    let mut store = Store::new(disk.clone(), settings());
    for block in &blocks {
        assert!(store.put(block, clock(block)).is_none());
        put.set(block.head.sequence + 1);
        assert!(store.tick(clock(block)).is_none());
        assert!(put.get() - durable.get() <= 3, "{} of {}", durable.get(), put.get());
    }
    assert!(store.finish(clock(&blocks[23])).is_none());
    assert!(durable.get() >= 23);
    assert!(disk.0.borrow().files.len() > 1 && states.get() > 3_000, "{}", states.get());
    assert_eq!(all_found(&disk.0.borrow(), &known), (0..24).collect::<Vec<_>>());
}

const FAULTS: [Fault; 4] = [Fault::Errno(5), Fault::Errno(28), Fault::Errno(4), Fault::Short];

#[test]
fn the_store_continues_after_any_failed_call() {
    let blocks = blocks(60);
    let known = known(&blocks);
    for fault in FAULTS {
        for in_a_row in [1, 6] {
            let mut n = 1;
            while one_failure(&blocks, &known, FailingCalls { fault, first: n, count: in_a_row }) {
                n += 1;
            }
            assert!(n > 30, "{n}");
        }
    }
}

/// Lets the n-th call of the first 25 blocks fail, and some calls after it; false if there are
/// fewer calls.
fn one_failure(blocks: &[RecordBlock], known: &Known, fails: FailingCalls) -> bool {
    let disk = Handle::new();
    disk.clone().create("other-20231114T221320Z-000000.rungd-log").unwrap();
    disk.0.borrow_mut().calls = 0;
    disk.0.borrow_mut().fault = Some(fails);
    let mut store = Store::new(disk.clone(), settings());
    let (mut troubles, mut calls) = (0, 0);
    for (at, block) in blocks.iter().enumerate() {
        if at == 25 {
            disk.0.borrow_mut().fault = None;
            calls = disk.0.borrow().calls;
        }
        for news in [store.put(block, clock(block)), store.tick(clock(block))] {
            let told = match news {
                Some(StoreNews::Stopped(_)) => 0,
                Some(StoreNews::Resumed { .. }) => 1,
                Some(StoreNews::FileGone { name }) => panic!("{name} is there"),
                None => continue,
            };
            assert_eq!(troubles % 2, told, "told once");
            troubles += 1;
        }
    }
    let status = store.status();
    let disk = disk.0.borrow();
    let found = all_found(&disk, known);
    let place = format!("{fails:?}: {status:?}, {found:?}");
    assert_eq!(found.last(), Some(&59), "{place}");
    assert!(status.trouble.is_none() && troubles % 2 == 0, "{place}");
    // Blocks written before a failed sync may be there although they count as lost.
    assert!(found.len() as u64 + status.lost_blocks >= 60, "{place}");
    assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "{place}");
    let own = disk.files.keys().filter(|name| name.starts_with("line-")).count();
    assert_eq!((status.files, disk.files.len()), (own, own + 1), "{place}");
    calls >= fails.first
}

#[test]
fn a_full_disk_is_reported_once_and_recording_resumes_with_space() {
    let blocks = blocks(300);
    let known = known(&blocks);
    let disk = Handle::new();
    disk.0.borrow_mut().room = 8_000;
    let mut store = Store::new(disk.clone(), settings());
    let (mut stopped, mut resumed) = (Vec::new(), Vec::new());
    for (at, block) in blocks.iter().enumerate() {
        if at == 200 {
            disk.0.borrow_mut().room = usize::MAX;
        }
        match store.put(block, clock(block)) {
            Some(StoreNews::Stopped(error)) => stopped.push((at, error.to_string())),
            Some(StoreNews::Resumed { lost_blocks }) => resumed.push((at, lost_blocks)),
            Some(StoreNews::FileGone { name }) => panic!("{name} is there"),
            None => {}
        }
        assert!(store.tick(clock(block)).is_none());
        assert!(disk.0.borrow().files.len() < 12);
    }
    assert_eq!((stopped.len(), resumed.len()), (1, 1), "{stopped:?} {resumed:?}");
    let ((stop, _), (resume, lost)) = (&stopped[0], resumed[0]);
    assert!((200..=265).contains(&resume), "{resume}");
    assert_eq!(lost, (resume - stop) as u64);
    let found = all_found(&disk.0.borrow(), &known);
    assert_eq!(found.len(), 300 - lost as usize);
    assert_eq!(found.last(), Some(&299));
}

#[test]
fn the_oldest_files_are_deleted_to_keep_the_limits() {
    let blocks = blocks(300);
    let known = known(&blocks);
    let disk = Handle::new();
    let mut store = Store::new(disk.clone(), StoreSettings { bytes_max: 30_000, ..settings() });
    for block in &blocks {
        assert!(store.put(block, clock(block)).is_none());
        let used = disk.0.borrow().used() as u64;
        assert!(used <= 30_000, "{used}");
        assert_eq!(store.status().bytes, used);
        if block.head.sequence % 7 > 0 {
            continue;
        }
        let found = all_found(&disk.0.borrow(), &known);
        let first = block.head.sequence + 1 - found.len() as u64;
        assert_eq!(found, (first..=block.head.sequence).collect::<Vec<_>>());
        assert!(used > 18_000 || first == 0, "{used}: more than is necessary went");
    }
    // Removal by age: files of 10 s, kept for 60 s.
    let disk = Handle::new();
    let keep_ns = 60 * SECOND_NS;
    let mut store =
        Store::new(disk.clone(), StoreSettings { keep_ns: keep_ns as u64, ..settings() });
    for block in &blocks {
        assert!(store.put(block, clock(block)).is_none());
        if block.head.sequence % 7 > 0 {
            continue;
        }
        let found = all_found(&disk.0.borrow(), &known);
        let age_ns = block.head.end_ns - known[&found[0]].0.begin_ns;
        assert!(age_ns <= keep_ns + 15 * SECOND_NS, "{age_ns}");
        assert!(age_ns >= keep_ns || found[0] == 0, "{age_ns}");
    }
}

#[test]
fn a_block_larger_than_the_limit_is_not_written() {
    let blocks = blocks(3);
    let disk = Handle::new();
    let mut store = Store::new(disk.clone(), StoreSettings { bytes_max: 100, ..settings() });
    for block in &blocks {
        assert!(store.put(block, clock(block)).is_none());
    }
    assert_eq!((disk.0.borrow().files.len(), store.status().lost_blocks), (0, 3));
}

#[test]
fn successive_processes_keep_durable_data_and_foreign_files() {
    let blocks = blocks(300);
    let known = known(&blocks);
    for seed in 0..8 {
        let mut numbers = Numbers(seed);
        let disk = Handle::new();
        let mut foreign = Vec::new();
        for name in ["line", "line-2-20231114T221320Z-000000.rungd-log", "notes.txt"] {
            disk.clone().create(name).unwrap();
            foreign.push(name);
        }
        let mut at = 0;
        while at + 60 < blocks.len() {
            let mut store = Store::new(disk.clone(), settings());
            for block in &blocks[at..at + numbers.below(60) as usize] {
                if numbers.below(12) == 0 {
                    let fault = FAULTS[numbers.below(4) as usize];
                    let mut disk = disk.0.borrow_mut();
                    let first = disk.calls + 1 + numbers.below(4);
                    disk.fault = Some(FailingCalls { fault, first, count: numbers.below(4) });
                }
                let _ = store.put(block, clock(block));
                let _ = store.tick(clock(block));
                at += 1;
            }
            let durable: Vec<_> = {
                let disk = disk.0.borrow();
                let own = disk.files.iter().filter(|(name, _)| name.starts_with("line-2023"));
                own.flat_map(|(_, file)| found(&file.bytes[..file.synced], &known)).collect()
            };
            disk.cut(|states| numbers.below(states as u64) as usize);
            let found = all_found(&disk.0.borrow(), &known);
            assert!(durable.iter().all(|sequence| found.contains(sequence)), "seed {seed}");
        }
        assert!(foreign.iter().all(|name| disk.0.borrow().files.contains_key(*name)));
    }
}

#[test]
fn a_folder_of_the_file_system_is_read_and_replayed() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("record-folder");
    let _ = std::fs::remove_dir_all(&folder);
    let blocks = blocks(60);
    let mut store = Store::new(FolderOnDisk::new(&folder), settings());
    for block in &blocks {
        assert!(store.put(block, clock(block)).is_none());
        assert!(store.tick(clock(block)).is_none());
    }
    assert!(store.finish(clock(&blocks[59])).is_none());
    assert!(store.status().files > 1);
    std::fs::write(folder.join("notes.txt"), "not a recording").unwrap();
    let recording = Recording::open(&folder).unwrap();
    assert_eq!((recording.count(), recording.flaws.len()), (60, 0));
    let mut replay = Playback::new(recording, engine);
    let verified = replay.verify(0..60);
    assert_eq!((verified.first_difference, verified.gaps, verified.unreplayable), (None, 0, 0));
    assert!(Recording::open(&folder.join("absent")).is_err());
}

#[test]
fn two_controllers_of_one_name_do_not_disturb_each_other_in_a_folder() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("record-two");
    let _ = std::fs::remove_dir_all(&folder);
    let blocks = blocks(80);
    let named = |controller: &str| {
        let settings = StoreSettings { controller: controller.into(), ..settings() };
        Store::new(FolderOnDisk::new(&folder), settings)
    };
    let (mut first, mut second, mut other) = (named("line"), named("line"), named("line-2"));
    for block in &blocks[..40] {
        assert!(first.put(block, clock(block)).is_none());
    }
    let news = second.put(&blocks[40], clock(&blocks[40]));
    let Some(StoreNews::Stopped(error)) = news else { panic!("{news:?}") };
    assert_eq!(error.kind(), std::io::ErrorKind::ResourceBusy);
    assert!(second.status().trouble.unwrap().contains("stop it, or name another"));
    assert!(other.put(&blocks[40], clock(&blocks[40])).is_none());
    // The second store retries with pauses, and records once the first one is gone.
    assert!(first.put(&blocks[40], clock(&blocks[40])).is_none());
    for block in &blocks[41..46] {
        assert!(second.put(block, clock(block)).is_none());
    }
    drop(first);
    // A child process that starts just now still holds the first one's lock.
    drop(owned_folder(&folder));
    let put = |block: &RecordBlock| {
        if second.status().trouble.is_some() {
            std::thread::sleep(Duration::from_millis(5));
        }
        second.put(block, clock(block))
    };
    let news: Vec<_> = blocks[46..].iter().filter_map(put).collect();
    assert!(matches!(news[..], [StoreNews::Resumed { .. }]), "{news:?}");
    assert_eq!(second.status().trouble, None);
}

#[test]
fn waiting_blocks_are_written_before_one_sync() {
    let blocks = blocks(40);
    let disk = Handle::new();
    let mut store = Store::new(disk.clone(), StoreSettings { file_ns: u64::MAX, ..settings() });
    for (at, block) in blocks.iter().enumerate() {
        // Each block comes a second after the one before it.
        assert!(store.put(block, clock(block)).is_none());
        assert!(!store.is_durable());
        if at % 10 == 9 {
            assert!(store.tick(clock(block)).is_none());
            assert!(store.is_durable());
        }
    }
    assert_eq!(disk.0.borrow().syncs, 4);
}

#[test]
fn a_removed_file_is_reported_and_another_one_is_begun() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("record-removed");
    let _ = std::fs::remove_dir_all(&folder);
    let blocks = blocks(40);
    let mut store = Store::new(FolderOnDisk::new(&folder), settings());
    let newest = || {
        let entries = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
        entries.filter(|path| path.extension().is_some_and(|end| end == "rungd-log")).max().unwrap()
    };
    let mut told = Vec::new();
    for (at, block) in blocks.iter().enumerate() {
        match at {
            8 => std::fs::remove_file(newest()).unwrap(),
            16 => std::fs::rename(newest(), newest().with_extension("old")).unwrap(),
            24 => std::fs::remove_dir_all(&folder).unwrap(),
            32 => {
                let (path, moved) = (newest(), newest().with_extension("moved"));
                std::fs::rename(&path, moved).unwrap();
                std::fs::write(&path, "another file").unwrap();
            }
            _ => {}
        }
        assert!(store.put(block, clock(block)).is_none());
        match store.finish(clock(block)) {
            Some(StoreNews::FileGone { name }) => told.push((at, name)),
            other => assert!(other.is_none(), "{at}: {other:?}"),
        }
    }
    let at: Vec<_> = told.iter().map(|(at, _)| *at).collect();
    assert_eq!(at, [8, 16, 24, 32], "{told:?}");
    assert!(store.finish(clock(&blocks[39])).is_none());
    let recording = Recording::open(&folder).unwrap();
    let last = recording.count() - 1;
    assert_eq!(recording.head(last).sequence, 39);
    assert!(recording.count() >= 4, "{}", recording.count());
}

#[test]
fn a_pipe_named_like_a_recording_blocks_no_reader() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("record-pipe");
    let _ = std::fs::remove_dir_all(&folder);
    let blocks = blocks(12);
    let mut store = Store::new(FolderOnDisk::new(&folder), settings());
    blocks.iter().for_each(|block| assert!(store.put(block, clock(block)).is_none()));
    assert!(store.finish(clock(&blocks[11])).is_none());
    let pipe = folder.join("line-20991122T210500Z-000000.rungd-log");
    assert!(shell(&["mkfifo", pipe.to_str().unwrap()]));
    let recording = Recording::open(&folder).unwrap();
    assert_eq!((recording.count(), recording.flaws.len()), (12, 1));
    assert!(recording.flaws[0].1.to_string().contains("not a regular file"));
    let of_controller = {
        let folder = RecordedFolder { dir: folder.clone(), controller: "line".to_owned() };
        Recording::of_controller(Some(&folder), 0, Vec::new()).unwrap()
    };
    assert_eq!(of_controller.count(), 12);
    let refused = Recording::open(&pipe).unwrap_err().to_string();
    assert!(refused.contains("not a regular file"), "{refused}");
    let heads = Recording::open_heads(&folder).unwrap();
    assert_eq!((heads.count(), &*heads.program(0).files[0].text), (12, ""));
}
