//! `[log]` of the controller file in the real process: the blocks whose changes are logged, the
//! levels of events, local time, and the settings that a reload changes.

use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use super::clocks::library;
use rungd_test_support::needs::not_installed;
use rungd_test_support::running::live::{Live, PATIENCE, folder};
use rungd_test_support::running::process::{BLINKS, Plant, Running};
use serde_json::Value;

/// A Program that goes from Stage to Stage, and restarts a Task.
const STAGES: &str = "[[program]]\nname = \"Main\"\n\
    rung = [ { when = [\"$ScanToggle\"], do = [\"ENTASK Job\"] } ]\n\
    [[program.stage]]\nname = \"A\"\nrung = [ { when = [\"$On\"], do = [\"JMP B\"] } ]\n\
    [[program.stage]]\nname = \"B\"\nrung = [ { when = [\"$On\"], do = [\"JMP A\"] } ]\n\
    [[task]]\nname = \"Job\"\nrung = []\n";

/// The log lines of a run of twenty scans.
fn lines(ladder: &str, controller: &str, arguments: &[&str]) -> Vec<Value> {
    let plant = Plant::new(ladder, &format!("scan.period = \"2ms\"\n{controller}"));
    let mut command = plant.command(&[] as &[&str]);
    Running::new(command.args(["--scans", "20"]).args(arguments)).rest()
}

/// Whether there are lines about Stages; whether there are lines about Programs and Tasks.
fn told(lines: &[Value]) -> (bool, bool) {
    let names = ["block-started", "block-stopped", "block-completed", "stage-on", "stage-off"];
    let is_of_blocks =
        |line: &&Value| names.contains(&event(line)) || event(line) == "termination-pass";
    let mut of_blocks = lines.iter().filter(is_of_blocks);
    let is_stage = |line: &Value| message(line).starts_with("Stage ");
    (of_blocks.clone().any(is_stage), of_blocks.any(|line| !is_stage(line)))
}

fn event(line: &Value) -> &str {
    line["event"].as_str().unwrap_or_default()
}

fn message(line: &Value) -> &str {
    line["message"].as_str().unwrap_or_default()
}

#[test]
fn block_events_are_logged_as_the_controller_file_requests() {
    for (blocks, expected) in
        [("all", (true, true)), ("programs", (false, true)), ("none", (false, false))]
    {
        let found = lines(STAGES, &format!("log.blocks = \"{blocks}\"\n"), &[]);
        assert_eq!(told(&found), expected, "{blocks}: {found:#?}");
        let has = |name: &str| found.iter().any(|line| event(line) == name);
        assert!(has("mode-run") && has("mode-stop") && has("process-end"), "{blocks}");
    }
    // Lines that `log.blocks` excludes are left out at every level.
    let found = lines(STAGES, "log.blocks = \"programs\"\n", &["--log-level", "trace"]);
    assert_eq!(told(&found), (false, true));
}

#[test]
fn an_event_is_logged_at_its_configured_level() {
    let levels = "[log.events]\nblock-started = \"off\"\nstage-on = \"debug\"\n\
                  stage-off = \"warn\"\nprogram-swapped = \"info\"\nmode-run = \"warn\"\n";
    for (level, has_details) in [("info", false), ("debug", true), ("trace", true)] {
        let found = lines(STAGES, levels, &["--log-level", level]);
        let levels = |name: &str| -> Vec<&Value> {
            found.iter().filter(|line| event(line) == name).map(|line| &line["level"]).collect()
        };
        assert!(levels("block-started").is_empty(), "{level}");
        assert_eq!(levels("stage-on").is_empty(), !has_details, "{level}");
        assert!(levels("stage-on").iter().all(|level| **level == "DEBUG"));
        assert!(!levels("stage-off").is_empty());
        assert!(levels("stage-off").iter().all(|level| **level == "WARN"));
        assert_eq!(levels("mode-run"), ["WARN"]);
    }
    let found = lines(STAGES, levels, &["--log-level", "warn"]);
    assert!(found.iter().all(|line| line["level"] == "WARN" || line["level"] == "ERROR"));
    assert!(found.iter().any(|line| event(line) == "stage-off"));
}

#[test]
fn a_raised_detail_is_logged_and_the_threshold_stays_with_the_operator() {
    let raised = "[log.events]\noperator-connected = \"info\"\ntag-on = \"debug\"\n\
                  tag-off = \"off\"\n";
    let live = Live::start(BLINKS, raised, &[]);
    let told = live.line("connected");
    assert_eq!((event(&told), &told["level"]), ("operator-connected", &"INFO".into()));
    assert_eq!(live.ok("log-level debug"), "debug, was info\n");
    live.line("set the log's level to debug, was info");
    let told = live.line("lamp is");
    assert_eq!((event(&told), &told["level"]), ("tag-on", &"DEBUG".into()));
    assert_eq!(message(&live.line("lamp is")), "lamp is ON");
    assert_eq!(live.ok("log-level warn"), "warn, was debug\n");
    live.line("set the log's level to warn, was debug");
    live.ok("force Y9 on");
    live.ok("log-level info");
    let told = until(&live, "operator-log-level");
    assert!(told.iter().all(|line| event(line) != "operator-force"), "{told:#?}");
}

/// The lines up to one of this event.
fn until(live: &Live, name: &str) -> Vec<Value> {
    let mut told = Vec::new();
    while told.last().is_none_or(|line| event(line) != name) {
        told.push(live.line(""));
    }
    told
}

