//! A process of `rungd web` with its controller, and a client that makes one connection per
//! request.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};

use serde_json::Value;

use rungd_test_support::running::live::{Live, PATIENCE};

/// A ladder with a counter, a word that people write, and a lamp.
pub const LADDER: &str = r#"
ladder.name = "web"
[tags]
start = { at = "C0", doc = "Starts the line" }
level = { at = "D0", min = 0, max = 100, unit = "cm", doc = "Set by people" }
lamp = { at = "Y0" }
parts = { at = "CT0" }
[[program]]
name = "Main"
[[program.rung]]
when = ["start", "level > 10"]
do = ["OUT lamp"]
[[program.rung]]
leg.up = ["rise(start)"]
leg.rst = ["$Off"]
do = ["CNT parts preset=5"]
[[program]]
name = "Side"
[[program.rung]]
when = ["start"]
do = ["OUT Y1"]
"#;

/// The operands that people may write, and a panel.
pub const CONTROLLER: &str = r#"
[web]
write = ["level", "start"]
[[panel]]
name = "Line"
show = [
  { lamp = "lamp", text = "Running" },
  { button = "start", confirm = "Start the line?" },
  { value = "level", decimals = 1 },
  { bar = "level", min = 0, max = 100, unit = "m" },
  { trend = "parts.Acc" },
]
"#;

/// `rungd web` and its controller.
pub struct Web {
    pub live: Live,
    pub child: Child,
    /// `127.0.0.1:PORT`.
    pub host: String,
    /// The one-time link, if there are no users.
    pub link: Option<String>,
    lines: Receiver<String>,
}

/// An HTTP answer.
#[derive(Debug)]
pub struct HttpAnswer {
    pub status: u16,
    pub head: String,
    pub body: String,
}

impl HttpAnswer {
    /// Reads an answer up to the end of its connection.
    pub fn read(mut stream: TcpStream) -> HttpAnswer {
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let text = String::from_utf8_lossy(&answer).into_owned();
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
        let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
        HttpAnswer { status, head: head.to_owned(), body: body.to_owned() }
    }

    pub fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }

    /// The value of a header.
    pub fn header(&self, name: &str) -> Option<&str> {
        let mut lines = self.head.lines().filter_map(|line| line.split_once(": "));
        lines.find(|(of, _)| of.eq_ignore_ascii_case(name)).map(|(_, value)| value)
    }

    /// The cookie that the answer sets.
    pub fn cookie(&self) -> String {
        let set = self.header("set-cookie").unwrap_or_else(|| panic!("no cookie: {self:?}"));
        set.split(';').next().unwrap_or_default().to_owned()
    }
}

/// The cookie and the token that a signed-in browser sends with a request.
#[derive(Clone, Debug)]
pub struct Visitor {
    pub cookie: String,
    pub csrf: String,
}

/// The bytes of a request.
fn bytes_of(first: &str, lines: &[String], body: &str) -> Vec<u8> {
    let mut request = format!("{first} HTTP/1.1\r\nConnection: close\r\n");
    lines.iter().for_each(|line| request += &format!("{line}\r\n"));
    if !body.is_empty() {
        request += &format!("Content-Length: {}\r\n", body.len());
    }
    format!("{request}\r\n{body}").into_bytes()
}

impl Web {
    /// Starts a controller and `rungd web` with these additional arguments.
    pub fn start(arguments: &[&str]) -> Web {
        Web::of(Live::start(LADDER, CONTROLLER, &[]), arguments)
    }

    pub fn of(live: Live, arguments: &[&str]) -> Web {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
        command.arg("web").arg("--socket").arg(&live.socket).args(["--listen", "127.0.0.1:0"]);
        command.args(arguments).env_remove("NOTIFY_SOCKET").stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let (send, lines) = channel();
        let errors = child.stderr.take().unwrap();
        std::thread::spawn(move || {
            for line in BufReader::new(errors).lines().map_while(Result::ok) {
                let _ = send.send(line);
            }
        });
        let first = loop {
            let line = lines.recv_timeout(PATIENCE).expect("it says where it listens");
            if line.contains("://") {
                break line;
            }
        };
        let at = first.split("://").nth(1).unwrap_or_else(|| panic!("{first}"));
        let host = at.split([' ', '/']).next().unwrap_or_default().to_owned();
        let link = first.split_once(&host).and_then(|(_, path)| path.split(' ').next());
        let link = link.filter(|path| path.starts_with("/in")).map(str::to_owned);
        Web { live, child, host, link, lines }
    }

    /// Sends bytes; returns the answer up to the end of the connection.
    pub fn send(&self, bytes: &[u8]) -> HttpAnswer {
        HttpAnswer::read(self.begin(bytes))
    }

