//! The readers of the log of `rungd run`: people, systemd, or no reader. Tests the forms and level
//! of the log, a log that is not read, and the page that lists the log lines.

use std::io::{BufRead as _, BufReader};
use std::process::Command;
use std::sync::mpsc::channel;
use std::time::Duration;

use crate::daemon::bottling::{ALIVE, PATIENCE, Plant, Running, find, message};
use serde_json::Value;

#[test]
fn text_log_lines_have_a_level_and_no_escape_codes() {
    let plant = Plant::new(ALIVE, "");
    let output = plant.command(&["--scans", "3", "--log-level", "debug"]).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(
        text.contains("  INFO RUNGD-0201 mode-run: RUN: scanning every 10ms scan=0\n"),
        "{text}"
    );
    assert!(text.contains("Program Main had its termination pass block=Main scan=3\n"), "{text}");
    assert!(!text.contains('\u{1b}'), "{text}");
}

#[test]
fn the_environment_can_set_the_log_level() {
    let plant = Plant::new(ALIVE, "");
    let quiet = plant.command(&["--scans", "3"]).env("RUNGD_LOG", "error").output().unwrap();
    assert_eq!((quiet.status.code(), quiet.stderr.len()), (Some(0), 0));
    let wrong = plant.command(&["--scans", "3"]).env("RUNGD_LOG", "loud").output().unwrap();
    assert_eq!(wrong.status.code(), Some(78));
}

#[test]
fn systemd_is_notified_of_ready_watchdog_status_and_stopping() {
    let plant = Plant::new(ALIVE, "");
    let socket_path = plant.0.join("notify");
    let socket = std::os::unix::net::UnixDatagram::bind(&socket_path).unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut command = plant.command(&["--log-format", "json"]);
    command.env("NOTIFY_SOCKET", &socket_path).env("WATCHDOG_USEC", "200000");
    let mut running = Running::new(&mut command);
    let heard = |wanted: &str| {
        let mut bytes = [0; 512];
        loop {
            let length = socket.recv(&mut bytes).unwrap_or_else(|_| panic!("no {wanted}"));
            let text = String::from_utf8_lossy(&bytes[..length]).into_owned();
            if text.contains(wanted) {
                return text;
            }
        }
    };
    heard("READY=1");
    heard("WATCHDOG=1");
    heard("STATUS=RUN, ");
    heard("WATCHDOG=1");
    running.signal("TERM");
    heard("STOPPING=1");
    assert_eq!(running.end().code(), Some(0));
}

/// With a watchdog of systemd that is too short, systemd kills the process before a long scan
/// becomes a FAULT.
#[test]
fn a_scan_watchdog_longer_than_that_of_systemd_is_reported_at_the_start() {
    for (watchdog, said) in [("300ms", None), ("310ms", Some("it is a fault, and no output"))] {
        let plant = Plant::new(ALIVE, &format!("scan.watchdog = \"{watchdog}\"\n"));
        let mut command = plant.command(&["--log-format", "json", "--scans", "3"]);
        let output = command.env("WATCHDOG_USEC", "400000").output().unwrap();
        let log = String::from_utf8_lossy(&output.stderr);
        let line = log.lines().find(|line| line.contains("\"fault-too-late\""));
        assert_eq!(line.map(|line| line.contains(said.unwrap_or_default())), said.map(|_| true));
    }
}

#[test]
fn an_unresponsive_systemd_does_not_block_the_controller() {
    let plant = Plant::new(ALIVE, "scan.period = \"2ms\"\n");
    let socket_path = plant.0.join("notify");
    let socket = std::os::unix::net::UnixDatagram::bind(&socket_path).unwrap();
    // Fills the socket up to the machine's limit.
    let filler = std::os::unix::net::UnixDatagram::unbound().unwrap();
    filler.set_nonblocking(true).unwrap();
    while filler.send_to(b"STATUS=full", &socket_path).is_ok() {}
    let mut command = plant.command(&["--log-format", "json"]);
    command.env("NOTIFY_SOCKET", &socket_path).env("WATCHDOG_USEC", "40000");
    let mut running = Running::new(&mut command);
    running.line("lamp is ON");
    std::thread::sleep(Duration::from_millis(300));
    running.signal("TERM");
    assert_eq!(running.end().code(), Some(0));
    drop(socket);
}

#[test]
fn findings_that_cannot_be_printed_do_not_change_the_exit_code() {
    let plant = Plant::new("[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"OUTT Y0\"]\n", "");
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    assert_eq!(plant.command(&[]).stderr(full).status().unwrap().code(), Some(78));
}

#[test]
fn an_unread_log_delays_no_scan() {
    unread_log(Duration::from_secs(4));
}

/// `cargo test --test controller thirty_seconds -- --ignored --nocapture`
#[test]
#[ignore = "takes 30 seconds"]
fn a_log_unread_for_thirty_seconds_delays_no_scan() {
    unread_log(Duration::from_secs(30));
}

