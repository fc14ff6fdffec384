//! The real rungd is killed at random times while it records. The folder can be read and verified,
//! reaches almost to the kill, and the next start adds files without touching the old ones.
//!
//! ```console
//! cargo test --release --test commands record::live_crash -- --ignored --nocapture
//! ```

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::record::drawn::Numbers;
use crate::record::live_rig::{BUSY, FAST, Operator, last_scan, logs, recorded_run, verified};
use rungd_history::record::Recording;
use rungd_test_support::disk_pace::DiskPace;
use rungd_test_support::metronome::{self, HeldUp};
use rungd_test_support::modbus::Client;
use rungd_test_support::running::live::{Live, folder};

/// The time that may be missing after a kill, in addition to the time for which the machine delayed
/// the threads of the process and its disk.
const LOST_MAX: Duration = Duration::from_secs(2);
/// The period of [`FAST`].
const PERIOD: Duration = Duration::from_millis(2);

/// The contents of each file.
fn contents(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    logs(dir).into_iter().map(|path| (path.clone(), fs::read(&path).unwrap())).collect()
}

/// The last recorded scan of the newest process.
fn reached(dir: &Path) -> u64 {
    let recording = Recording::open(dir).unwrap();
    let newest = logs(dir).pop().expect("there is a file");
    let of_newest = Recording::open(&newest).unwrap();
    assert!(recording.count() >= of_newest.count());
    last_scan(&of_newest)
}

/// Starts a process and kills it after a random time. Returns the number of lost scans.
fn one(home: &Path, dir: &Path, numbers: &mut Numbers) -> u64 {
    let before = contents(dir);
    metronome::begin();
    let mut live = Live::of(home.to_owned(), recorded_run(home, dir));
    let (pid, disk) = (live.child.id(), DiskPace::start(home));
    let process = HeldUp::of(pid);
    let mut operator = Operator::new(&live);
    let status = operator.status();
    let mut modbus = Client::connect(status["devices"]["modbus"]["address"].as_str().unwrap());
    let (begin, time) = (Instant::now(), Duration::from_millis(numbers.below(4000)));
    while begin.elapsed() < time {
        modbus.ask(1, &[6, 0, 0, 0, numbers.below(200) as u8]);
    }
    let told = operator.scans();
    let process = HeldUp::of(pid).since(&process);
    live.child.kill().unwrap();
    live.child.wait().unwrap();
    let after = contents(dir);
    let is_kept = before.iter().all(|(path, bytes)| after.get(path) == Some(bytes));
    assert!(is_kept, "a file of an earlier process was touched");
    let verified = verified(dir, false);
    let held_up = metronome::held_up_within(begin.elapsed()) + process + disk.slowest();
    // The kill may come before the end of the first block.
    let end = if after.len() > before.len() { reached(dir) } else { 0 };
    let lost = told.saturating_sub(end);
    let allowed = (LOST_MAX + 2 * held_up).as_millis() / PERIOD.as_millis();
    assert!(u128::from(lost) <= allowed, "{lost} scans of {told} are missing: {verified:?}");
    // Dropping `live` must not remove the folder: the next process uses it.
    live.folder = PathBuf::from("/nonexistent");
    lost
}

fn kills(count: usize, seed: u64) {
    let (home, mut numbers, begin) = (folder(BUSY, FAST), Numbers(seed), Instant::now());
    let dir = home.join("log");
    let lost: Vec<u64> = (0..count).map(|_| one(&home, &dir, &mut numbers)).collect();
    let recording = Recording::open(&dir).unwrap();
    let most = lost.iter().max().copied().unwrap_or(0) * PERIOD.as_millis() as u64;
    println!(
        "{count} kills: {} files, {} sections, {} torn ends; at most {most} ms lost; {:.0} s",
        logs(&dir).len(),
        recording.count(),
        recording.flaws.len(),
        begin.elapsed().as_secs_f64()
    );
    fs::remove_dir_all(&home).unwrap();
}

#[test]
fn a_killed_controller_loses_only_the_last_moment_of_its_recording() {
    kills(3, 1);
}

#[test]
#[ignore = "three minutes"]
fn each_of_45_kills_loses_only_the_last_moment_of_the_recording() {
    kills(45, 2);
}
