//! The real rungd records to a disk that stalls: no scan is later than in a control run at the same
//! time. A stall that is shorter than the queue loses nothing; a longer stall is reported and
//! leaves a gap. So does a stall of the log's own thread if the events exceed its buffer.
//!
//! A debug build can fill the queue in a moment: a named fault point ends a block. The disk is a
//! frozen ext4 image, which requires root and a loop device; a named fault point of a debug build
//! delays the disk's thread.
//!
//! ```console
//! cargo test --release --test commands record::live_stall -- --ignored --nocapture
//! ```

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::record::live_places::Noise;
use crate::record::live_rig::{
    BUSY, FAST, Operator, Watch, count, ended, failing, is_late, lacks_the_last, last_scan,
    recorded, recorded_run, rounds, verified,
};
use rungd_history::playback::Verified;
use rungd_history::record::Recording;
use rungd_test_support::needs::{Need, skip};
use rungd_test_support::running::live::{Live, PATIENCE, folder};
use rungd_test_support::system::shell;

/// The most blocks that wait for the disk, as in `src/daemon/record_disk.rs`.
const QUEUE: usize = 120;

/// The number of times that six clients write 984 registers each while the log's thread stalls:
/// twice the size of its buffer (`crates/runtime/src/tape_reader.rs`).
const WRITES_OF_A_STALL: usize = 2 * (4 << 15) / (6 * 984);

/// An ext4 image, mounted while this lives.
struct Disk {
    at: PathBuf,
}

impl Disk {
    fn new(home: &Path) -> Option<Disk> {
        let (image, at) = (home.join("image"), home.join("disk"));
        fs::create_dir(&at).unwrap();
        File::create(&image).unwrap().set_len(32 << 20).unwrap();
        let image = image.to_str().unwrap();
        let made = shell(&["mkfs.ext4", "-q", image])
            && shell(&["mount", "-o", "loop", image, at.to_str().unwrap()]);
        if !made {
            skip(Need::Ext4, "no ext4 on a loop device to be had");
        }
        made.then_some(Disk { at })
    }

    fn freeze(&self, on: bool) {
        let word = if on { "--freeze" } else { "--unfreeze" };
        assert!(shell(&["fsfreeze", word, self.at.to_str().unwrap()]));
    }

    /// Ends a freeze, if there is one.
    fn thaw(&self) {
        let _ = shell(&["fsfreeze", "--unfreeze", self.at.to_str().unwrap()]);
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        self.thaw();
        let at = self.at.to_str().unwrap();
        let since = Instant::now();
        while !shell(&["umount", at]) && since.elapsed() < PATIENCE {
            sleep(Duration::from_millis(50));
        }
    }
}

/// A controller that records to its own disk. The disk is removed after the process and before the
/// folder.
struct OnDisk {
    live: Live,
    disk: Option<Disk>,
    dir: PathBuf,
}

impl OnDisk {
    fn start() -> Option<OnDisk> {
        let home = folder(BUSY, FAST);
        let Some(disk) = Disk::new(&home) else {
            fs::remove_dir_all(&home).unwrap();
            return None;
        };
        let dir = disk.at.join("log");
        let live = Live::of(home.clone(), recorded_run(&home, &dir));
        Some(OnDisk { live, disk: Some(disk), dir })
    }

    fn freeze(&self, on: bool) {
        self.disk.iter().for_each(|disk| disk.freeze(on));
    }
}

impl Drop for OnDisk {
    fn drop(&mut self) {
        // A process that waits for a frozen disk cannot end.
        self.disk.iter().for_each(Disk::thaw);
        let _ = self.live.child.kill();
        let _ = self.live.child.wait();
        self.disk = None;
    }
}

/// Ends `count` blocks, each with a scan. Without debug assertions, rungd itself ends a block every
/// second.
fn end_blocks(operator: &mut Operator, home: &Path, count: usize) {
    let faults = home.join("faults");
    for _ in 0..count {
        operator.await_scans(1);
        if cfg!(debug_assertions) {
            fs::write(&faults, "record-section").unwrap();
            while faults.exists() {
                sleep(Duration::from_micros(500));
            }
        }
        // The request makes the log's thread read its tape at once.
        assert!(operator.ask(&json!({"do": "recording"}))["ok"].is_object());
    }
}

