//! Changed clocks. The wall clock steps ten years forward and back while rungd runs. The monotonic
//! clock counts from a different origin. No scan is missed.
//!
//! A small library (`support/wall_clock.c`) steps the wall clock for the process alone. It adds an
//! offset from a file to the wall clock and leaves every other clock as it is. The C compiler that
//! links Rust programs builds it. The library cannot show that no wait depends on the wall clock; a
//! second test shows that with `strace`. A time namespace shifts the monotonic clock.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use rungd_test_support::needs::{self, usable};
use rungd_test_support::running::process::{
    BLINKS, Need, Plant, Running, find, no_scan_missed, not_installed, skip,
};
use serde_json::Value;

const PERIOD: Duration = Duration::from_millis(2);
const CONTROLLER: &str = "scan.period = \"2ms\"\n";

/// Builds the library; `None` without a C compiler.
pub fn library(folder: &Path) -> Option<PathBuf> {
    let library = folder.join("wall_clock.so");
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/support/wall_clock.c");
    let mut cc = Command::new("cc");
    cc.args(["-O1", "-shared", "-fPIC", "-o"]).arg(&library).arg(source);
    cc.status().is_ok_and(|status| status.success()).then_some(library)
}

/// The year in which a line was logged.
fn year(line: &Value) -> i32 {
    line["timestamp"].as_str().unwrap()[..4].parse().unwrap()
}

#[test]
fn a_step_of_the_wall_clock_by_ten_years_disturbs_no_scan() {
    let plant = Plant::new(BLINKS, CONTROLLER);
    let Some(library) = library(&plant.0) else { return not_installed("cc") };
    let offset = plant.0.join("offset");
    let step = |days: i64| {
        let file = File::options().create(true).write(true).truncate(false).open(&offset).unwrap();
        file.write_all_at(&(days * 86_400).to_ne_bytes(), 0).unwrap();
    };
    step(0);
    let mut command = plant.command(&[] as &[&str]);
    command.env("LD_PRELOAD", library).env("WALL_CLOCK_OFFSET_FILE", &offset);
    let mut running = Running::new(&mut command);
    let today = year(&running.line("RUN: scanning"));
    let mut lines = Vec::new();
    for (by, years) in [(3653, 10), (-3653, -10), (0, 0)] {
        step(by);
        // Waits until the log's timestamps show the step. (Near a New Year the year may differ by
        // one.)
        loop {
            let line = running.line("lamp is");
            let is = year(&line) - today;
            lines.push(line);
            if (is - years).abs() <= 1 {
                break;
            }
        }
        std::thread::sleep(Duration::from_millis(700));
    }
    lines.extend(running.stop());
    no_scan_missed(&lines, PERIOD, Duration::from_millis(2000));
}

#[test]
fn no_wait_depends_on_the_wall_clock() {
    let plant = Plant::new(BLINKS, CONTROLLER);
    let trace = plant.0.join("trace");
    let calls = "trace=clock_nanosleep,nanosleep,futex,timerfd_create,timerfd_settime,timer_create,\
                 setitimer,alarm";
    let strace = ["strace", "-f", "-qq", "-e", calls, "-o", trace.to_str().unwrap()];
    if !usable(needs::strace(Path::new("strace"))) {
        return;
    }
    let mut running = Running::new(plant.command(&strace).args(["--scans", "100"]));
    assert_eq!(running.end().code(), Some(0));
    let trace = std::fs::read_to_string(trace).unwrap();
    assert!(trace.matches("clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME").count() >= 90);
    let words = ["CLOCK_REALTIME", "timer_create", "setitimer", "alarm("];
    let wall: Vec<_> = trace.lines().filter(|l| words.iter().any(|w| l.contains(w))).collect();
    // std's plain sleep names the wall clock and waits for a relative time: a step does not affect
    // it. Nor does a step affect a wait without a limit, as for a thread's end.
    let untouched = |l: &&&str| l.contains("CLOCK_REALTIME, 0,") || l.contains(", NULL, ");
    let absolute: Vec<_> = wall.iter().filter(|l| !untouched(l)).collect();
    assert!(absolute.is_empty(), "{absolute:#?}");
}

/// Runs 600 scans with the monotonic clock shifted by this number of seconds.
fn shifted(by_s: i64) -> Option<Vec<Value>> {
    let by = [format!("--monotonic={by_s}"), format!("--boottime={by_s}")];
    let prefix = |user: bool| {
        let user: &[&str] = if user { &["--user", "--map-root-user"] } else { &[] };
        let words = ["unshare", "--time"].iter().chain(user).map(|word| (*word).to_owned());
        words.chain(by.clone()).chain(["--fork".to_owned()]).collect::<Vec<_>>()
    };
    let works = |words: &Vec<String>| {
        let mut command = Command::new(&words[0]);
        let done = command.args(&words[1..]).arg("true").stderr(Stdio::null()).status();
        done.is_ok_and(|status| status.success())
    };
    let prefix = [prefix(false), prefix(true)].into_iter().find(works)?;
    let plant = Plant::new(BLINKS, CONTROLLER);
    let mut running = Running::new(plant.command(&prefix).args(["--scans", "600"]));
    let lines = running.rest();
    assert_eq!(running.end().code(), Some(0), "{lines:#?}");
    Some(lines)
}

#[test]
fn the_monotonic_clock_may_start_at_any_value() {
    let uptime = std::fs::read_to_string("/proc/uptime").unwrap();
    let uptime: i64 = uptime.split('.').next().unwrap().parse().unwrap();
    // Ten years ahead; at 2^32 s; and almost at zero.
    for by_s in [10 * 365 * 86_400, (1 << 32) - uptime, 1 - uptime] {
        let Some(lines) = shifted(by_s) else {
            return skip(Need::TimeNamespace, "no time namespace to be had");
        };
        assert_eq!(find(&lines, "scan statistics of the whole run")["scans"], 600);
        no_scan_missed(&lines, PERIOD, Duration::from_millis(1190));
    }
}
