//! A running controller with an operator's socket, and commands for it. The tests of `rungd status`
//! and of the other operator commands share this module.

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use crate::calm::calm;
use crate::metronome::Stopwatch;
pub use crate::patience::PATIENCE;
use crate::running::process::list_of_controllers;
use crate::running::program;
use crate::system;
use serde_json::Value;

/// The outputs and the exit code of a command.
#[derive(Debug)]
pub struct Said {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Said {
    /// The JSON that the command printed as one line.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }
}

/// A folder with a controller file and a ladder, and the controller that runs them.
pub struct Live {
    pub folder: PathBuf,
    pub socket: PathBuf,
    pub child: Child,
    lines: Receiver<Value>,
}

/// Makes a folder with this ladder and a controller file; `controller` is the rest of that file.
pub fn folder(ladder: &str, controller: &str) -> PathBuf {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    // A short name, because a socket's path is limited.
    let folder = std::env::temp_dir().join(format!("rungd-op-{}-{number}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("ladder.toml"), ladder).unwrap();
    let socket = if controller.contains("[operator]") { "" } else { "operator.socket = \"s\"\n" };
    let controller = calm(&format!("ladder = [\"ladder.toml\"]\n{socket}{controller}"));
    std::fs::write(folder.join("controller.toml"), controller).unwrap();
    folder
}

/// The command `rungd run` for such a folder.
pub fn run(folder: &std::path::Path, arguments: &[&str]) -> Command {
    // Under `nohup`, SIGHUP would stay ignored.
    let mut command = Command::new("env");
    command.arg("--default-signal=HUP").arg(program()).arg("run");
    command.arg(folder.join("controller.toml")).args(arguments);
    for variable in ["RUNGD_LOG", "RUNGD_SOCKET", "NOTIFY_SOCKET", "RUNTIME_DIRECTORY"] {
        command.env_remove(variable);
    }
    command.env_remove("JOURNAL_STREAM").env("XDG_RUNTIME_DIR", list_of_controllers());
    command.args(["--log-format", "json"]).stderr(Stdio::piped()).stdout(Stdio::null());
    command
}

impl Live {
    /// Starts a controller and waits until its socket answers.
    pub fn start(ladder: &str, controller: &str, arguments: &[&str]) -> Live {
        let folder = folder(ladder, controller);
        let command = run(&folder, arguments);
        Live::of(folder, command)
    }

    /// Starts a controller, and waits until its ladder has turned C7 ON: it scans.
    pub fn scanning(ladder: &str) -> Live {
        let live = Live::start(ladder, "", &[]);
        live.await_values("C7", "ON");
        live
    }

    /// As [`Live::start`], for a controller whose scan stalls for a second after [`Live::stall`];
    /// this needs a debug build. With any watchdog far below a second, the stall is a fault,
    /// however busy the machine is.
    pub fn start_to_stall(ladder: &str, controller: &str, arguments: &[&str]) -> Live {
        let folder = folder(ladder, controller);
        let mut command = run(&folder, arguments);
        command.env("RUNGD_FAULTS", folder.join("faults"));
        Live::of(folder, command)
    }

    /// Makes the next scan take a second longer.
    pub fn stall(&self) {
        self.fault("stall");
    }

    /// Makes the next scan stall until [`Live::go_on`].
    pub fn hang(&self) {
        std::fs::write(self.folder.join("faults.hold"), "").unwrap();
        self.fault("hang");
    }

    /// Ends the stall of a scan.
    pub fn go_on(&self) {
        std::fs::remove_file(self.folder.join("faults.hold")).unwrap();
    }

    fn fault(&self, point: &str) {
        let faults = self.folder.join("faults");
        std::fs::write(&faults, point).unwrap();
        let deadline = Instant::now() + PATIENCE;
        while faults.exists() {
            assert!(Instant::now() < deadline, "it does not look for faults");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Waits until the controller is in this mode.
    pub fn await_mode(&self, mode: &str) {
        let deadline = Instant::now() + PATIENCE;
        while self.say("status --json").json()["mode"] != mode {
            assert!(Instant::now() < deadline, "not in {mode}");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Starts the controller by this command and waits until its socket answers.
    pub fn of(folder: PathBuf, mut command: Command) -> Live {
        let mut child = command.spawn().unwrap();
        let stderr = BufReader::new(child.stderr.take().unwrap());
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in stderr.lines() {
                let line = line.unwrap();
                let Ok(()) = sender.send(serde_json::from_str(&line).expect(&line)) else { return };
            }
        });
        let live = Live { socket: folder.join("s"), folder, child, lines };
        live.line("socket is open");
        let deadline = Instant::now() + PATIENCE;
        while live.say("status --json").out.contains("the first scan is still to come") {
            assert!(Instant::now() < deadline, "no first scan");
            std::thread::sleep(Duration::from_millis(5));
        }
        live
    }

    /// The next line of the log whose message contains `words`.
    pub fn line(&self, words: &str) -> Value {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let line = self.lines.recv_timeout(left).unwrap_or_else(|_| panic!("no `{words}`"));
            if line["message"].as_str().unwrap_or_default().contains(words) {
                return line;
            }
        }
    }

    /// All lines that are left, after the controller's end.
    pub fn rest(&self) -> Vec<Value> {
        self.lines.iter().collect()
    }

    /// As [`Live::line`], for several lines in any order.
    pub fn lines<const N: usize>(&self, words: [&str; N]) -> [Value; N] {
        let mut found = [const { Value::Null }; N];
        while found.iter().any(Value::is_null) {
            let line = self.line("");
            let message = line["message"].as_str().unwrap_or_default();
            if let Some(at) = words.iter().position(|words| message.contains(words)) {
                found[at] = line;
            }
        }
        found
    }

    /// A command for this controller; its arguments are separated by spaces.
    pub fn command(&self, words: &str) -> Command {
        let mut command = Command::new(program());
        command.args(words.split_whitespace()).env("RUNGD_SOCKET", &self.socket);
        command
    }

    pub fn say(&self, words: &str) -> Said {
        said(&mut self.command(words))
    }

    /// As [`Live::say`], for a command that must succeed.
    pub fn ok(&self, words: &str) -> String {
        let said = self.say(words);
        assert_eq!(said.code, 0, "{words}: {said:?}");
        said.out
    }

    /// As [`Live::ok`], repeated while the machine delays the controller, because a command waits
    /// no longer than ten seconds. A change that gets no answer is not made later: its request
    /// carries a deadline.
    pub fn served(&self, words: &str) -> String {
        let watch = Stopwatch::start(self.child.id());
        loop {
            let said = self.say(words);
            if said.code == 0 {
                return said.out;
            }
            let late = ["gave no answer in 10 s", "no scan has processed it in time"];
            let is_late = late.iter().any(|words| said.err.contains(words));
            assert!(is_late && watch.elapsed() < Duration::from_secs(8), "{words}: {said:?}");
        }
    }

    /// As [`Live::ok`], repeated until the scan thread answers, because a stalled thread does not
    /// answer.
    pub fn await_ok(&self, words: &str) -> String {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let said = self.say(words);
            if said.code == 0 {
                return said.out;
            }
            assert!(
                said.err.contains("executes no command") && Instant::now() < deadline,
                "{said:?}"
            );
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Waits until the operands have the expected values.
    pub fn await_values(&self, operands: &str, expected: &str) {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let out = self.ok(&format!("read {operands}"));
            let held = out.lines().map(|line| line.split_whitespace().nth(2).unwrap_or_default());
            let held = held.collect::<Vec<_>>().join(" ");
            if held == expected {
                return;
            }
            assert!(Instant::now() < deadline, "{operands}: {held}, not {expected}");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// A raw connection to the socket.
    pub fn connect(&self) -> UnixStream {
        connect(&self.socket)
    }

    pub fn signal(&self, name: &str) {
        system::signal(&self.child, name);
    }

    /// Sends SIGTERM and waits for the end; returns the statistics of the whole run.
    pub fn end(&mut self) -> Value {
        self.signal("TERM");
        let statistics = self.line("scan statistics of the whole run");
        assert_eq!(self.child.wait().unwrap().code(), Some(0));
        statistics
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

pub fn connect(socket: &Path) -> UnixStream {
    let stream = UnixStream::connect(socket).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.set_write_timeout(Some(PATIENCE)).unwrap();
    stream
}

pub fn said(command: &mut Command) -> Said {
    let output = command.env("NO_COLOR", "1").output().unwrap();
    Said {
        code: output.status.code().unwrap_or(-1),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

/// Sends a line and returns the answer.
pub fn ask(stream: &mut UnixStream, line: &str) -> Value {
    stream.write_all(format!("{line}\n").as_bytes()).unwrap();
    let mut answer = Vec::new();
    let mut byte = [0];
    while byte != *b"\n" {
        stream.read_exact(&mut byte).unwrap();
        answer.push(byte[0]);
    }
    serde_json::from_slice(&answer).unwrap()
}