/// A stall during which the queue holds all blocks: nothing is lost and nothing is reported.
fn stalls(time: Duration) {
    rounds(|| {
        let Some(mut on) = OnDisk::start() else { return true };
        let mut operator = Operator::new(&on.live);
        operator.await_status(|status| status["record"]["disk"]["bytes"].as_u64() > Some(0));
        let watch = Watch::begin(&mut operator);
        on.freeze(true);
        end_blocks(&mut operator, &on.live.folder, QUEUE / 4);
        sleep(time);
        on.freeze(false);
        let is_good = watch.end(&mut operator);
        let scans = operator.scans();
        let asked = Instant::now();
        let lines = ended(&mut on.live);
        let is_late = is_late(asked);
        // An end that waits a minute for a busy disk reports it.
        assert!(is_late || count(&lines, "record-failed") == 0, "{lines:#?}");
        let verified = verified(&on.dir, false);
        let recording = Recording::open(&on.dir).unwrap();
        assert!(is_late || last_scan(&recording) >= scans && recording.flaws.is_empty());
        println!("stalled for {time:?}: {verified:?}");
        is_good
    });
}

#[test]
fn a_disk_stall_shorter_than_the_queue_loses_no_scan() {
    stalls(Duration::from_millis(300));
}

#[test]
#[ignore = "half a minute"]
fn a_disk_stall_of_30_seconds_loses_no_scan() {
    stalls(Duration::from_secs(30));
}

#[test]
fn a_disk_stall_longer_than_the_queue_is_reported_and_leaves_a_gap() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a build without debug assertions has no faults on purpose");
    }
    rounds(|| {
        let Some(mut on) = OnDisk::start() else { return true };
        let mut operator = Operator::new(&on.live);
        operator.await_status(|status| status["record"]["disk"]["bytes"].as_u64() > Some(0));
        let watch = Watch::begin(&mut operator);
        on.freeze(true);
        end_blocks(&mut operator, &on.live.folder, 2 * QUEUE);
        let status = operator.await_status(failing);
        let why = &status["record"]["disk"]["failing"];
        assert!(why.as_str().unwrap().contains("does not answer"), "{why}");
        let is_good = watch.end(&mut operator);
        on.freeze(false);
        operator.await_status(|status| !failing(status));
        // A block with a state, from which recording continues, comes once a second.
        operator.await_scans(1000);
        let scans = operator.scans();
        let asked = Instant::now();
        let lines = ended(&mut on.live);
        let is_late = is_late(asked);
        // An end that waits a minute for a busy disk reports it too.
        let most = 1 + usize::from(is_late);
        assert!((1..=most).contains(&count(&lines, "record-failed")), "{lines:#?}");
        assert_eq!(count(&lines, "record-resumed"), 1, "{lines:#?}");
        let resumed = lines.iter().find(|line| line["event"] == "record-resumed").unwrap();
        assert!(resumed["blocks_lost"].as_u64() >= Some(1), "{resumed}");
        let verified = verified(&on.dir, true);
        assert!(verified.gaps >= 1 || lacks_the_last(&lines), "{verified:?}, {lines:#?}");
        assert!(verified.scans < scans, "{verified:?}");
        let last = last_scan(&Recording::open(&on.dir).unwrap());
        assert!(is_late || last >= scans, "{verified:?}");
        is_good
    });
}

/// A controller whose disk does not answer while this number of blocks ends: its end waits, says
/// so, and writes everything that memory holds. Returns the scans before the end, and what was
/// written.
fn ends_in_a_stall(count: usize) -> (u64, Verified) {
    let (mut live, dir) = recorded(BUSY, FAST);
    let mut operator = Operator::new(&live);
    let (faults, hold) = (live.folder.join("faults"), live.folder.join("faults.hold"));
    operator.await_status(|status| status["record"]["disk"]["bytes"].as_u64() > Some(0));
    fs::write(&hold, "").unwrap();
    fs::write(&faults, "record-sync").unwrap();
    operator.await_status(|_| !faults.exists());
    operator.await_status(|status| status["record"]["disk"]["behind_ms"].as_u64() > Some(0));
    end_blocks(&mut operator, &live.folder, count);
    let scans = operator.scans();
    live.signal("TERM");
    let told = live.line("are being written");
    assert_eq!((&told["event"], &told["level"]), (&json!("record-ends"), &json!("INFO")));
    fs::remove_file(&hold).unwrap();
    let told = live.line("the last scans are on the disk");
    assert!(told["took"].is_string(), "{told}");
    live.line("statistics of the whole run");
    assert_eq!(live.child.wait().unwrap().code(), Some(0));
    (scans, verified(&dir, true))
}

#[test]
fn a_shutdown_during_a_disk_stall_waits_and_writes_everything() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a build without debug assertions has no faults on purpose");
    }
    let (scans, verified) = ends_in_a_stall(QUEUE / 4);
    assert!(verified.gaps == 0 && verified.scans >= scans, "{verified:?} of {scans}");
}

