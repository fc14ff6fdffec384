//! A controller with everything that has metrics, `rungd metrics` for it, and an HTTP client.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use rungd_test_support::needs::{self, usable};
use rungd_test_support::running::live::{Live, PATIENCE};

/// A plant with metrics of each kind, and an alarm.
pub const LADDER: &str = r#"
[ladder]
name = "tank \"7\""
[tags]
level = { at = "D0", unit = "mm", metric = true }
ratio = { at = "R0", unit = "%", initial = 0.1, min = 0.0, metric = true }
pump = { type = "bit", metric = true }
parts = { at = "CT0", metric = true }
shift = { at = "D10", count = 2, metric = true, min = 0 }
plain = { at = "D1", unit = "bar", min = 0, spare = true }
stuck = { at = "C1", alarm = "The pump does not \u001b[31manswer", priority = "critical" }
asked = { at = "C2" }
[[program]]
name = "Main"
[[program.rung]]
when = ["$On"]
do = ["MOVE 1234 to=level", "OUT pump"]
[[program.rung]]
when = ["asked"]
do = ["OUT stuck"]
[[program.rung]]
leg.up = ["asked"]
leg.rst = ["$Off"]
do = ["CNT parts preset=5"]
"#;

/// A device, retentive memory and a scan log on disk.
pub const CONTROLLER: &str = r#"
[[device]]
name = "plant"
driver = "simulated"
map = [ { from = "Y0", to = "motor.run" }, { from = "motor.running", to = "X0" } ]
[[device.part]]
name = "motor"
kind = "motor"
after = "60ms"
release = "40ms"
[retain]
ranges = ["D10..D11"]
file = "memory"
cold-start = "run"
[record]
dir = "record"
[modbus-server]
listen = "127.0.0.1:0"
"#;

/// `rungd metrics --listen` of a controller.
pub struct Served {
    pub live: Live,
    pub child: Child,
    /// `127.0.0.1:PORT`.
    pub host: String,
}

/// An HTTP answer.
#[derive(Debug)]
pub struct HttpAnswer {
    pub status: u16,
    pub head: String,
    pub body: String,
}

impl Served {
    pub fn start() -> Served {
        Served::of(Live::start(LADDER, CONTROLLER, &[]))
    }

    pub fn of(live: Live) -> Served {
        let mut command = live.command("metrics --listen 127.0.0.1:0");
        let mut child = command.env_remove("NOTIFY_SOCKET").stderr(Stdio::piped()).spawn().unwrap();
        let host = said_after(&mut child, "http://").split('/').next().unwrap().to_owned();
        Served { live, child, host }
    }

    /// Sends bytes; returns the answer up to the end of the connection.
    pub fn send(&self, bytes: &[u8]) -> HttpAnswer {
        answer_of(&self.host, bytes)
    }

    /// Sends a request with this value of `Accept`.
    pub fn ask(&self, first: &str, accept: &str) -> HttpAnswer {
        let rest = format!("Host: {}\r\nAccept: {accept}\r\nConnection: close\r\n\r\n", self.host);
        self.send(format!("{first} HTTP/1.1\r\n{rest}").as_bytes())
    }

    /// The metrics in the older format.
    pub fn text(&self) -> String {
        let answer = self.ask("GET /metrics", "*/*");
        assert_eq!(answer.status, 200, "{answer:?}");
        answer.body
    }

    /// Waits until the metrics have this line.
    pub fn await_line(&self, line: &str) -> String {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let text = self.text();
            if text.lines().any(|of| of == line) {
                return text;
            }
            assert!(Instant::now() < deadline, "no `{line}` in:\n{text}");
            std::thread::sleep(Duration::from_millis(200));
        }
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The text after these words in the first line of standard error that has them; the later lines
/// are read and discarded.
pub fn said_after(child: &mut Child, words: &'static str) -> String {
    let (send, lines) = channel();
    let errors = child.stderr.take().unwrap();
    std::thread::spawn(move || {
        for line in BufReader::new(errors).lines().map_while(Result::ok) {
            let _ = send.send(line);
        }
    });
    loop {
        let line = lines.recv_timeout(PATIENCE).expect("it says where it listens");
        if let Some((_, rest)) = line.split_once(words) {
            return rest.to_owned();
        }
    }
}

/// Sends bytes to a host; returns the answer up to the end of the connection.
pub fn answer_of(host: &str, bytes: &[u8]) -> HttpAnswer {
    let mut stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    // The host may answer and close the connection before it has all bytes.
    let _ = stream.write_all(bytes);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let text = String::from_utf8_lossy(&answer).into_owned();
    let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
    HttpAnswer { status, head: head.to_ascii_lowercase(), body: body.to_owned() }
}

/// Whether `promtool` and `prometheus` are installed, and new enough.
pub fn has_prometheus() -> bool {
    ["prometheus", "promtool"].into_iter().all(|program| usable(needs::prometheus(program)))
}

/// Runs `promtool` with a standard input. It must succeed without a message.
pub fn promtool(arguments: &[&str], input: &str) {
    let mut command = Command::new("promtool");
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.is_empty(), "promtool {arguments:?}: {said}\n{input}");
}
