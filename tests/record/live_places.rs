//! The folders to which the real rungd records, how much it keeps there, and who may read the
//! recording in memory.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::Instant;

use serde_json::json;

use crate::record::drawn::Numbers;
use crate::record::line::{Line, in_memory};
use crate::record::live_rig::{
    BUSY, FAST, Operator, ended, is_late, last_scan, logs, recorded_run, verified,
};
use rungd_history::record::{RecordBlock, Recording};
use rungd_test_support::modbus::Client;
use rungd_test_support::needs::{Need, skip};
use rungd_test_support::running::live::{Live, Said, folder, run, said};
use rungd_test_support::running::process::until;

fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

/// Runs a few scans, with these additional arguments.
fn scanned(home: &Path, words: &[&str], variable: Option<&Path>) {
    let mut command = run(home, words);
    command.args(["--scans", "5"]).env_remove("RUNGD_RECORD").current_dir("/");
    variable.map(|dir| command.env("RUNGD_RECORD", dir));
    let said = said(&mut command);
    assert_eq!(said.code, 0, "{said:?}");
}

#[test]
fn recording_on_disk_is_off_by_default() {
    let home = folder(BUSY, "");
    scanned(&home, &[], None);
    assert_eq!(files(&home), ["controller.toml", "ladder.toml", "s.lock"]);
    fs::remove_dir_all(&home).unwrap();
}

#[test]
fn the_command_line_and_the_environment_name_a_folder() {
    let home = folder(BUSY, "");
    let (one, other) = (home.join("one"), home.join("other"));
    scanned(&home, &["--record", one.to_str().unwrap()], Some(&other));
    assert_eq!((logs(&one).len(), logs(&other).len()), (1, 0));
    scanned(&home, &[], Some(&other));
    assert_eq!((logs(&one).len(), logs(&other).len()), (1, 1));
    assert_eq!(verified(&other, false).scans, 5);
    fs::remove_dir_all(&home).unwrap();
}

#[test]
fn a_controller_file_names_a_folder_beside_itself() {
    let home = folder(BUSY, "[record]\ndir = \"deep/log\"\n");
    let asked = home.join("asked");
    scanned(&home, &["--record", asked.to_str().unwrap()], None);
    assert_eq!(logs(&home.join("deep/log")).len(), 1);
    assert!(!asked.exists(), "the controller file's folder comes first");
    fs::remove_dir_all(&home).unwrap();
}

#[test]
fn recording_switched_off_leaves_nothing_on_disk() {
    let home = folder(BUSY, "[record]\nenabled = false\ndir = \"log\"\n");
    let asked = home.join("asked");
    scanned(&home, &["--record", asked.to_str().unwrap()], Some(&asked));
    assert_eq!(files(&home), ["controller.toml", "ladder.toml", "s.lock"]);
    fs::remove_dir_all(&home).unwrap();
}

/// A client that writes random values.
pub struct Noise {
    client: Client,
    numbers: Numbers,
}

impl Noise {
    /// Several of these clients at a controller.
    pub fn at(address: &str, count: u64) -> Vec<Noise> {
        let noise = |at| Noise { client: Client::connect(address), numbers: Numbers(at) };
        (0..count).map(noise).collect()
    }

    /// Sends a few requests, each with the most registers that a request may write.
    pub fn write(&mut self) {
        for at in 0..8 {
            let [high, low] = (at * 123_u16).to_be_bytes();
            let mut pdu = vec![16, high, low, 0, 123, 246];
            pdu.extend((0..246).map(|_| self.numbers.below(256) as u8));
            // On a busy machine a request may time out before a scan takes it; the server then
            // reports that.
            until(|| match self.client.ask(1, &pdu)[0] {
                16 => true,
                0x90 => false,
                other => panic!("{other}"),
            });
        }
    }
}

#[test]
fn the_oldest_files_are_deleted_first_and_foreign_files_are_kept() {
    const SIZE: u64 = 1_000_000;
    let settings = "[scan]\nperiod = \"2ms\"\n[record]\ndir = \"log\"\nsize = \"1MB\"\n\
                    [modbus-server]\nlisten = \"127.0.0.1:0\"\nwritable = [\"MHR1..MHR1000\"]\n";
    let home = folder(BUSY, settings);
    let dir = home.join("log");
    fs::create_dir(&dir).unwrap();
    let foreign = ["notes.txt", "other-20200101T000000Z-000000.rungd-log", "controller.rungd-log"];
    foreign.iter().for_each(|name| fs::write(dir.join(name), "mine").unwrap());
    // An old file of this controller.
    let old = dir.join("controller-20200101T000000Z-000000.rungd-log");
    fs::write(&old, "old").unwrap();
    let mut live = Live::of(home.clone(), run(&home, &[]));
    let status = Operator::new(&live).status();
    let address = status["devices"]["modbus"]["address"].as_str().unwrap();
    let mut clients = Noise::at(address, 6);
    let own = || {
        let own =
            |path: &PathBuf| path.file_name().unwrap().to_str().unwrap().starts_with("controller-");
        logs(&dir).into_iter().filter(own).collect::<Vec<_>>()
    };
    let (mut first, mut removed) = (None, 0);
    // Megabytes of random data within seconds.
    while removed < 3 {
        thread::scope(|scope| {
            clients.iter_mut().for_each(|client| drop(scope.spawn(|| client.write())))
        });
        let oldest = own().first().cloned();
        removed += u64::from(first.is_some() && oldest != first);
        first = oldest;
        let bytes: u64 =
            own().iter().filter_map(|path| fs::metadata(path).ok()).map(|of| of.len()).sum();
        assert!(bytes <= SIZE, "{bytes}");
    }
    // A new connection, because rungd closes a silent one.
    let mut operator = Operator::new(&live);
    let disk = operator.status()["record"]["disk"].clone();
    assert!(disk["bytes"].as_u64().unwrap() <= SIZE && disk["size"] == SIZE, "{disk}");
    let scans = operator.scans();
    let said = ended(&mut live);
    assert!(!old.exists());
    for name in foreign {
        assert_eq!(fs::read(dir.join(name)).unwrap(), b"mine", "{name}");
        fs::remove_file(dir.join(name)).unwrap();
    }
    verified(&dir, false);
    let recording = Recording::open(&dir).unwrap();
    let (first, last) = (recording.head(0).number, last_scan(&recording));
    let lost: u64 = said.iter().filter_map(|line| line["steps"].as_u64()).sum();
    // At its end rungd waits only seconds for the disk.
    let is_late = said.iter().any(|line| line["event"] == "record-failed");
    assert!(first > 1, "the first scan is still there");
    assert!(is_late || last + lost >= scans, "{first} to {last} of {scans}: {said:#?}");
}

