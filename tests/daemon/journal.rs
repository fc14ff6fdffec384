//! The log in the systemd journal: the real binary, with a socket in journald's place.

use rungd_test_support::calm::calm;
use rungd_test_support::journal;
use std::fs;
use std::io::Read;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rungd_runtime::events;
use rungd_test_support::journal::FakeJournal;
use rungd_test_support::running::process::PATIENCE;

const LADDER: &str = r#"
[ladder]
name = "bottling"
[tags]
jam = { at = "C0", alarm = "Bottles \"jammed\"" }
lamp = { at = "Y0", log = "change" }
[[program]]
name = "Main"
rung = [
  { when = ["$100ms"], do = ["OUT lamp"] },
  { when = ["$ScanCounter >= 10", "$ScanCounter < 40"], do = ["OUT jam"] },
]
"#;

/// `rungd run` of a plant in the folder; the log goes to the journal at the socket.
fn command(folder: &Path, socket: &Path, controller: &str, arguments: &[&str]) -> Command {
    fs::write(folder.join("ladder.toml"), LADDER).unwrap();
    let controller = calm(&format!("ladder = [\"ladder.toml\"]\n{controller}"));
    fs::write(folder.join("controller.toml"), controller).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.arg("run").arg(folder.join("controller.toml"));
    command.args(["--log-format", "journal", "--journal-socket"]).arg(socket).args(arguments);
    for name in ["RUNGD_LOG", "NOTIFY_SOCKET", "JOURNAL_STREAM"] {
        command.env_remove(name);
    }
    command.stderr(Stdio::piped()).stdout(Stdio::piped());
    command
}

#[test]
fn a_journal_entry_has_the_whole_line_and_each_field() {
    let journal = FakeJournal::new();
    let output = command(&journal.folder, &journal.socket(), "", &["--scans", "60"]);
    let output = { output }.output().unwrap();
    assert_eq!((output.status.code(), output.stderr), (Some(0), Vec::new()));
    journal.wait_for("process-end");
    let on = journal.wait_for("alarm-on");
    let message = "RUNGD-0301 alarm-on: alarm ON: Bottles \"jammed\" tag=jam scan=11";
    let expected = [
        ("MESSAGE", message),
        ("PRIORITY", "4"),
        ("SYSLOG_IDENTIFIER", "rungd"),
        ("MESSAGE_ID", events::named("alarm-on").unwrap().id),
        ("RUNGD_CODE", "RUNGD-0301"),
        ("RUNGD_EVENT", "alarm-on"),
        ("RUNGD_TAG", "jam"),
        ("RUNGD_SCAN", "11"),
    ];
    let expected = expected.map(|(name, value)| (name.to_owned(), value.to_owned()));
    assert_eq!(on, expected.into());
    let entries = journal.entries();
    for entry in &entries {
        let event = events::named(&entry["RUNGD_EVENT"]).expect("a row");
        let head = format!("{} {}: ", event.code(), event.name);
        assert!(entry["MESSAGE"].starts_with(&head), "{entry:?}");
    }
    assert_eq!(entries.last().unwrap()["RUNGD_EVENT"], "process-end");
    assert_eq!(journal.wait_for("posture")["RUNGD_GRANTED"], "timer slack 1 ns");
}

#[test]
fn lines_with_priorities_go_to_standard_error_without_a_journal() {
    let journal = FakeJournal::new();
    let nowhere = journal.folder.join("nowhere");
    let output = command(&journal.folder, &nowhere, "", &["--scans", "20"]).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.starts_with("<6>RUNGD-0001 process-start: rungd starts "), "{text}");
    assert!(text.contains("\n<4>RUNGD-0301 alarm-on: "), "{text}");
    assert!(text.lines().all(|line| line.starts_with('<')), "{text}");
}

#[test]
fn lines_go_to_standard_error_once_the_journal_is_gone() {
    let journal = FakeJournal::new();
    let socket = journal.folder.join("brief");
    let listener = UnixDatagram::bind(&socket).unwrap();
    let mut child = command(&journal.folder, &socket, "", &["--scans", "100"]).spawn().unwrap();
    let mut bytes = [0; 4096];
    listener.recv(&mut bytes).unwrap();
    drop(listener);
    fs::remove_file(&socket).unwrap();
    let mut text = String::new();
    child.stderr.take().unwrap().read_to_string(&mut text).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(text.contains("<6>RUNGD-0005 process-end: rungd ends "), "{text}");
}

