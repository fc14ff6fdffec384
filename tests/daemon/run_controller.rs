//! `rungd run` with the real binary: its modes, ends, exit codes and signals.

use crate::daemon::bottling;
use std::process::Command;
use std::time::Duration;

use crate::daemon::bottling::{
    ALIVE, Plant, Running, STOPS, find, message, scans_are_accounted_for, until,
};
use rungd_test_support::needs::{Need, skip};
use rungd_test_support::running::live::Live;
use rungd_test_support::running::process::BLINKS;

#[test]
fn a_run_of_a_given_number_of_scans_ends_in_an_orderly_stop() {
    let plant = Plant::new(ALIVE, "scan.period = \"2ms\"\n");
    let (code, lines) = plant.run(&["--scans", "60"]);
    assert_eq!(code, 0);
    assert_eq!(message(&lines[0]), "rungd starts");
    let loaded = find(&lines, "ladder loaded");
    assert_eq!((&loaded["ladder"], &loaded["period"]), (&"bottling".into(), &"2ms".into()));
    assert_eq!(loaded["ladders"], 1);
    assert_eq!(loaded["sha256"].as_str().map(str::len), Some(64));
    assert_eq!(find(&lines, "real-time posture")["granted"], "timer slack 1 ns");
    find(&lines, "RUN: scanning every 2ms");
    find(&lines, "Program Main started");
    find(&lines, "lamp is ON");
    let stop = find(&lines, "STOP: the requested number of scans is complete");
    assert_eq!((&stop["level"], &stop["scan"]), (&"INFO".into(), &60.into()));
    let whole = find(&lines, "scan statistics of the whole run");
    assert_eq!(whole["scans"], 60);
    for field in [
        "scan_us_last",
        "scan_us_min",
        "scan_us_mean",
        "scan_us_p999",
        "scan_us_max",
        "late_us_last",
        "late_us_min",
        "late_us_mean",
        "late_us_p50",
        "late_us_p99",
        "late_us_p999",
        "late_us_max",
    ] {
        assert!(whole[field].is_f64(), "{field} in {whole}");
    }
    assert_eq!(message(lines.last().unwrap()), "rungd ends");
}

#[test]
fn a_period_below_a_millisecond_scans_as_often_and_its_log_is_replayed() {
    let settings = "scan.period = \"250us\"\nrealtime.spin = \"20us\"\n";
    let plant = Plant::new(ALIVE, &format!("{settings}[record]\ndir = \"log\"\n"));
    let (code, lines) = plant.run(&["--scans", "2000"]);
    assert_eq!(code, 0);
    find(&lines, "RUN: scanning every 250us");
    let granted = &find(&lines, "real-time posture")["granted"];
    assert_eq!(granted, "timer slack 1 ns, awake 20 us before each scan");
    scans_are_accounted_for(&lines, Duration::from_micros(250), Duration::from_micros(1999 * 250));
    let mut replay = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let replayed = replay.current_dir(&plant.0).args(["replay", "log"]).output().unwrap();
    let told = String::from_utf8(replayed.stdout).unwrap();
    assert!(told.contains("2,000 scans replayed") && told.contains("hashes equal"), "{told}");
}

#[test]
fn an_alarm_is_logged_as_a_warning_and_its_end_with_its_duration() {
    let plant = Plant::new(ALIVE, "scan.period = \"2ms\"\n");
    let (_, lines) = plant.run(&["--scans", "60"]);
    let on = find(&lines, "alarm ON: Bottles jammed");
    assert_eq!(
        (&on["level"], &on["tag"], &on["scan"]),
        (&"WARN".into(), &"jam".into(), &11.into())
    );
    let off = find(&lines, "alarm OFF after");
    assert!(off["lasted_ms"].as_u64().unwrap() >= 50, "{off}");
    assert_eq!((&off["level"], message(off).ends_with(": Bottles jammed")), (&"INFO".into(), true));
}

#[test]
fn a_signal_stops_the_controller_in_an_orderly_way() {
    for signal in ["TERM", "INT"] {
        let plant = Plant::new(ALIVE, "");
        let mut running = plant.start(&[]);
        running.line("lamp is ON");
        running.signal(signal);
        running.line(&format!("SIG{signal}: stopping"));
        running.line("STOP: a signal requested it");
        running.line("scan statistics of the whole run");
        running.line("rungd ends");
        assert_eq!(running.end().code(), Some(0));
    }
}

