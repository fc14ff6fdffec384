//! The process of `rungd fleet`, for tests that start it, end it and read its output.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Instant;

use rungd_test_support::system;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::fleet::broker::PATIENCE;

/// `rungd fleet`. Dropping this value ends it.
pub struct FleetProcess(Child);

impl FleetProcess {
    pub fn start(arguments: &[&str]) -> FleetProcess {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
        command.arg("fleet").args(arguments).env_remove("RUNGD_BROKER");
        FleetProcess(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap())
    }

    /// Sends SIGTERM, as systemd does; Ctrl-C has the same effect.
    pub fn terminate(&self) {
        kill_process(Pid::from_child(&self.0), Signal::TERM).unwrap();
    }

    /// Sends SIGTERM, and waits for the end.
    pub fn stop(self) -> (i32, String, String) {
        self.terminate();
        self.end()
    }

    /// Waits for the end; returns exit code, standard output and standard error.
    pub fn end(mut self) -> (i32, String, String) {
        let (mut out, mut errors) = (String::new(), String::new());
        if let Some(mut stdout) = self.stdout() {
            stdout.read_to_string(&mut out).unwrap();
        }
        self.0.stderr.take().unwrap().read_to_string(&mut errors).unwrap();
        (self.0.wait().unwrap().code().unwrap_or(-1), out, errors)
    }

    /// Waits for the end without reading; returns the exit code.
    pub fn code(mut self) -> i32 {
        system::end(&mut self.0).code().unwrap_or(-1)
    }

    /// Takes the standard output, if nobody has taken it. Dropping it closes it, as `| head -1`
    /// does.
    pub fn stdout(&mut self) -> Option<ChildStdout> {
        self.0.stdout.take()
    }

    /// The lines of JSON as the process prints them.
    pub fn lines(&mut self) -> FleetLines {
        let stdout = BufReader::new(self.stdout().expect("nobody has taken it"));
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                let Ok(()) = sender.send(serde_json::from_str(&line).expect(&line)) else { return };
            }
        });
        FleetLines(lines)
    }
}

impl Drop for FleetProcess {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Lines of JSON.
pub struct FleetLines(Receiver<Value>);

impl FleetLines {
    /// The next line that fits.
    pub fn until(&self, what: &str, fits: impl Fn(&Value) -> bool) -> Value {
        let (deadline, mut seen) = (Instant::now() + PATIENCE, Vec::new());
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let line = self.0.recv_timeout(left).unwrap_or_else(|_| panic!("no {what}: {seen:#?}"));
            if fits(&line) {
                return line;
            }
            seen.push(line);
        }
    }
}
