//! The remote I/O of these tests: `tests/peer/watched_io.py`, a process with its own clock.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdout, Command, Stdio};

use serde_json::Value;

/// Two remote devices: the first keeps its outputs when nothing is written, the second has a
/// watchdog.
pub struct Watcher {
    child: Child,
    answers: BufReader<ChildStdout>,
    pub ports: Vec<u64>,
}

/// A change of one point.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The time since the cause, in ms.
    pub ms: f64,
    /// `coil` or `holding`, and its address.
    pub point: (String, u64),
    pub value: u64,
    /// Whether the device's own watchdog changed it, not a write.
    pub by_watchdog: bool,
}

impl Watcher {
    /// Starts both devices. The second one's watchdog is register 100: it must be written every
    /// `limit_ms`.
    pub fn start(limit_ms: u32) -> Watcher {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/peer/watched_io.py");
        let second = format!("127.0.0.1:0,watchdog=100:{limit_ms}");
        let mut child = Command::new("python3")
            .args([script, "127.0.0.1:0", &second])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let answers = BufReader::new(child.stdout.take().unwrap());
        let mut watcher = Watcher { child, answers, ports: Vec::new() };
        let ports = watcher.answer();
        let ports = ports["listening"].as_array().unwrap();
        watcher.ports = ports.iter().map(|port| port.as_u64().unwrap()).collect();
        watcher
    }

    fn answer(&mut self) -> Value {
        let mut line = String::new();
        self.answers.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|why| panic!("{why}: {line:?}"))
    }

    /// Lets the watcher execute a command; returns the time of its execution by the watcher's
    /// clock, in us.
    pub fn tell(&mut self, command: &str) -> u64 {
        self.ask(command)["at"].as_u64().unwrap()
    }

    fn ask(&mut self, command: &str) -> Value {
        writeln!(self.child.stdin.as_mut().unwrap(), "{command}").unwrap();
        self.answer()
    }

    /// The changes at a device since the last call, with times since `since_us`.
    pub fn seen(&mut self, device: usize, since_us: u64) -> Vec<Change> {
        let story = self.ask(&format!("history {device}"));
        let list = |name: &str| story[name].as_array().unwrap().clone();
        let change = |change: Value| Change {
            ms: (change[0].as_u64().unwrap() as f64 - since_us as f64) / 1000.0,
            point: (change[1].as_str().unwrap().to_owned(), change[2].as_u64().unwrap()),
            value: change[3].as_u64().unwrap(),
            by_watchdog: change[4] == "watchdog",
        };
        list("changes").into_iter().map(change).collect()
    }

    /// The values of a device's points.
    pub fn values(&mut self, device: usize, bank: &str, first: u16, count: u16) -> Vec<u64> {
        let values = self.ask(&format!("values {device} {bank} {first} {count}"));
        values["values"].as_array().unwrap().iter().map(|v| v.as_u64().unwrap()).collect()
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