#[test]
fn a_hangup_signal_reloads_the_files() {
    let plant = Plant::new(ALIVE, "");
    let mut running = plant.start(&[]);
    running.line("lamp is ON");
    running.signal("HUP");
    let same = running.line("SIGHUP asked for a reload: the files are those of the running");
    assert_eq!(same["event"], "reload-same");
    std::fs::write(plant.0.join("ladder.toml"), bottling::ladder(&format!("{ALIVE}# edited\n")))
        .unwrap();
    running.signal("HUP");
    let done = running.line("SIGHUP reloaded: the new program scans, without a stop");
    assert_eq!(done["event"], "reload-done");
    std::fs::write(plant.0.join("ladder.toml"), "no ladder").unwrap();
    running.signal("HUP");
    running.line("SIGHUP asked for a reload, and the files cannot be run as they are");
    running.signal("TERM");
    running.line("rungd ends");
    assert_eq!(running.end().code(), Some(0));
}

#[test]
fn the_stop_instruction_leaves_the_process_in_stop_and_the_log_repeats_the_reason() {
    let plant = Plant::new(STOPS, "");
    let mut running = plant.start(&["--repeat-reason", "150ms"]);
    let stop = running.line("STOP: the ladder executed STOP");
    assert_eq!((&stop["level"], &stop["scan"]), (&"WARN".into(), &7.into()));
    for _ in 0..2 {
        let still = running.line("still in STOP after");
        assert!(message(&still).contains("the ladder executed STOP; restart rungd"), "{still}");
    }
    assert_eq!(running.child.try_wait().unwrap(), None, "it stays");
    running.signal("TERM");
    running.line("SIGTERM: ending from STOP; no further scan comes");
    running.line("rungd ends");
    assert_eq!(running.end().code(), Some(0));
}

#[test]
fn a_start_in_stop_reports_stop_until_a_signal() {
    let plant = Plant::new(ALIVE, "");
    let mut running = plant.start(&["--stopped", "--repeat-reason", "150ms"]);
    let stop = running.line("STOP: the command line requested it (`--stopped`)");
    assert_eq!((&stop["level"], &stop["scan"]), (&"WARN".into(), &0.into()));
    let still = running.line("still in STOP after");
    assert!(message(&still).contains("restart rungd without `--stopped`"), "{still}");
    running.signal("TERM");
    running.line("SIGTERM: ending from STOP; no further scan comes");
    assert_eq!(running.line("rungd ends")["scans"], 0);
    assert_eq!(running.end().code(), Some(0));
}

#[test]
fn the_termination_passes_of_a_stop_turn_outputs_off() {
    let plant = Plant::new(STOPS, "");
    let (code, lines) = plant.run(&["--scans", "1000"]);
    assert_eq!(code, 0, "with a number of scans, STOP ends the process");
    let at = |words| lines.iter().position(|line| message(line).contains(words)).expect(words);
    assert!(at("lamp is ON") < at("lamp is OFF") && at("lamp is OFF") < at("STOP: "));
    assert!(at("alarm OFF after") < at("STOP: "));
}

#[test]
fn a_scan_longer_than_the_watchdog_is_a_fault() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a release build has no faults on purpose");
    }
    let plant = Plant::new(ALIVE, "scan.period = \"2ms\"\nscan.watchdog = \"500ms\"\n");
    let stalling = |arguments: &[&str]| {
        let faults = plant.0.join("faults");
        std::fs::write(&faults, "stall").unwrap();
        let mut command = plant.command(arguments);
        command.args(["--log-format", "json"]).env("RUNGD_FAULTS", faults);
        command
    };
    let mut running = Running::new(&mut stalling(&["--repeat-reason", "150ms"]));
    let fault = running.line("FAULT: a scan");
    assert_eq!((&fault["level"], &fault["watchdog"]), (&"ERROR".into(), &"500ms".into()));
    assert!(message(&fault).contains("raise `[scan] watchdog` (it is 500ms, for "), "{fault}");
    assert!(message(&fault).contains(" rungs every 2ms)"), "{fault}");
    running.line("still in FAULT after");
    running.signal("TERM");
    running.line("SIGTERM: ending from FAULT; no further scan comes");
    running.line("rungd ends");
    assert_eq!(running.end().code(), Some(0));
    let (code, lines) = bottling::said(&mut stalling(&["--scans", "5000"]));
    assert_eq!(code, 75, "with a number of scans, a fault is no success");
    let errors = lines.iter().filter(|line| line["level"] == "ERROR").count();
    assert_eq!(errors, 1, "one fault, one error: {lines:#?}");
}