/// The order to end needs no room in the queue.
#[test]
fn a_shutdown_with_a_full_queue_waits_and_writes_the_queue() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a build without debug assertions has no faults on purpose");
    }
    let (scans, verified) = ends_in_a_stall(QUEUE + QUEUE / 4);
    assert!(verified.sections > QUEUE as u64 && verified.scans < scans, "{verified:?} of {scans}");
}

/// The disk's thread is repeatedly a second late.
#[test]
fn a_late_disk_thread_loses_no_scan() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a build without debug assertions has no faults on purpose");
    }
    rounds(|| {
        let (mut live, dir) = recorded(BUSY, FAST);
        let mut operator = Operator::new(&live);
        let watch = Watch::begin(&mut operator);
        let faults = live.folder.join("faults");
        for _ in 0..3 {
            fs::write(&faults, "record-disk").unwrap();
            // A block ends once a second.
            operator.await_scans(600);
            operator.await_status(|_| !faults.exists());
        }
        let is_good = watch.end(&mut operator);
        let scans = operator.scans();
        let asked = Instant::now();
        let lines = ended(&mut live);
        let is_late = is_late(asked);
        assert_eq!(count(&lines, "record-failed"), 0, "{lines:#?}");
        assert!(verified(&dir, false).scans >= scans || is_late);
        is_good
    });
}

/// Runs `rungd` with these arguments; returns its output.
fn rungd(words: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_rungd")).args(words).output().unwrap();
    String::from_utf8(output.stdout).unwrap()
}

/// The log's own thread stalls while far more events come than its buffer holds.
#[test]
fn late_steps_of_the_recorder_are_counted_and_leave_a_reported_gap() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a build without debug assertions has no faults on purpose");
    }
    let settings = "[scan]\nperiod = \"2ms\"\n[modbus-server]\nlisten = \"127.0.0.1:0\"\n\
                    writable = [\"MHR1..MHR1000\"]\n";
    let (mut live, dir) = recorded(BUSY, settings);
    let mut operator = Operator::new(&live);
    let status = operator.status();
    let mut clients = Noise::at(status["devices"]["modbus"]["address"].as_str().unwrap(), 6);
    let (faults, hold) = (live.folder.join("faults"), live.folder.join("faults.hold"));
    let lost = |status: &Value| status["record"]["lost"].as_u64().unwrap();
    fs::write(&hold, "").unwrap();
    fs::write(&faults, "record").unwrap();
    while faults.exists() {
        sleep(Duration::from_millis(1));
    }
    for _ in 0..WRITES_OF_A_STALL {
        std::thread::scope(|scope| {
            clients.iter_mut().for_each(|client| drop(scope.spawn(|| client.write())));
        });
        assert_eq!(operator.status()["mode"], "RUN");
    }
    fs::remove_file(&hold).unwrap();
    operator.await_status(|status| lost(status) > 0);
    // After the stall, the recording has a state once a second.
    let seen = lost(&operator.status());
    operator.await_scans(1_500);
    let status = operator.status();
    let (scans, lost) = (status["scans"].as_u64().unwrap(), lost(&status));
    let asked = Instant::now();
    let lines = ended(&mut live);
    let is_late = is_late(asked);
    let told = lines.iter().filter(|line| line["event"] == "record-lost");
    let told: Vec<u64> = told.map(|line| line["steps"].as_u64().unwrap()).collect();
    assert!(lost >= seen && told.iter().sum::<u64>() == lost, "{told:?} of {lost}");
    assert!(told.len() < 10, "a line for each stretch that is lost: {told:?}");
    let verified = verified(&dir, false);
    let recording = Recording::open(&dir).unwrap();
    let bodies = (0..recording.count()).map(|at| recording.read(at).unwrap().unwrap().1);
    assert_eq!(bodies.map(|body| body.lost).sum::<u64>(), lost);
    assert!(verified.gaps >= 1 && (is_late || last_scan(&recording) >= scans), "{verified:?}");
    let path = dir.to_str().unwrap();
    let gap = match told[0] {
        1 => "a gap: 1 scan is lost".to_owned(),
        steps => format!("a gap: {steps} scans are lost"),
    };
    assert!(rungd(&["record", "list", path]).contains(&gap), "{gap}");
    assert!(rungd(&["record", "info", path]).contains(&gap), "{gap}");
    let replayed = rungd(&["replay", path]);
    assert!(replayed.contains(" gap") && replayed.contains(" step"), "{replayed}");
}