#[test]
fn log_settings_follow_reload_and_rollback() {
    let live = Live::start(BLINKS, "", &[]);
    live.line("lamp is OFF");
    let path = live.folder.join("controller.toml");
    let before = fs::read_to_string(&path).unwrap();
    let quiet = "[log]\nblocks = \"none\"\ntime = \"local\"\n[log.events]\ntag-on = \"off\"\n\
                 tag-off = \"warn\"\n";
    fs::write(&path, format!("{before}{quiet}")).unwrap();
    let said = live.ok("reload");
    for change in [
        "log of blocks all → none\n",
        "time of the log utc → local\n",
        "log level of tag-on info → off\n",
        "log level of tag-off info → warn\n",
    ] {
        assert!(said.contains(change), "{change} is not in {said}");
    }
    assert!(!said.contains("needs a restart"), "{said}");
    live.line("reloaded: the new program");
    for _ in 0..3 {
        let told = live.line("lamp is");
        assert_eq!((event(&told), &told["level"]), ("tag-off", &"WARN".into()));
    }
    live.ok("mode stop");
    live.line("STOP: an operator requested it");
    live.ok("mode run");
    live.line("RUN: scanning");
    let told = until(&live, "tag-off");
    assert!(told.iter().all(|line| event(line) != "block-started"), "{told:#?}");
    assert!(live.ok("rollback").contains("log of blocks none → all"), "back");
    live.line("went back to the program before the reload");
    assert_eq!(live.line("lamp is ON")["level"], "INFO");
}

/// `rungd run` in a folder, with its text log in a file in that folder.
struct Texts<'a> {
    folder: &'a Path,
    child: Child,
}

impl Drop for Texts<'_> {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Texts<'_> {
    fn start(folder: &Path, change: impl FnOnce(&mut Command)) -> Texts<'_> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
        command.current_dir(folder).args(["run", "controller.toml", "--log-format", "text"]);
        command.stderr(File::create(folder.join("rungd.log")).unwrap());
        for name in ["RUNGD_LOG", "RUNGD_SOCKET", "NOTIFY_SOCKET", "JOURNAL_STREAM"] {
            command.env_remove(name);
        }
        change(&mut command);
        Texts { folder, child: command.spawn().unwrap() }
    }

    fn text(&self) -> String {
        fs::read_to_string(self.folder.join("rungd.log")).unwrap()
    }

    /// The first line that contains `words`.
    fn line(&self, words: &str) -> String {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let text = self.text();
            if let Some(line) = text.lines().find(|line| line.contains(words)) {
                return line.to_owned();
            }
            assert!(Instant::now() < deadline, "no `{words}` in {text}");
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

fn now_s() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs() as i64
}

/// A time in seconds since 1970, as `date` reads it.
fn seconds_of(stamp: &str) -> i64 {
    let said = Command::new("date").args(["-d", stamp, "+%s"]).output().expect("date").stdout;
    let said = String::from_utf8(said).expect("text");
    said.trim().parse().unwrap_or_else(|_| panic!("{stamp} is no time to date: {said}"))
}

#[test]
fn a_text_log_shows_local_time_with_its_offset_if_configured() {
    let from_s = now_s();
    for (time, tz, ending) in [
        ("local", "<+0545>-5:45", "+05:45"),
        ("local", "<-0330>3:30", "-03:30"),
        ("local", "", "+00:00"),
        ("utc", "<+0545>-5:45", "Z"),
    ] {
        let folder = folder(BLINKS, &format!("log.time = \"{time}\"\n"));
        let mut texts = Texts::start(&folder, |command| {
            command.env("TZ", tz).args(["--scans", "30"]);
        });
        assert!(texts.child.wait().unwrap().success());
        let text = texts.text();
        assert!(text.contains(" process-start: ") && text.contains(" process-end: "), "{text}");
        for line in text.lines() {
            let stamp = line.split(' ').next().unwrap_or_default();
            assert!(stamp.ends_with(ending), "{tz}: {line}");
            assert!((from_s..=now_s()).contains(&seconds_of(stamp)), "{tz}: {line}");
        }
        let _ = fs::remove_dir_all(&folder);
    }
}

#[test]
fn local_time_in_the_log_follows_summer_time_at_its_exact_second() {
    let folder = folder(BLINKS, "log.time = \"local\"\n");
    let Some(library) = library(&folder) else { return not_installed("cc") };
    let offset = folder.join("offset");
    let to = |seconds: i64| {
        let file = File::options().create(true).write(true).truncate(false).open(&offset).unwrap();
        file.write_all_at(&(seconds - now_s()).to_ne_bytes(), 0).unwrap();
    };
    // 2026-03-29 01:00:00 UTC, and 2026-10-25 01:00:00 UTC.
    let (spring_s, autumn_s) = (1_774_746_000, 1_792_890_000);
    to(spring_s - 1000);
    let texts = Texts::start(&folder, |command| {
        command.env("TZ", "CET-1CEST,M3.5.0,M10.5.0/3");
        command.env("LD_PRELOAD", library).env("WALL_CLOCK_OFFSET_FILE", &offset);
    });
    let shows = |local: &str, offset: &str| {
        let line = texts.line(local);
        assert!(line.contains(offset), "{line}");
    };
    shows("2026-03-29T01:43:", "+01:00 ");
    to(spring_s - 2);
    shows("2026-03-29T03:00:", "+02:00 ");
    to(autumn_s - 1000);
    // By then the thread that reads the zone has read it again.
    shows("2026-10-25T02:43:24", "+02:00 ");
    to(autumn_s - 2);
    shows("2026-10-25T02:00:", "+01:00 ");
    assert!(!texts.text().contains("2026-03-29T02:"), "this hour is not there");
    let _ = fs::remove_dir_all(&folder);
}