#[test]
fn a_signal_during_the_load_ends_the_process_at_once() {
    // Enough rungs to be still loading when the signal arrives.
    let rung = "[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"OUT C9\"]\n";
    let plant = Plant::new(&rung.repeat(300_000), "");
    let mut running = plant.start(&[]);
    let tasks = std::path::PathBuf::from(format!("/proc/{}/task", running.pid()));
    let reads = |thread: std::fs::DirEntry| {
        let name = std::fs::read_to_string(thread.path().join("comm"));
        name.is_ok_and(|name| name.trim() == "rungd-load")
    };
    while !std::fs::read_dir(&tasks).unwrap().flatten().any(reads) {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    running.signal("TERM");
    running.line("SIGTERM: ending; the ladder was still being loaded, nothing was scanned");
    assert_eq!(running.end().code(), Some(0));
}

/// The last scan hangs, so that it cannot end between the two signals.
#[test]
fn a_second_signal_ends_the_process_at_once_and_names_the_first() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a scan hangs only in a debug build");
    }
    let mut live = Live::start_to_stall(BLINKS, "scan.watchdog = \"10m\"\n", &[]);
    live.hang();
    live.signal("TERM");
    let first = live.line(": stopping; the next scan is the last")["signal"].clone();
    assert_eq!(first, "SIGTERM");
    live.signal("INT");
    live.line("SIGINT after SIGTERM: ending at once");
    assert_eq!(live.child.wait().unwrap().code(), Some(75));
}

#[test]
fn the_simulated_device_moves_before_the_first_scan() {
    let rungs = "[[program.rung]]\nwhen = [\"$FirstScan\", \"X0\"]\ndo = [\"SET lamp\"]\n";
    let rule = "[[simulated-device]]\ninput = \"X0\"\npulse = \"5s\"\nevery = \"10s\"\n";
    let (_, lines) = Plant::new(rungs, rule).run(&["--scans", "2"]);
    assert_eq!(find(&lines, "lamp is ON")["scan"], 1);
}

#[test]
fn many_alarms_are_logged_in_pairs_and_omitted_lines_are_counted() {
    let toggles = "[[program.rung]]\nwhen = [\"$ScanToggle\"]\ndo = [\"OUT jam\"]\n";
    let (_, lines) = Plant::new(toggles, "scan.period = \"1ms\"\n").run(&["--scans", "600"]);
    let count = |words| lines.iter().filter(|line| message(line).starts_with(words)).count();
    let (on, off) = (count("alarm ON"), count("alarm OFF"));
    assert_eq!(on, off, "no alarm seems to stand");
    let left_out = find(&lines, "alarms come too often");
    let left_out = left_out["lines"].as_u64().unwrap() as usize;
    assert!(on >= 10 && (598..=600).contains(&(on + off + left_out)), "{on} {off} {left_out}");
    let at = |words| lines.iter().position(|line| message(line).contains(words)).expect(words);
    assert!(at("alarms come too often") < at("scan statistics of the whole run"));
}

/// The first two scans take a second longer, whatever the machine's speed.
#[test]
fn overruns_are_logged_once_and_counted() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a release build has no faults on purpose");
    }
    let plant = Plant::new(ALIVE, "scan.period = \"1ms\"\nscan.watchdog = \"10m\"\n");
    let faults = plant.0.join("faults");
    std::fs::write(&faults, "stall").unwrap();
    let mut command = plant.command(&["--scans", "200", "--log-format", "json"]);
    command.env("RUNGD_FAULTS", &faults);
    let again = std::thread::spawn(move || {
        until(|| !faults.exists());
        std::fs::write(&faults, "stall").unwrap();
        until(|| !faults.exists());
    });
    let (code, lines) = bottling::said(&mut command);
    again.join().unwrap();
    assert_eq!(code, 0);
    let whole = find(&lines, "scan statistics of the whole run");
    let overruns: Vec<_> = lines.iter().filter(|line| message(line).contains("overrun")).collect();
    let over_s = whole["over_us"].as_f64().unwrap() as usize / 1_000_000;
    // The first one, and the sum of the others every ten seconds and at the end.
    assert!((2..=2 + over_s / 10).contains(&overruns.len()), "{overruns:#?}");
    let first = message(overruns[0]);
    assert!(first.contains("overrun: a scan was not over"), "{first}");
    assert!(first.contains("a scan took longer than the period"), "{first}");
    let sum = |field: &str| overruns.iter().map(|line| line[field].as_u64().unwrap()).sum::<u64>();
    assert!(whole["overruns"].as_u64().unwrap() >= 2, "{whole}");
    assert_eq!(whole["skipped"], sum("skipped"), "each one is in a line");
    assert!(sum("skipped") >= 1_990, "a second each: {whole}");
}

