//! A rungd process in a test: its folder, its log line by line, its end, and its scan statistics.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use crate::calm::calm;
use crate::metronome::{self, HeldUp};
#[allow(unused_imports)]
pub use crate::needs::{Need, not_installed, skip};
pub use crate::patience::PATIENCE;
use crate::running::{program, scratch_folder};
use crate::system;
use serde_json::Value;

/// A ladder that switches Y0 every 100 ms; the log shows each change.
pub const BLINKS: &str = "[tags]\nlamp = { at = \"Y0\", log = \"change\" }\n\
     [[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = [\"$100ms\"]\ndo = [\"OUT lamp\"]\n";

/// The sentence of the last statistics.
pub const WHOLE_RUN: &str = "scan statistics of the whole run";

/// A field that [`note_held_up`] adds to the last statistics.
const HELD_UP_US: &str = "test_held_up_us";

/// The number of skipped scans that need no excuse: the first scans load pages of the program.
const SKIPS_FEW: u64 = 10;

/// The folder with the list of the tests' running controllers, for `XDG_RUNTIME_DIR`: commands of the
/// user who runs the tests do not find these controllers. The entries of ended ones are removed by
/// the next controller.
pub fn list_of_controllers() -> PathBuf {
    let folder = scratch_folder().join("list-of-controllers");
    let _ = std::fs::create_dir_all(&folder);
    folder
}

/// A folder with `controller.toml` and `ladder.toml`.
pub struct Plant(pub PathBuf);

impl Plant {
    pub fn new(ladder: &str, controller: &str) -> Plant {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("process-{}-{number}", std::process::id());
        let folder = scratch_folder().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("ladder.toml"), ladder).unwrap();
        let controller = calm(&format!("ladder = [\"ladder.toml\"]\n{controller}"));
        std::fs::write(folder.join("controller.toml"), controller).unwrap();
        Plant(folder)
    }

    /// `PREFIX rungd run controller.toml --log-format json`, without a reader of its log yet.
    pub fn command<S: AsRef<OsStr>>(&self, prefix: &[S]) -> Command {
        self.command_of(prefix, "controller.toml")
    }

    fn command_of<S: AsRef<OsStr>>(&self, prefix: &[S], controller: &str) -> Command {
        // Under `nohup`, SIGHUP would stay ignored.
        let mut command = Command::new("env");
        command.arg("--default-signal=HUP").args(prefix).arg(program());
        command.arg("run").arg(self.0.join(controller));
        command.args(["--log-format", "json"]);
        let variables = ["RUNGD_LOG", "NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"];
        let systemd = ["JOURNAL_STREAM", "RUNTIME_DIRECTORY", "STATE_DIRECTORY"];
        variables.iter().chain(&systemd).for_each(|name| {
            command.env_remove(name);
        });
        command.env("XDG_RUNTIME_DIR", list_of_controllers());
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        command
    }

    /// As [`Plant::command`] with a different socket: a second controller with the same files.
    pub fn second(&self) -> Command {
        let text = std::fs::read_to_string(self.0.join("controller.toml")).unwrap();
        let text = text.replace("socket = \"op\"", "socket = \"op2\"");
        std::fs::write(self.0.join("second.toml"), text).unwrap();
        self.command_of(&[] as &[&str], "second.toml")
    }

    /// Runs a command that calls this plant's controller at the socket `op`, and returns its
    /// output. The exit code must be 0.
    pub fn ask(&self, words: &[&str]) -> String {
        self.ask_for(words, 0)
    }

    /// The same for a command that ends with this code.
    pub fn ask_for(&self, words: &[&str], code: i32) -> String {
        let mut command = Command::new(program());
        let said = command.args(words).arg("--socket").arg(self.0.join("op")).output().unwrap();
        let text = [said.stdout, said.stderr].concat();
        let text = String::from_utf8(text).unwrap();
        assert_eq!(said.status.code(), Some(code), "{words:?}: {text}");
        text
    }

    /// A socket in place of systemd's, and its path for `NOTIFY_SOCKET`.
    pub fn notify(&self) -> (UnixDatagram, PathBuf) {
        let path = self.0.join("notify");
        let socket = UnixDatagram::bind(&path).unwrap();
        socket.set_read_timeout(Some(PATIENCE)).unwrap();
        (socket, path)
    }
}

