//! A client of the operator's socket whose connection stays open for many requests.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::running::live::{self, Live, PATIENCE};

/// The operator's socket, kept open.
pub struct Operator {
    stream: BufReader<UnixStream>,
    socket: PathBuf,
    asked: Instant,
}

/// rungd closes a connection that is silent for a minute.
const IDLE: Duration = Duration::from_secs(40);

impl Operator {
    pub fn new(live: &Live) -> Operator {
        Operator::at(&live.socket)
    }

    pub fn at(socket: &Path) -> Operator {
        let stream = BufReader::new(live::connect(socket));
        Operator { stream, socket: socket.to_owned(), asked: Instant::now() }
    }

    pub fn ask(&mut self, request: &Value) -> Value {
        if self.asked.elapsed() >= IDLE {
            self.stream = BufReader::new(live::connect(&self.socket));
        }
        self.asked = Instant::now();
        self.stream.get_mut().write_all(format!("{request}\n").as_bytes()).unwrap();
        let mut line = String::new();
        self.stream.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{request}: {error}: `{line}`"))
    }

    pub fn status(&mut self) -> Value {
        self.ask(&json!({"do": "status"}))["ok"].clone()
    }

    /// Complete scans since the start of the process.
    pub fn scans(&mut self) -> u64 {
        self.status()["scans"].as_u64().unwrap()
    }

    /// Waits until `more` further scans are complete; fails if no scan completes for a long time.
    pub fn await_scans(&mut self, more: u64) {
        let mut seen = self.scans();
        let wanted = seen + more;
        while seen < wanted {
            let after = |status: &Value| status["scans"].as_u64().filter(|scans| *scans > seen);
            let status = self.await_status(|status| after(status).is_some());
            seen = after(&status).unwrap();
        }
    }

    /// Waits for a status that fits, and returns it.
    pub fn await_status(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let status = self.status();
            if wanted(&status) {
                return status;
            }
            assert!(Instant::now() < deadline, "not what was waited for: {status}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// The number of scans, and the operands' values in the last one.
    pub fn read(&mut self, operands: &[&str]) -> (i64, Vec<i64>) {
        let answer = self.ask(&json!({"do": "read", "operands": operands}));
        let number =
            |value: &Value| value.as_i64().unwrap_or(i64::from(value == &Value::Bool(true)));
        let values = answer["ok"]["values"].as_array().unwrap_or_else(|| panic!("{answer}"));
        let values = values.iter().map(|value| number(&value["value"])).collect();
        (answer["ok"]["scans"].as_i64().unwrap(), values)
    }
}
