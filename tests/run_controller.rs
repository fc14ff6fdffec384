//! `rungd run` from outside: the real binary, its log, its exit codes, signals.
//!
//! Each test writes its files into a folder of its own, starts the binary with JSON lines (or
//! another form) and reads standard error as a person or a machine would.

#[path = "support/process.rs"]
mod process;

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use process::{PATIENCE, Running, find, message};
use serde_json::Value;

/// A ladder whose Main has the given rungs.
fn ladder(rungs: &str) -> String {
    format!(
        "[ladder]\nname = \"bottling\"\n\
         [tags]\n\
         jam = {{ at = \"C0\", alarm = \"Bottles jammed\" }}\n\
         lamp = {{ at = \"Y0\", log = \"change\" }}\n\
         [[program]]\nname = \"Main\"\n{rungs}"
    )
}

/// The lamp blinks, and the jam lasts for a while.
const ALIVE: &str = "[[program.rung]]\nwhen = [\"$100ms\"]\ndo = [\"OUT lamp\"]\n\
     [[program.rung]]\nwhen = [\"$ScanCounter >= 10\", \"$ScanCounter < 40\"]\n\
     do = [\"OUT jam\"]\n";
const STOPS: &str = "[[program.rung]]\nwhen = [\"$ScanCounter >= 5\"]\ndo = [\"STOP\"]\n\
     [[program.rung]]\nwhen = [\"$On\"]\ndo = [\"OUT lamp\", \"OUT jam\"]\n";

/// A folder with `controller.toml` and `ladder.toml`.
struct Plant(PathBuf);