#[test]
fn statistics_are_logged_at_their_interval() {
    let plant = Plant::new(ALIVE, "scan.period = \"2ms\"\nlog.statistics = \"200ms\"\n");
    let (_, lines) = plant.run(&["--scans", "300"]);
    let reports =
        lines.iter().filter(|line| message(line).starts_with("scan statistics of the last"));
    let reports: Vec<_> = reports.collect();
    let scans: Vec<u64> = reports.iter().map(|line| line["scans"].as_u64().unwrap()).collect();
    assert!(reports.iter().all(|line| line["late_us_p99"].is_f64()), "{reports:#?}");
    // On a busy machine 300 scans take longer than 600 ms, so the number of reports depends on the
    // run's duration.
    let whole = find(&lines, "scan statistics of the whole run");
    let most = (whole["over_us"].as_f64().unwrap() / 200_000.0) as usize + 1;
    assert!((1..=most).contains(&scans.len()), "{scans:?}, {most} at most");
}

#[test]
fn a_start_with_a_bad_file_is_refused_with_its_findings() {
    let plant = Plant::new("[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"OUTT Y0\"]\n", "");
    let output = plant.command(&[]).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(78), "{text}");
    assert!(text.contains("ladder.toml:10:") && text.contains("did you mean `OUT`"), "{text}");
    let (code, lines) = plant.run(&[]);
    assert_eq!(code, 78);
    find(&lines, "cannot be run as it is");
}

#[test]
fn an_input_reads_its_initial_value_until_a_driver_writes_it() {
    let rungs = "[[program.rung]]\nwhen = [\"X9\"]\ndo = [\"OUT jam\"]\n\
                 [tags.held]\nat = \"X9\"\ninitial = true\n";
    let (code, lines) = Plant::new(rungs, "").run(&["--scans", "5"]);
    assert_eq!(code, 0);
    find(&lines, "Bottles jammed");
}

#[test]
fn a_strict_posture_that_is_not_granted_is_refused() {
    let realtime = "realtime = { cpus = [1000], strict = true }\n";
    let (code, lines) = Plant::new(ALIVE, realtime).run(&["--scans", "1"]);
    assert_eq!(code, 78);
    find(&lines, "`[realtime]` is strict");
    let lax = "realtime = { cpus = [1000] }\n";
    let (code, lines) = Plant::new(ALIVE, lax).run(&["--scans", "1"]);
    assert_eq!((code, &find(&lines, "CPU 1000 was refused")["level"]), (0, &"WARN".into()));
}

#[test]
fn a_listen_address_in_use_is_named() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let listen = taken.local_addr().unwrap();
    let plant = Plant::new(ALIVE, &format!("modbus-server.listen = \"{listen}\"\n"));
    let (code, lines) = plant.run(&["--scans", "1"]);
    assert_eq!(code, 74);
    let said = message(find(&lines, "cannot listen"));
    let words = format!(
        "cannot listen at {listen}: another process listens there (`ss -ltnp sport = :{}` shows \
         it): end it, or write another port in `[modbus-server] listen`: ",
        listen.port()
    );
    assert!(said.contains(&words), "{said}");
}

#[test]
fn too_few_file_descriptors_are_a_failure_of_the_environment() {
    let plant = Plant::new(ALIVE, "");
    let command = plant.command(&["--scans", "1"]);
    let mut shell = Command::new("sh");
    shell.args(["-c", "ulimit -n 8; exec \"$0\" \"$@\""]).arg(command.get_program());
    let output = shell.args(command.get_args()).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(74), "{text}");
    assert!(text.contains("file descriptors") && !text.contains("bug"), "{text}");
}