/// Runs at 1 ms with an unread log; every grid point must be accounted for.
fn unread_log(unread: Duration) {
    // Tasks that complete in every second scan and log their passes: many thousand lines per
    // second.
    let mut rungs = String::from("[[program.rung]]\nwhen = [\"$ScanToggle\"]\ndo = [\"OUT C0\"");
    let tasks: Vec<String> = (0..16).map(|n| format!("Job-{n}")).collect();
    rungs.extend(tasks.iter().map(|task| format!(", \"ENTASK {task}\"")));
    rungs += "]\n";
    for task in &tasks {
        rungs += &format!("[[task]]\nname = \"{task}\"\n");
        rungs += "rung = [ { when = [\"$On\"], do = [\"SET lamp\"] } ]\n";
    }
    let plant = Plant::new(&rungs, "scan.period = \"1ms\"\nlog.statistics = \"0ms\"\n");
    let mut command = plant.command(&["--log-level", "trace", "--log-format", "json"]);
    let mut child = command.spawn().unwrap();
    std::thread::sleep(unread);
    // The reader catches up before the stop, because the stop waits at most a second for the log.
    // The number of dropped lines is logged when there is room again.
    let log = BufReader::new(child.stderr.take().unwrap());
    let (caught_up, has_caught_up) = channel();
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        for line in log.lines() {
            let line = line?;
            if line.contains("log lines were dropped") {
                let _ = caught_up.send(());
            }
            text += &line;
            text.push('\n');
        }
        Ok::<String, std::io::Error>(text)
    });
    has_caught_up.recv_timeout(PATIENCE).expect("lines are dropped, and that is told");
    assert!(Command::new("kill").arg(child.id().to_string()).status().unwrap().success());
    let text = reader.join().unwrap().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let lines: Vec<Value> = text.lines().map(|l| serde_json::from_str(l).expect(l)).collect();
    let sum = |words: &str, field: &str| -> u64 {
        let told = lines.iter().filter(|line| message(line).contains(words));
        told.map(|line| line[field].as_u64().unwrap()).sum()
    };
    let whole = find(&lines, "scan statistics of the whole run");
    let number = |field: &str| whole[field].as_u64().unwrap();
    let (scans, skipped) = (number("scans"), number("skipped"));
    // One grid point per millisecond from the start of RUN to the last scan, including both.
    let us = |field: &str| whole[field].as_f64().unwrap();
    let points = ((us("over_us") - us("late_us_last")) / 1000.0).round() as u64 + 1;
    let dropped = (sum("log lines were dropped", "lines"), sum("records of the", "records"));
    let (lines, records) = dropped;
    println!(
        "{scans} scans + {skipped} skipped = {} of {points} grid points; dropped: {lines} lines, \
         {records} records",
        scans + skipped
    );
    assert!(lines > 100, "lines are dropped, and counted: {lines}");
    assert_eq!(scans + skipped, points, "{whole}");
}

/// The part of a fenced block of the page from this line on.
fn fenced<'a>(page: &'a str, first: &str) -> &'a str {
    let at = page.find(first).unwrap_or_else(|| panic!("no `{first}`"));
    page[at..].split("```").next().unwrap()
}

/// A line of the log without the parts that differ from run to run: numbers and hashes.
fn masked(line: &str) -> String {
    let words = line.split_whitespace().skip(1).map(|word| match word.split_once('=') {
        Some(("sha256", _)) => "sha256".to_owned(),
        _ => word.chars().filter(|c| !c.is_ascii_digit() && *c != '.').collect(),
    });
    words.collect::<Vec<_>>().join(" ").replace("after ms", "after s").replace("run, ms", "run, s")
}

#[test]
fn the_page_shows_the_logged_lines() {
    let page = include_str!("../../docs/running.md");
    let plant = Plant::new(ALIVE, "");
    for file in ["gate.toml", "gate-controller.toml"] {
        let text = fenced(page, &format!("# {file}"));
        std::fs::write(plant.0.join(file), text).unwrap();
    }
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.current_dir(&plant.0).args(["run", "gate-controller.toml", "--scans", "32"]);
    command.env_remove("RUNGD_LOG").env_remove("JOURNAL_STREAM");
    let output = command.output().unwrap();
    let logged = String::from_utf8(output.stderr).unwrap();
    let logged: Vec<_> = logged.lines().map(masked).collect();
    for line in fenced(page, "2026-").lines() {
        assert!(logged.contains(&masked(line)), "{line}\nnot in\n{}", logged.join("\n"));
    }
    let output = command.args(["--log-format", "json"]).output().unwrap();
    let without_time = |line: &str| {
        let mut value: Value = serde_json::from_str(line).expect(line);
        (value["timestamp"], value["scan"]) = (Value::Null, Value::Null);
        value
    };
    let logged = String::from_utf8(output.stderr).unwrap();
    let shown = without_time(fenced(page, "{\"timestamp\""));
    assert!(logged.lines().map(without_time).any(|line| line == shown), "{shown} not in\n{logged}");
}