#[test]
fn files_older_than_the_limit_are_deleted() {
    let home = folder(BUSY, &format!("{FAST}[record]\ndir = \"log\"\nkeep = \"1m\"\n"));
    let dir = home.join("log");
    fs::create_dir(&dir).unwrap();
    let name = |year| dir.join(format!("controller-{year}0101T000000Z-000000.rungd-log"));
    let more_than_a_minute = in_memory(&blocks_of(70));
    for year in [2020, 2021] {
        fs::write(name(year), &more_than_a_minute).unwrap();
    }
    scanned(&home, &[], None);
    assert!(!name(2020).exists(), "more than a minute was recorded after it");
    assert!(name(2021).exists(), "no minute was recorded after it");
    assert!(logs(&dir).len() <= 2 && verified_new(&dir) == 5);
    fs::remove_dir_all(&home).unwrap();
}

/// Blocks of a second each.
fn blocks_of(seconds: usize) -> Vec<RecordBlock> {
    let mut line = Line::new(BUSY);
    line.start();
    for _ in 0..seconds {
        line.scan(1_000_000_000, |_| {});
        line.flush();
    }
    line.blocks
}

/// The number of scans in the newest file.
fn verified_new(dir: &Path) -> u64 {
    verified(logs(dir).last().unwrap(), false).scans
}

/// Runs `rungd why Y0` as a user with read-only access.
fn why_as_nobody(live: &Live) -> Said {
    // The build's folder may be readable only by root, so the program is copied. A separate process
    // copies it, so that no child of a different test has the copy open for writing when it starts.
    let copy = live.folder.join("rungd");
    let words = [env!("CARGO_BIN_EXE_rungd").as_ref(), copy.as_os_str()];
    assert!(Command::new("cp").args(words).status().unwrap().success());
    let mut command = Command::new(copy);
    command.args(["why", "Y0"]).env("RUNGD_SOCKET", &live.socket).current_dir("/");
    said(command.uid(65_534).gid(65_534))
}

/// Needs root, to become a different user.
#[test]
fn a_view_only_user_gets_the_recording_of_a_world_readable_ladder() {
    if Command::new("id").arg("-u").output().unwrap().stdout != b"0\n" {
        return skip(Need::Root, "only root becomes another user");
    }
    const OPEN: &str = "[operator]\nsocket = \"s\"\nmode = \"0666\"\n";
    for (ladder, controller, is_public) in
        [(0o644, 0o644, true), (0o640, 0o644, false), (0o604, 0o644, true), (0o644, 0o640, false)]
    {
        let home = folder(BUSY, OPEN);
        fs::set_permissions(&home, fs::Permissions::from_mode(0o755)).unwrap();
        let modes = [("ladder.toml", ladder), ("controller.toml", controller)];
        for (name, mode) in modes {
            fs::set_permissions(home.join(name), fs::Permissions::from_mode(mode)).unwrap();
        }
        let live = Live::of(home.clone(), recorded_run(&home, &home.join("log")));
        let said = why_as_nobody(&live);
        let told = format!("{ladder:o} {controller:o}: {said:?}");
        assert_eq!(said.code, if is_public { 0 } else { 77 }, "{told}");
        let refusal = "may only look, and a recording contains the ladder's files";
        assert_eq!(said.err.contains(refusal), !is_public, "{told}");
        // A user with full access always receives the recording.
        let answer = Operator::new(&live).ask(&json!({"do": "recording"}));
        assert!(answer["ok"]["base64"].is_string(), "{answer:.200}");
    }
}

#[test]
fn frequent_requests_do_not_make_small_blocks() {
    let home = folder(BUSY, FAST);
    let dir = home.join("log");
    let mut live = Live::of(home.clone(), recorded_run(&home, &dir));
    let (mut operator, begun) = (Operator::new(&live), Instant::now());
    for _ in 0..300 {
        // On a busy machine a recording may come too late; the answer then reports that.
        until(|| operator.ask(&json!({"do": "recording"}))["ok"]["base64"].is_string());
        operator.await_scans(1);
    }
    let since = Instant::now();
    let scans = operator.scans();
    ended(&mut live);
    let (is_late, lasted_s) = (is_late(since), begun.elapsed().as_secs());
    let recording = Recording::open(&dir).unwrap();
    // One block per second, and a few at the ends.
    let (count, most) = (recording.count() as u64, lasted_s + 5);
    assert!(count <= most, "{count} in {lasted_s} s");
    assert!(verified(&dir, false).scans >= scans || is_late);
}
