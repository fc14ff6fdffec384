//! A full disk under the log: lines are lost and counted, and no scan is lost.

use std::fs::File;
use std::io::Read;
use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

use rungd_test_support::metronome::{self, HeldUp};
use rungd_test_support::running::process::{
    BLINKS, Need, PATIENCE, Plant, Running, WHOLE_RUN, find, message, mounted, no_scan_missed,
    note_held_up, skip,
};
use serde_json::Value;

const PERIOD: Duration = Duration::from_millis(2);
const CONTROLLER: &str = "scan.period = \"2ms\"\n";

/// The whole lines of a log. The line at which the disk became full may be incomplete.
fn whole_lines(text: &str) -> Vec<Value> {
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

#[test]
fn a_full_disk_loses_log_lines_and_logging_resumes_with_space() {
    let plant = Plant::new(BLINKS, CONTROLLER);
    let disk = plant.0.join("disk");
    std::fs::create_dir(&disk).unwrap();
    let disk = disk.display();
    let shell = format!("mount -t tmpfs -o size=4k tmpfs {disk} && exec \"$@\" 2>>{disk}/log");
    let Some(prefix) = mounted(&shell) else {
        return skip(Need::MountNamespace, "no mount namespace to be had");
    };
    let mut running = Running::new(plant.command(&prefix).stderr(Stdio::null()));
    // The log's path as seen from outside the process's mount namespace.
    let seen = PathBuf::from(format!("/proc/{}/root{disk}/log", running.pid()));
    let size = || std::fs::metadata(&seen).map_or(0, |log| log.len());
    let since = Instant::now();
    while size() < 4096 {
        assert!(since.elapsed() < PATIENCE, "the disk does not become full: {}", size());
        std::thread::sleep(Duration::from_millis(10));
    }
    std::thread::sleep(Duration::from_millis(1500));
    assert_eq!((size(), running.child.try_wait().unwrap()), (4096, None));
    let mut log = File::options().read(true).write(true).open(&seen).unwrap();
    let mut before = String::new();
    log.read_to_string(&mut before).unwrap();
    log.set_len(0).unwrap();
    let held_up = HeldUp::of(running.child.id()).since(&HeldUp::default());
    // The next line is due within 100 ms, and a page of disk is free for the last lines.
    running.signal("TERM");
    assert_eq!(running.end().code(), Some(0));
    std::io::Seek::rewind(&mut log).unwrap();
    let mut after = String::new();
    log.read_to_string(&mut after).unwrap();
    let mut lines = [whole_lines(&before), whole_lines(&after)].concat();
    let whole = lines.iter_mut().find(|line| message(line).contains(WHOLE_RUN));
    note_held_up(whole.expect("the last statistics"), held_up);
    let dropped = find(&lines, "log lines were dropped");
    assert!(dropped["lines"].as_u64().unwrap() > 5, "{dropped}");
    no_scan_missed(&lines, PERIOD, Duration::from_millis(1500));
}

#[test]
fn an_unwritable_log_delays_no_scan() {
    let plant = Plant::new(BLINKS, CONTROLLER);
    let (socket, path) = plant.notify();
    let full = File::options().write(true).open("/dev/full").unwrap();
    let mut command = plant.command(&[] as &[&str]);
    command.stderr(full).env("NOTIFY_SOCKET", path);
    let mut running = Running::new(&mut command);
    // Only the status that systemd receives is left to observe.
    let scans = || loop {
        let mut bytes = [0; 512];
        let length = socket.recv(&mut bytes).unwrap();
        let text = String::from_utf8_lossy(&bytes[..length]).into_owned();
        if let Some(text) = text.strip_prefix("STATUS=RUN, ") {
            return (text.split(' ').next().unwrap().parse::<u64>().unwrap(), Instant::now());
        }
    };
    let before = HeldUp::of(running.child.id());
    let (first, begin) = scans();
    let (_, _) = scans();
    let (last, end) = scans();
    let held_up = HeldUp::of(running.child.id()).since(&before);
    let points = (end - begin).as_millis() as u64 / 2;
    let taken = held_up.max(metronome::taken_within(begin.elapsed()));
    // With the scan's own time, a delay of 1 ms makes a scan of a period of 2 ms miss its end.
    let excused = taken.as_millis() as u64;
    let told = format!("{first} {last} {points}, held up for {held_up:?}, excused {excused}");
    // A status message needs some time to arrive.
    assert!(last - first <= points + 50 + excused, "{told}");
    assert!(last - first + 50 + excused >= points, "{told}");
    running.signal("TERM");
    assert_eq!(running.end().code(), Some(0));
}

#[test]
fn a_closed_standard_error_delays_no_scan() {
    let plant = Plant::new(BLINKS, CONTROLLER);
    let mut command = plant.command(&["sh", "-c", "exec \"$@\" 2>&-", "sh"]);
    let mut running = Running::new(command.args(["--scans", "200"]));
    assert_eq!(running.end().code(), Some(0));
    assert!(running.rest().iter().all(|line| message(line).is_empty()));
}