    /// Sends bytes; returns the connection, on which the answer comes.
    pub fn begin(&self, bytes: &[u8]) -> TcpStream {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        // The server may answer and close the connection before it has all bytes.
        let _ = stream.write_all(bytes);
        stream
    }

    /// Sends a request with these header lines.
    pub fn ask(&self, first: &str, lines: &[String], body: &str) -> HttpAnswer {
        self.send(&bytes_of(first, lines, body))
    }

    /// Sends a signal to the process.
    pub fn signal(&self, name: &str) {
        let (signal, id) = (format!("-{name}"), self.child.id().to_string());
        assert!(Command::new("kill").args([signal, id]).status().unwrap().success());
    }

    /// The next line of the process's log with these words.
    pub fn line(&self, words: &str) -> String {
        loop {
            let line = self.lines.recv_timeout(PATIENCE);
            let line = line.unwrap_or_else(|_| panic!("no line with `{words}`"));
            if line.contains(words) {
                return line;
            }
        }
    }

    /// Sends a GET request of a visitor.
    pub fn get(&self, path: &str, visitor: &Visitor) -> HttpAnswer {
        let lines = [format!("Host: {}", self.host), format!("Cookie: {}", visitor.cookie)];
        self.ask(&format!("GET {path}"), &lines, "")
    }

    /// Sends a change of a visitor, as the page does.
    pub fn post(&self, path: &str, visitor: &Visitor, value: &Value) -> HttpAnswer {
        self.send(&self.bytes_of(path, visitor, value))
    }

    /// The bytes of a change of a visitor.
    pub fn bytes_of(&self, path: &str, visitor: &Visitor, value: &Value) -> Vec<u8> {
        let lines = [
            format!("Host: {}", self.host),
            format!("Origin: http://{}", self.host),
            format!("Cookie: {}", visitor.cookie),
            format!("X-CSRF-Token: {}", visitor.csrf),
            "Content-Type: application/json".to_owned(),
        ];
        bytes_of(&format!("POST {path}"), &lines, &value.to_string())
    }

    /// Uses the one-time link.
    pub fn visit(&self) -> Visitor {
        let link = self.link.clone().expect("a link");
        let lines = [format!("Host: {}", self.host)];
        let entered = self.ask(&format!("GET {link}"), &lines, "");
        assert_eq!((entered.status, entered.header("location")), (303, Some("/")), "{entered:?}");
        self.visitor(entered.cookie())
    }

    /// Signs a user in.
    pub fn sign_in(&self, user: &str, password: &str) -> HttpAnswer {
        let nobody = Visitor { cookie: String::new(), csrf: String::new() };
        let said = serde_json::json!({ "user": user, "password": password });
        self.post("/api/login", &nobody, &said)
    }

    /// The session of a cookie.
    pub fn visitor(&self, cookie: String) -> Visitor {
        let visitor = Visitor { cookie, csrf: String::new() };
        let session = self.get("/api/session", &visitor);
        assert_eq!(session.status, 200, "{session:?}");
        Visitor { csrf: session.json()["csrf"].as_str().unwrap().to_owned(), ..visitor }
    }

    /// Sends a request whose answer is a stream; returns the connection.
    pub fn open(&self, path: &str, visitor: &Visitor) -> TcpStream {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (host, cookie) = (&self.host, &visitor.cookie);
        let request = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nCookie: {cookie}\r\n");
        stream.write_all(format!("{request}Connection: close\r\n\r\n").as_bytes()).unwrap();
        stream
    }

    /// Reads the events of a stream until their sum fits.
    pub fn until(&self, path: &str, visitor: &Visitor, fits: impl Fn(&Value) -> bool) -> Value {
        let stream = self.open(path, visitor);
        let mut all = serde_json::json!({ "power": {}, "values": {} });
        for line in BufReader::new(stream).lines() {
            let line = line.expect("an event in time");
            let Some(event) = line.strip_prefix("data: ") else { continue };
            let event: Value = serde_json::from_str(event).unwrap();
            // Unchanged values are not sent again.
            for (key, value) in event.as_object().unwrap() {
                match (all[key].as_object_mut(), value.as_object()) {
                    (Some(known), Some(news)) => known.extend(news.clone()),
                    (Some(_) | None, _) => all[key] = value.clone(),
                }
            }
            if fits(&all) {
                return all;
            }
        }
        panic!("the stream ended: {all}");
    }

    /// The bytes of memory in use by the process.
    pub fn memory(&self) -> u64 {
        let path = format!("/proc/{}/status", self.child.id());
        let status = std::fs::read_to_string(path).unwrap();
        let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
    }
}

impl Drop for Web {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