impl Drop for Plant {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A rungd process whose log the test reads line by line.
pub struct Running {
    pub child: Child,
    lines: Receiver<Value>,
}

impl Running {
    pub fn new(command: &mut Command) -> Running {
        metronome::begin();
        let mut child = command.spawn().unwrap();
        let (sender, lines) = channel();
        if let Some(stderr) = child.stderr.take() {
            let held_up_us = held_up_us(child.id());
            std::thread::spawn(move || {
                for line in BufReader::new(stderr).lines() {
                    let line = line.unwrap();
                    let mut value: Value = serde_json::from_str(&line).expect(&line);
                    if message(&value).contains(WHOLE_RUN) {
                        let held_up_us = held_up_us.load(Ordering::Relaxed);
                        note_held_up(&mut value, Duration::from_micros(held_up_us));
                    }
                    let Ok(()) = sender.send(value) else { return };
                }
            });
        }
        Running { child, lines }
    }

    /// The next line whose message contains `words`.
    pub fn line(&self, words: &str) -> Value {
        let deadline = Instant::now() + PATIENCE;
        let mut seen = Vec::new();
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let Ok(line) = self.lines.recv_timeout(left) else { panic!("no `{words}`: {seen:#?}") };
            if message(&line).contains(words) {
                return line;
            }
            seen.push(line);
        }
    }

    /// All lines up to the end.
    pub fn rest(&self) -> Vec<Value> {
        std::iter::from_fn(|| self.lines.recv_timeout(PATIENCE).ok()).collect()
    }

    /// The lines that have arrived already.
    pub fn so_far(&self) -> Vec<Value> {
        self.lines.try_iter().collect()
    }

    pub fn pid(&self) -> String {
        self.child.id().to_string()
    }

    pub fn signal(&self, name: &str) {
        system::signal(&self.child, name);
    }

    pub fn end(&mut self) -> ExitStatus {
        system::end(&mut self.child)
    }

    /// Stops the process in an orderly way; returns the remaining lines.
    pub fn stop(&mut self) -> Vec<Value> {
        let (lines, code) = self.stop_with_code();
        assert_eq!(code, Some(code_of(&lines)), "{lines:#?}");
        lines
    }

    /// The same, and the exit code, which may be any.
    pub fn stop_with_code(&mut self) -> (Vec<Value>, Option<i32>) {
        self.signal("TERM");
        let lines = self.rest();
        (lines, self.end().code())
    }