/// Nobody reads the socket: scans continue, lines are dropped and counted, and the process ends on
/// time.
#[test]
fn a_frozen_journal_loses_lines_but_delays_no_scan() {
    let journal = FakeJournal::new();
    let path = journal.folder.join("frozen");
    let socket = UnixDatagram::bind(&path).unwrap();
    let controller = "scan.period = \"1ms\"\nscan.watchdog = \"10s\"\nlog.statistics = \"0ms\"\n";
    let mut ladder = String::new();
    for n in 0..16 {
        ladder += &format!("[[task]]\nname = \"Job-{n}\"\nrung = []\n");
    }
    let arguments = ["--log-level", "trace", "--scans", "4000"];
    let mut command = command(&journal.folder, &path, controller, &arguments);
    let calls: Vec<String> = (0..16).map(|n| format!("\"ENTASK Job-{n}\"")).collect();
    let when = "[\"$ScanToggle\", \"$ScanCounter < 1500\"]";
    let main = format!("  {{ when = {when}, do = [{}] }},\n]\n", calls.join(", "));
    let text = LADDER.trim_end().trim_end_matches(']').to_owned() + &main + &ladder;
    fs::write(journal.folder.join("ladder.toml"), text).unwrap();
    let mut child = command.spawn().unwrap();
    thread::sleep(Duration::from_secs(2));
    // The journal's socket is read again.
    let mut bytes = vec![0; 1 << 18];
    socket.set_read_timeout(Some(Duration::from_secs(2))).unwrap();
    let mut entries = Vec::new();
    let since = Instant::now();
    loop {
        // Everything that the process wrote is in the socket when it has ended.
        let is_over = child.try_wait().unwrap().is_some();
        match socket.recv(&mut bytes) {
            Ok(length) => entries.push(journal::fields(&bytes[..length])),
            Err(_) if is_over => break,
            Err(_) => {}
        }
        assert!(since.elapsed() < PATIENCE, "it does not end");
    }
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let of =
        |event: &'static str| entries.iter().filter(move |entry| entry["RUNGD_EVENT"] == event);
    let number = |entry: &journal::Fields, name: &str| entry[name].parse::<u64>().unwrap();
    let dropped: u64 = of("log-dropped").map(|entry| number(entry, "RUNGD_LINES")).sum();
    assert!(dropped > 100, "lines are dropped, and counted: {dropped}");
    let whole = of("statistics").next().expect("the last lines are told");
    let over = whole["RUNGD_OVER_US"].parse::<f64>().unwrap();
    let late = whole["RUNGD_LATE_US_LAST"].parse::<f64>().unwrap();
    let points = ((over - late) / 1000.0).round() as u64 + 1;
    assert_eq!(number(whole, "RUNGD_SCANS") + number(whole, "RUNGD_SKIPPED"), points, "{whole:?}");
}

#[test]
fn the_heartbeat_is_logged_in_run_and_in_stop() {
    let journal = FakeJournal::new();
    let controller = "scan.period = \"2ms\"\nlog.statistics = \"150ms\"\n";
    let mut command = command(&journal.folder, &journal.socket(), controller, &[]);
    let stop = "  { when = [\"$ScanCounter >= 150\"], do = [\"STOP\"] },\n]\n";
    let text = LADDER.trim_end().trim_end_matches(']').to_owned() + stop;
    fs::write(journal.folder.join("ladder.toml"), text).unwrap();
    let mut child = command.spawn().unwrap();
    let beats = |mode: &str, count: usize| {
        journal.wait_until(|entries| {
            let is = |entry: &&journal::Fields| {
                entry["RUNGD_EVENT"] == "heartbeat" && entry["RUNGD_MODE"] == mode
            };
            entries.iter().filter(is).count() >= count
        });
    };
    beats("RUN", 1);
    beats("STOP", 2);
    assert!(Command::new("kill").arg(child.id().to_string()).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let entries = journal.entries();
    let beat = entries.iter().rfind(|entry| entry["RUNGD_EVENT"] == "heartbeat").unwrap();
    for (field, value) in [("RUNGD_MODE", "STOP"), ("RUNGD_LOG_LOST", "0")] {
        assert_eq!(beat[field], value, "{beat:?}");
    }
    assert!(beat["RUNGD_SCANS"].parse::<u64>().unwrap() >= 150, "{beat:?}");
}

/// A hundred alarms may be logged at once. The others stay ON until the end and are logged then.
#[test]
fn an_active_alarm_not_yet_logged_is_logged_at_the_end() {
    let journal = FakeJournal::new();
    let mut command = command(&journal.folder, &journal.socket(), "", &["--scans", "4"]);
    let (mut tags, mut sets) = (String::from("[tags]\n"), Vec::new());
    for n in 0..150 {
        tags += &format!("alarm_{n} = {{ at = \"C{n}\", alarm = \"number {n}\" }}\n");
        sets.push(format!("\"SET alarm_{n}\""));
    }
    let rung = format!("rung = [ {{ when = [\"$On\"], do = [{}] }} ]\n", sets.join(", "));
    let text = format!("{tags}[[program]]\nname = \"Main\"\n{rung}");
    fs::write(journal.folder.join("ladder.toml"), text).unwrap();
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    journal.wait_for("process-end");
    let entries = journal.entries();
    let on = entries.iter().filter(|entry| entry["RUNGD_EVENT"] == "alarm-on");
    let tags: std::collections::BTreeSet<&str> = on.map(|entry| &*entry["RUNGD_TAG"]).collect();
    assert_eq!(tags.len(), 150, "{tags:?}");
}