impl Plant {
    fn new(rungs: &str, controller: &str) -> Plant {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let name = format!("run-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("ladder.toml"), ladder(rungs)).unwrap();
        let controller = format!("ladder = [\"ladder.toml\"]\n{controller}");
        std::fs::write(folder.join("controller.toml"), controller).unwrap();
        Plant(folder)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        // Under `nohup` SIGHUP would stay ignored.
        let mut command = Command::new("env");
        command.args(["--default-signal=HUP", env!("CARGO_BIN_EXE_rungd"), "run"]);
        command.arg(self.0.join("controller.toml")).args(arguments);
        command.env_remove("RUNGD_LOG").env_remove("NOTIFY_SOCKET").env_remove("JOURNAL_STREAM");
        command.env_remove("RUNTIME_DIRECTORY").env_remove("STATE_DIRECTORY");
        command.stderr(Stdio::piped()).stdout(Stdio::piped());
        command
    }

    fn start(&self, arguments: &[&str]) -> Running {
        Running::new(self.command(arguments).args(["--log-format", "json"]))
    }

    /// Runs to the end; exit code and the lines of the log.
    fn run(&self, arguments: &[&str]) -> (i32, Vec<Value>) {
        let output = self.command(arguments).args(["--log-format", "json"]).output().unwrap();
        assert_eq!(output.stdout, b"", "standard output is for results");
        let text = String::from_utf8(output.stderr).unwrap();
        let lines = text.lines().map(|line| serde_json::from_str(line).expect(line));
        (output.status.code().unwrap(), lines.collect())
    }
}

impl Drop for Plant {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_number_of_scans_and_an_orderly_stop() {
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
    let stop = find(&lines, "STOP: the number of scans asked for is complete");
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
fn an_alarm_is_a_warning_and_its_end_says_how_long_it_lasted() {
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
fn a_signal_stops_in_an_orderly_way() {
    for signal in ["TERM", "INT"] {
        let plant = Plant::new(ALIVE, "");
        let mut running = plant.start(&[]);
        running.line("lamp is ON");
        running.signal(signal);
        running.line(&format!("SIG{signal}: stopping"));
        running.line("STOP: a signal asked for it");
        running.line("scan statistics of the whole run");
        running.line("rungd ends");
        assert_eq!(running.end().code(), Some(0));
    }
}

#[test]
fn a_hangup_reads_the_files_anew() {
    let plant = Plant::new(ALIVE, "");
    let mut running = plant.start(&[]);
    running.line("lamp is ON");
    running.signal("HUP");
    let same = running.line("SIGHUP asked for a reload: the files say what runs already");
    assert_eq!(same["event"], "reload-same");
    std::fs::write(plant.0.join("ladder.toml"), ladder(&format!("{ALIVE}# edited\n"))).unwrap();
    running.signal("HUP");
    let done = running.line("SIGHUP reloaded: another program scans, without a stop");
    assert_eq!(done["event"], "reload-done");
    std::fs::write(plant.0.join("ladder.toml"), "no ladder").unwrap();
    running.signal("HUP");
    running.line("SIGHUP asked for a reload, and the files cannot be run as they are");
    running.signal("TERM");
    running.line("rungd ends");
    assert_eq!(running.end().code(), Some(0));
}

#[test]
fn the_stop_instruction_leaves_the_process_in_stop_and_the_log_repeats_why() {
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
fn a_start_in_stop_says_so_until_it_is_told_to_end() {
    let plant = Plant::new(ALIVE, "");
    let mut running = plant.start(&["--stopped", "--repeat-reason", "150ms"]);
    let stop = running.line("STOP: an operator asked for it");
    assert_eq!((&stop["level"], &stop["scan"]), (&"WARN".into(), &0.into()));
    running.line("still in STOP after");
    running.signal("TERM");
    running.line("SIGTERM: ending from STOP; no further scan comes");
    assert_eq!(running.line("rungd ends")["scans"], 0);
    assert_eq!(running.end().code(), Some(0));
}

#[test]
fn the_passes_of_a_stop_turn_outputs_off() {
    let plant = Plant::new(STOPS, "");
    let (code, lines) = plant.run(&["--scans", "1000"]);
    assert_eq!(code, 0, "with a number of scans, STOP ends the process");
    let at = |words| lines.iter().position(|line| message(line).contains(words)).expect(words);
    assert!(at("lamp is ON") < at("lamp is OFF") && at("lamp is OFF") < at("STOP: "));
    assert!(at("alarm OFF after") < at("STOP: "));
}

#[test]
fn a_scan_longer_than_the_watchdog_is_a_fault() {
    let plant = Plant::new(&slow_rungs(), "scan.period = \"2ms\"\nscan.watchdog = \"1ms\"\n");
    let mut running = plant.start(&["--repeat-reason", "150ms"]);
    let fault = running.line("FAULT: a scan");
    assert_eq!((&fault["level"], &fault["watchdog"]), (&"ERROR".into(), &"1ms".into()));
    assert!(message(&fault).contains("raise `[scan] watchdog` (it is 1ms, for "), "{fault}");
    assert!(message(&fault).contains(" rungs every 2ms)"), "{fault}");
    running.line("still in FAULT after");
    running.signal("TERM");
    running.line("SIGTERM: ending from FAULT; no further scan comes");
    running.line("rungd ends");
    assert_eq!(running.end().code(), Some(0));
    let (code, lines) = plant.run(&["--scans", "5"]);
    assert_eq!(code, 75, "with a number of scans, a fault is no success");
    let errors = lines.iter().filter(|line| line["level"] == "ERROR").count();
    assert_eq!(errors, 1, "one fault, one error: {lines:#?}");
}

#[test]
fn a_signal_while_files_are_read_ends_the_process_at_once() {
    // So many rungs that nobody has read them by then.
    let rung = "[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"OUT C9\"]\n";
    let plant = Plant::new(&rung.repeat(300_000), "");
    let mut running = plant.start(&[]);
    let tasks = PathBuf::from(format!("/proc/{}/task", running.pid()));
    let reads = |thread: std::fs::DirEntry| {
        let name = std::fs::read_to_string(thread.path().join("comm"));
        name.is_ok_and(|name| name.trim() == "rungd-load")
    };
    while !std::fs::read_dir(&tasks).unwrap().flatten().any(reads) {
        std::thread::sleep(Duration::from_millis(1));
    }
    running.signal("TERM");
    running.line("SIGTERM: ending; the ladder was still being loaded, nothing was scanned");
    assert_eq!(running.end().code(), Some(0));
}

#[test]
fn a_second_signal_ends_at_once_and_names_the_first() {
    let plant = Plant::new(ALIVE, "scan.period = \"10s\"\nscan.watchdog = \"10s\"\n");
    let mut running = plant.start(&[]);
    running.line("RUN: ");
    running.signal("TERM");
    running.line("SIGTERM: stopping; the next scan is the last");
    running.signal("INT");
    running.line("SIGINT after SIGTERM: ending at once");
    assert_eq!(running.end().code(), Some(75));
}

#[test]
fn the_simulated_device_moves_before_the_first_scan() {
    let rungs = "[[program.rung]]\nwhen = [\"$FirstScan\", \"X0\"]\ndo = [\"SET lamp\"]\n";
    let rule = "[[simulated-device]]\ninput = \"X0\"\npulse = \"5s\"\nevery = \"10s\"\n";
    let (_, lines) = Plant::new(rungs, rule).run(&["--scans", "2"]);
    assert_eq!(find(&lines, "lamp is ON")["scan"], 1);
}

#[test]
fn a_flood_of_alarms_is_told_in_pairs_and_what_is_left_out_is_counted() {
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

#[test]
fn overruns_are_told_once_and_counted() {
    let plant = Plant::new(&slow_rungs(), "scan.period = \"1ms\"\nscan.watchdog = \"10s\"\n");
    let (code, lines) = plant.run(&["--scans", "20"]);
    assert_eq!(code, 0);
    let overruns: Vec<_> = lines.iter().filter(|line| message(line).contains("overrun")).collect();
    assert_eq!(overruns.len(), 2, "the first, and the sum of the rest: {overruns:#?}");
    assert!(message(overruns[0]).contains("a scan took longer than the period"));
    let whole = find(&lines, "scan statistics of the whole run");
    assert!(whole["overruns"].as_u64().unwrap() >= 19, "{whole}");
    assert!(whole["skipped"].as_u64().unwrap() >= 19, "{whole}");
}

/// Rungs that take some milliseconds. A release build scans far more of them in that time.
fn slow_rungs() -> String {
    let mut rungs = String::from("rung = [\n");
    let count = if cfg!(debug_assertions) { 30_000 } else { 400_000 };
    for n in 0..count {
        let (a, b) = (n % 2000, n * 7 % 2000);
        rungs += &format!(
            "  {{ when = [\"X{a} | !X{b}\", \"rise(X{b}) | X1\"], do = [\"SET C1\"] }},\n"
        );
    }
    rungs + "]\n"
}

#[test]
fn statistics_come_at_their_interval() {
    let plant = Plant::new(ALIVE, "scan.period = \"2ms\"\nlog.statistics = \"200ms\"\n");
    let (_, lines) = plant.run(&["--scans", "300"]);
    let reports =
        lines.iter().filter(|line| message(line).starts_with("scan statistics of the last"));
    let reports: Vec<_> = reports.collect();
    let scans: Vec<u64> = reports.iter().map(|line| line["scans"].as_u64().unwrap()).collect();
    assert!(reports.iter().all(|line| line["late_us_p99"].is_f64()), "{reports:#?}");
    assert!((1..=3).contains(&scans.len()), "{scans:?}");
}

#[test]
fn a_bad_file_is_refused_with_its_findings() {
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
fn an_address_that_is_taken_is_named() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let listen = taken.local_addr().unwrap();
    let plant = Plant::new(ALIVE, &format!("modbus-server.listen = \"{listen}\"\n"));
    let (code, lines) = plant.run(&["--scans", "1"]);
    assert_eq!(code, 74);
    assert!(message(find(&lines, "cannot listen")).contains(&listen.to_string()));
}

#[test]
fn people_read_lines_with_a_level_and_no_escape_codes() {
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
fn the_level_can_come_from_the_environment() {
    let plant = Plant::new(ALIVE, "");
    let quiet = plant.command(&["--scans", "3"]).env("RUNGD_LOG", "error").output().unwrap();
    assert_eq!((quiet.status.code(), quiet.stderr.len()), (Some(0), 0));
    let wrong = plant.command(&["--scans", "3"]).env("RUNGD_LOG", "loud").output().unwrap();
    assert_eq!(wrong.status.code(), Some(78));
}

#[test]
fn systemd_hears_ready_alive_status_and_stopping() {
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

#[test]
fn a_systemd_that_does_not_listen_keeps_nobody_from_anything() {
    let plant = Plant::new(ALIVE, "scan.period = \"2ms\"\n");
    let socket_path = plant.0.join("notify");
    let socket = std::os::unix::net::UnixDatagram::bind(&socket_path).unwrap();
    // No more fits, whatever the machine's limit is.
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
fn too_few_file_descriptors_are_the_environments_fault() {
    let plant = Plant::new(ALIVE, "");
    let command = plant.command(&["--scans", "1"]);
    let mut shell = Command::new("sh");
    shell.args(["-c", "ulimit -n 8; exec \"$0\" \"$@\""]).arg(command.get_program());
    let output = shell.args(command.get_args()).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(74), "{text}");
    assert!(text.contains("file descriptors") && !text.contains("bug"), "{text}");
}

#[test]
fn findings_that_cannot_be_written_are_no_bug() {
    let plant = Plant::new("[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"OUTT Y0\"]\n", "");
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    assert_eq!(plant.command(&[]).stderr(full).status().unwrap().code(), Some(78));
}

#[test]
fn a_log_that_nobody_reads_costs_no_scan() {
    unread_log(Duration::from_secs(4));
}

/// `cargo test --test run_controller -- --ignored --nocapture thirty`
#[test]
#[ignore = "takes 30 seconds"]
fn a_log_that_nobody_reads_for_thirty_seconds_costs_no_scan() {
    unread_log(Duration::from_secs(30));
}

/// Runs at 1 ms with a log that is not read for so long; every grid point must be accounted for.
fn unread_log(unread: Duration) {
    // Tasks that complete every other scan, with their passes told: many thousand lines a second.
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
    assert!(Command::new("kill").arg(child.id().to_string()).status().unwrap().success());
    let mut text = String::new();
    child.stderr.take().unwrap().read_to_string(&mut text).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let lines: Vec<Value> = text.lines().map(|l| serde_json::from_str(l).expect(l)).collect();
    let sum = |words: &str, field: &str| -> u64 {
        let told = lines.iter().filter(|line| message(line).contains(words));
        told.map(|line| line[field].as_u64().unwrap()).sum()
    };
    let whole = find(&lines, "scan statistics of the whole run");
    let number = |field: &str| whole[field].as_u64().unwrap();
    let (scans, skipped) = (number("scans"), number("skipped"));
    // A grid point every millisecond from the start of RUN to that of the last scan, both counted.
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

/// A page's fenced block that begins with a line.
fn fenced<'a>(page: &'a str, first: &str) -> &'a str {
    let at = page.find(first).unwrap_or_else(|| panic!("no `{first}`"));
    page[at..].split("```").next().unwrap()
}

/// A line of the log without what differs from run to run: numbers, and hashes.
fn masked(line: &str) -> String {
    let words = line.split_whitespace().skip(1).map(|word| match word.split_once('=') {
        Some(("sha256", _)) => "sha256".to_owned(),
        _ => word.chars().filter(|c| !c.is_ascii_digit() && *c != '.').collect(),
    });
    words.collect::<Vec<_>>().join(" ").replace("after ms", "after s").replace("run, ms", "run, s")
}

#[test]
fn the_page_shows_what_is_logged() {
    let page = include_str!("../docs/running.md");
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