    /// Sends SIGKILL and waits for the end of the process.
    pub fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The exit code of an orderly end after these log lines.
pub fn code_of(lines: &[Value]) -> i32 {
    if lines.iter().any(|line| line["event"] == "retain-lost") { 74 } else { 0 }
}

/// The time for which a process had no processor so far, in µs. A thread measures it until the
/// caller drops the number: threads that have ended cannot be measured any more.
fn held_up_us(pid: u32) -> Arc<AtomicU64> {
    let us = Arc::new(AtomicU64::new(0));
    let shared = Arc::downgrade(&us);
    std::thread::spawn(move || {
        while let Some(us) = shared.upgrade() {
            let held_up = HeldUp::of(pid).since(&HeldUp::default());
            us.fetch_max(held_up.as_micros() as u64, Ordering::Relaxed);
            drop(us);
            std::thread::sleep(Duration::from_millis(50));
        }
    });
    us
}

/// Waits until the condition holds.
pub fn until(mut is_so: impl FnMut() -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !is_so() {
        assert!(Instant::now() < deadline, "it did not come to be");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Adds to the last statistics the time for which the process had no processor.
pub fn note_held_up(whole: &mut Value, held_up: Duration) {
    whole[HELD_UP_US] = (held_up.as_micros() as u64).into();
}

pub fn message(line: &Value) -> &str {
    line["message"].as_str().unwrap_or_default()
}

/// The first line whose message contains `words`.
pub fn find<'a>(lines: &'a [Value], words: &str) -> &'a Value {
    let found = lines.iter().find(|line| message(line).contains(words));
    found.unwrap_or_else(|| panic!("no `{words}` in {lines:#?}"))
}

/// Checks that every grid point from the start of RUN to the last scan was scanned or counted as
/// skipped, and that no line shows a fault. The run lasted `least` or longer.
pub fn scans_are_accounted_for(lines: &[Value], period: Duration, least: Duration) -> Value {
    for line in lines {
        assert!(!message(line).contains("FAULT"), "{line}");
    }
    let whole = find(lines, WHOLE_RUN);
    let number = |field: &str| whole[field].as_u64().unwrap();
    let us = |field: &str| whole[field].as_f64().unwrap();
    let period_us = period.as_micros() as f64;
    let points = ((us("over_us") - us("late_us_last")) / period_us).round() as u64 + 1;
    assert_eq!(number("scans") + number("skipped"), points, "{whole}");
    assert!(us("over_us") >= least.as_micros() as f64, "{whole}");
    whole.clone()
}

/// As [`scans_are_accounted_for`]. Also checks that a busy machine explains all skipped scans but a
/// few, so the conditions of the test caused none.
pub fn no_scan_missed(lines: &[Value], period: Duration, least: Duration) {
    let whole = scans_are_accounted_for(lines, period, least);
    let over = Duration::from_micros(whole["over_us"].as_f64().unwrap() as u64);
    let beside = metronome::taken_within(over + Duration::from_secs(1));
    let own = Duration::from_micros(whole[HELD_UP_US].as_u64().unwrap_or_default());
    let allowed = skips_allowed(&whole, beside.max(own), period);
    let told = format!("held up for {own:?}, threads beside it for {beside:?}: {whole}");
    assert!(whole["skipped"].as_u64().unwrap() <= allowed, "more than {allowed}: {told}");
}

/// The number of scans that may be skipped if the machine took this time from the scan thread: one
/// for each period, and [`SKIPS_FEW`]. An overrun that skips one scan needs less than a whole
/// period, because the scan itself takes time, up to half of the period. Therefore each overrun
/// counts as half a scan.
fn skips_allowed(whole: &Value, taken: Duration, period: Duration) -> u64 {
    let overruns = whole["overruns"].as_u64().unwrap();
    SKIPS_FEW + overruns / 2 + (taken.as_micros() / period.as_micros()) as u64
}

#[test]
fn few_skipped_scans_are_allowed_without_overruns() {
    let allowed = |overruns: u64, taken_ms: u64| {
        let whole = serde_json::json!({ "overruns": overruns });
        skips_allowed(&whole, Duration::from_millis(taken_ms), Duration::from_millis(2))
    };
    assert_eq!(allowed(0, 0), SKIPS_FEW);
    assert!(allowed(400, 0) < 400, "each overrun skips at least one");
    assert!(allowed(1, 0) < 400, "the only overrun skips all of them");
    assert_eq!(allowed(400, 600), SKIPS_FEW + 200 + 300);
}

/// A prefix for a command: it makes a mount namespace and runs a line of shell in it first. `None`
/// if this machine does not permit that.
pub fn mounted(shell: &str) -> Option<Vec<String>> {
    let own = ["unshare", "--mount", "--propagation", "private"];
    let user = ["unshare", "--user", "--map-root-user", "--mount", "--propagation", "private"];
    let works = |words: &[&str]| {
        let mut command = Command::new(words[0]);
        let done = command.args(&words[1..]).arg("true").stderr(Stdio::null()).status();
        done.is_ok_and(|status| status.success())
    };
    let prefix = [&own[..], &user[..]].into_iter().find(|words| works(words))?;
    let words = prefix.iter().copied().chain(["sh", "-c", shell, "sh"]);
    Some(words.map(str::to_owned).collect())
}

/// The processor time that a process has used so far, in seconds.
pub fn processor_time(pid: u32) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap();
    let fields: Vec<&str> = stat.rsplit_once(") ").unwrap().1.split(' ').collect();
    // The fields utime and stime, in ticks of 10 ms on every Linux that Rust runs on.
    fields[11..13].iter().map(|ticks| ticks.parse::<f64>().unwrap()).sum::<f64>() / 100.0
}
