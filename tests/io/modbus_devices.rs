//! Modbus devices with foreign peers: pymodbus and libmodbus as remote I/O (`tests/modbus_peers/`).
//!
//! The real binary runs a ladder whose inputs and outputs are the peer's. The test sets the peer's
//! inputs in place of the field, and the peer reports rungd's writes to the test. If a peer is not
//! installed, a test prints that and does nothing, unless `RUNGD_REQUIRE` names `programs`.

use crate::io::line::over_a_line;
use rungd_test_support::needs::{usable, works};
use rungd_test_support::page;
use rungd_test_support::running::process;
use std::cell::Cell;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rungd_config::load;
use rungd_test_support::running::process::{PATIENCE, Plant, Running, not_installed};
use serde_json::Value;

const PEERS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/modbus_peers");

/// Remote I/O in a separate process.
struct Peer {
    child: Child,
    lines: Receiver<String>,
    seen: Vec<String>,
}

impl Peer {
    fn start(way: &str, place: &str, units: &[&str]) -> Peer {
        let mut command = Command::new("python3");
        command.args([&format!("{PEERS}/remote_io.py"), way, place]).args(units);
        Peer::told_by(command)
    }

    fn told_by(mut command: Command) -> Peer {
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let (sender, lines) = channel();
        let stdout = child.stdout.take().unwrap();
        std::thread::spawn(move || {
            let lines = BufReader::new(stdout).lines().map_while(Result::ok);
            lines.for_each(|line| drop(sender.send(line)));
        });
        let mut peer = Peer { child, lines, seen: Vec::new() };
        peer.told("ready");
        peer
    }

    /// Sets a value of the peer, in place of the field.
    fn set(&mut self, what: &str) {
        writeln!(self.child.stdin.as_mut().unwrap(), "{what}").unwrap();
    }

    /// Waits until the peer reports this line.
    fn told(&mut self, line: &str) {
        let is = |told: &str| told == line;
        assert!(self.tells_in_time(is), "the peer never told {line:?}: {:#?}", self.seen);
    }

    /// Waits until the peer reports at least `times` writes of a watchdog's register.
    fn fed(&mut self, register: &str, times: u32) {
        let count = |told: &str| told.strip_prefix(register)?.parse::<u32>().ok();
        let is = |told: &str| count(told).is_some_and(|count| count >= times);
        assert!(self.tells_in_time(is), "{register:?} not {times} times: {:#?}", self.seen);
    }

    fn tells_in_time(&mut self, wanted: impl Fn(&str) -> bool) -> bool {
        let deadline = Instant::now() + PATIENCE;
        while let Ok(told) = self.lines.recv_timeout(deadline.duration_since(Instant::now())) {
            let is = wanted(&told);
            self.seen.push(told);
            if is {
                return true;
            }
        }
        false
    }

    /// The number of reports within a time that begin with `start`.
    fn tells(&mut self, start: &str, within: Duration) -> usize {
        let deadline = Instant::now() + within;
        let mut count = 0;
        while let Ok(told) = self.lines.recv_timeout(deadline - Instant::now().min(deadline)) {
            count += usize::from(told.starts_with(start));
        }
        count
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn are_installed() -> bool {
    has_socat() && has_peer("rtu")
}

fn has_socat() -> bool {
    usable(works("socat", Command::new("socat").arg("-V")))
}

fn is_installed() -> bool {
    has_peer("tcp")
}

/// Whether the peer on pymodbus can be made here: of a version that has what it uses, and for a
/// serial line with pyserial.
fn has_peer(way: &str) -> bool {
    let script = format!("{PEERS}/remote_io.py");
    let mut peer = Command::new("python3");
    usable(works(&format!("pymodbus ({way})"), peer.args([&script, "probe", way])))
}

/// A port that was free a moment ago.
fn free_port() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().port().to_string()
}

const LADDER: &str = r#"
[ladder]
devices = ["line1"]

[[program]]
name = "Main"

[[program.rung]]
when = ["X0"]
do   = ["OUT Y0"]

[[program.rung]]
when = ["X3"]
do   = ["OUT Y1"]

[[program.rung]]
when = ["line1.Ok"]
do   = ["OUT Y2"]

[[program.rung]]
when = ["$On"]
do   = ["MOVE D0 to=D10", "MOVE D1 to=D11", "MOVE V0 to=V10"]
"#;

const MAP: &str = r#"
map = [
  { from = "discrete 0..3", to = "X0..X3" },
  { from = "input 10..11", to = "D0", type = "i32", word-order = "low-first" },
  { from = "input 20", to = "D1", type = "i16", multiply = 10, divide = 4, offset = 5 },
  { from = "holding 50", to = "V0", unit = 2 },
  { from = "Y0..Y2", to = "coil 0..2" },
  { from = "D10", to = "holding 30..31", type = "i32" },
  { from = "D11", to = "holding 40", type = "i16", multiply = 10, divide = 4, offset = 5, safe = 15 },
  { from = "V10", to = "holding 60", unit = 2, hold = true },
]
watchdog = { register = 99, every = "50ms" }
"#;

fn controller(port: &str, more: &str) -> String {
    format!(
        "[scan]\nperiod = \"5ms\"\n[outputs]\non = [\"Y1\"]\n[[device]]\nname = \"line1\"\n\
         driver = \"modbus-tcp\"\naddress = \"127.0.0.1:{port}\"\ntimeout = \"2s\"\nloss-after = \"1s\"\n\
         {more}\n{MAP}"
    )
}

/// The two ends of a serial line, made by socat.
struct Wire {
    socat: Child,
    ends: [String; 2],
}

impl Wire {
    fn new(name: &str) -> Wire {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let id = std::process::id();
        let ends = ["rungd", "peer"]
            .map(|end| folder.join(format!("{name}-{end}-{id}")).to_str().unwrap().to_owned());
        let [a, b] = &ends;
        let pty = |end: &str| format!("pty,raw,echo=0,link={end}");
        let socat = Command::new("socat").args([pty(a), pty(b)]).spawn().unwrap();
        let deadline = Instant::now() + PATIENCE;
        while !ends.iter().all(|end| Path::new(end).exists()) {
            assert!(Instant::now() < deadline, "socat makes no line");
            std::thread::sleep(Duration::from_millis(5));
        }
        Wire { socat, ends }
    }
}

impl Drop for Wire {
    fn drop(&mut self) {
        // Remove the names first: another test may receive the numbers of these ptys at once.
        self.ends.iter().for_each(|end| drop(std::fs::remove_file(end)));
        let _ = self.socat.kill();
        let _ = self.socat.wait();
    }
}

/// A device on a line. `line9` never answers, and has a short timeout; the other devices may be
/// late on a busy machine.
fn serial(name: &str, wire: &Wire, more: &str) -> String {
    let timeout = if name == "line9" { "200ms" } else { "2s" };
    format!(
        "[[device]]\nname = \"{name}\"\ndriver = \"modbus-rtu\"\nport = \"{}\"\n\
         parity = \"none\"\ntimeout = \"{timeout}\"\nloss-after = \"3s\"\n{more}\n",
        wire.ends[0]
    )
}

fn run(controller: &str) -> (Plant, Running) {
    let plant = Plant::new(LADDER, controller);
    let running = Running::new(&mut plant.command::<&str>(&[]));
    (plant, running)
}

#[test]
fn bits_and_numbers_are_exchanged_over_tcp() {
    if !is_installed() {
        return;
    }
    let port = free_port();
    let mut peer = Peer::start("tcp", &port, &["1", "2"]);
    let (_plant, mut rungd) = run(&controller(&port, ""));
    peer.told("1 coil 2 1");
    peer.set("1 discrete 0 1");
    peer.told("1 coil 0 1");
    peer.set("1 discrete 0 0");
    peer.told("1 coil 0 0");
    // 70000 = 1 * 65536 + 4464, the low word first; written with the high word first.
    peer.set("1 input 10 4464");
    peer.set("1 input 11 1");
    peer.told("1 holding 30 1");
    peer.told("1 holding 31 4464");
    // -8 * 10 / 4 + 5 = -15, and back.
    peer.set("1 input 20 65528");
    peer.told("1 holding 40 65528");
    peer.set("2 holding 50 1234");
    peer.told("2 holding 60 1234");
    peer.fed("1 holding 99 ", 10);
    // The safe values: Y1 is ON; D11 is 15, which is (15 - 5) * 4 / 10 = 4; D10 is 0; V10 holds its
    // value.
    rungd.stop();
    let told =
        [peer.tells("1 coil 1 1", Duration::from_millis(300)), peer.tells("", Duration::ZERO)];
    assert_eq!(told, [1, 0], "a Y that is safe ON");
}

#[test]
fn the_peer_has_the_safe_values_after_the_end() {
    if !is_installed() {
        return;
    }
    let port = free_port();
    let mut peer = Peer::start("tcp", &port, &["1", "2"]);
    let (_plant, mut rungd) = run(&controller(&port, ""));
    peer.set("1 input 10 7");
    peer.set("2 holding 50 1234");
    peer.told("1 holding 31 7");
    peer.told("2 holding 60 1234");
    rungd.stop();
    for line in ["1 coil 1 1", "1 holding 31 0", "1 holding 40 4"] {
        peer.told(line);
    }
    assert_eq!(peer.tells("2 holding 60", Duration::from_millis(300)), 0, "it holds");
}

#[test]
fn a_killed_controller_stops_feeding_the_watchdog() {
    if !is_installed() {
        return;
    }
    let port = free_port();
    let mut peer = Peer::start("tcp", &port, &["1", "2"]);
    let (_plant, rungd) = run(&controller(&port, ""));
    peer.told("1 holding 99 3");
    rungd.signal("KILL");
    // What was sent before is still reported, however busy the machine is; then nothing comes.
    let deadline = Instant::now() + PATIENCE;
    while peer.tells("1 holding 99", Duration::from_millis(500)) > 0 {
        assert!(Instant::now() < deadline, "it is fed");
    }
}

#[test]
fn a_returning_peer_gets_its_outputs_again() {
    if !is_installed() {
        return;
    }
    let port = free_port();
    let mut peer = Peer::start("tcp", &port, &["1", "2"]);
    let (_plant, mut rungd) = run(&controller(&port, ""));
    // The line is well, and Y1 no longer has its safe value from before the first scan.
    peer.told("1 coil 2 1");
    peer.set("1 discrete 3 1");
    peer.told("1 coil 1 1");
    drop(peer);
    rungd.line("line1 is lost");
    let mut peer = Peer::start("tcp", &port, &["1", "2"]);
    // The new peer has no values: X3 is read as OFF. Y2 shows that the line is well.
    peer.told("1 coil 2 1");
    rungd.line("line1 is back");
    rungd.stop();
}

#[test]
fn bits_and_numbers_are_exchanged_over_a_serial_line_before_and_after_an_outage() {
    if !are_installed() {
        return;
    }
    let times = Cell::new(0);
    over_a_line(|| {
        let wire = Wire::new("wire");
        let mut peer = Peer::start("rtu", &wire.ends[1], &["1", "2"]);
        let controller = format!("[outputs]\non = [\"Y1\"]\n{}", serial("line1", &wire, MAP));
        // A loss takes this long to notice, so only a repetition on a busy machine has a longer
        // time.
        let loss_after = if times.replace(times.get() + 1) == 0 { "3s" } else { "20s" };
        let controller = controller.replace("\"3s\"", &format!("\"{loss_after}\""));
        let (_plant, mut rungd) = run(&controller);
        peer.told("1 coil 2 1");
        peer.set("1 discrete 0 1");
        peer.told("1 coil 0 1");
        peer.set("1 input 10 4464");
        peer.set("1 input 11 1");
        peer.told("1 holding 30 1");
        peer.set("2 holding 50 1234");
        peer.told("2 holding 60 1234");
        drop((peer, wire));
        rungd.line("line1 is lost");
        let wire = Wire::new("wire");
        let mut peer = Peer::start("rtu", &wire.ends[1], &["1", "2"]);
        peer.told("1 coil 2 1");
        rungd.line("line1 is back");
        peer.set("1 input 10 9");
        peer.told("1 holding 31 9");
        rungd.stop();
        // The safe value 15 is (15 - 5) * 4 / 10.
        peer.told("1 holding 40 4");
    });
}

#[test]
fn a_silent_device_does_not_disturb_others_on_its_serial_line() {
    if !are_installed() {
        return;
    }
    over_a_line(|| {
        let wire = Wire::new("shared");
        let mut peer = Peer::start("rtu", &wire.ends[1], &["1"]);
        let map = "map = [{ from = \"discrete 0\", to = \"X0\" }, \
                   { from = \"Y0..Y2\", to = \"coil 0..2\" }]";
        let absent = "unit = 9\nmap = [{ from = \"discrete 0\", to = \"X8\" }]";
        // On a busy machine the peer may be late for seconds.
        let line1 = serial("line1", &wire, map).replace("\"3s\"", "\"15s\"");
        let controller = line1 + &serial("line9", &wire, absent);
        let (_plant, mut rungd) = run(&controller);
        rungd.line("line9: reading discrete 0 of unit 9: no answer in 200 ms");
        peer.told("1 coil 2 1");
        for _ in 0..3 {
            peer.set("1 discrete 0 1");
            peer.told("1 coil 0 1");
            peer.set("1 discrete 0 0");
            peer.told("1 coil 0 0");
        }
        let lines = rungd.stop();
        let is_lost = |line: &&Value| process::message(line).starts_with("line1 is lost");
        let lost: Vec<&Value> = lines.iter().filter(is_lost).collect();
        assert!(lost.is_empty(), "{lost:#?}");
    });
}

/// Compiles the server on libmodbus; `None` without a compiler or libmodbus.
fn libmodbus(test: &str) -> Option<PathBuf> {
    let flags = Command::new("pkg-config").args(["--cflags", "--libs", "libmodbus"]).output();
    let Some(flags) = flags.ok().filter(|flags| flags.status.success()) else {
        not_installed("libmodbus-dev");
        return None;
    };
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("libmodbus-{test}"));
    let flags = String::from_utf8(flags.stdout).unwrap();
    let source = format!("{PEERS}/remote_io.c");
    let mut cc = Command::new("cc");
    cc.arg(source).arg("-o").arg(&program).args(flags.split_whitespace());
    if !cc.status().is_ok_and(|status| status.success()) {
        not_installed("a C compiler");
        return None;
    }
    Some(program)
}

/// Y0 is the inverse of X0, and a number travels to the peer and back.
const ROUND: &str = r#"
[[program]]
name = "Main"

[[program.rung]]
when = ["!X0"]
do   = ["OUT Y0"]

[[program.rung]]
when = ["$On"]
do   = ["MOVE -70000 to=D0"]

[[program.rung]]
when = ["D1 == -70000"]
do   = ["OUT Y1"]
"#;

const ROUND_MAP: &str = r#"
write-every = "50ms"
map = [
  { from = "discrete 0", to = "X0" },
  { from = "input 4..5", to = "D1", type = "i32", word-order = "low-first" },
  { from = "Y0..Y1", to = "coil 0..1" },
  { from = "D0", to = "holding 4..5", type = "i32", word-order = "low-first" },
]
"#;

fn goes_round(mut peer: Peer, device: &str) {
    let plant = Plant::new(ROUND, device);
    let mut rungd = Running::new(&mut plant.command::<&str>(&[]));
    // 2^32 - 70000 = 65534 * 65536 + 61072.
    peer.told("holding 4 61072");
    peer.told("holding 5 65534");
    peer.told("coil 1 1");
    for _ in 0..3 {
        peer.told("coil 0 1");
        peer.told("coil 0 0");
    }
    rungd.stop();
    peer.told("holding 5 0");
}

#[test]
fn a_libmodbus_server_works_as_remote_io_over_tcp() {
    let Some(program) = libmodbus("tcp") else { return };
    let port = free_port();
    let mut command = Command::new(program);
    command.args(["tcp", &port]);
    let device = format!(
        "[[device]]\nname = \"line1\"\ndriver = \"modbus-tcp\"\n\
         address = \"127.0.0.1:{port}\"\n{ROUND_MAP}"
    );
    goes_round(Peer::told_by(command), &device);
}

#[test]
fn a_libmodbus_server_works_as_remote_io_over_a_serial_line() {
    let Some(program) = libmodbus("rtu") else { return };
    if !has_socat() {
        return;
    }
    over_a_line(|| {
        let wire = Wire::new("libmodbus");
        let mut command = Command::new(&program);
        command.args(["rtu", &wire.ends[1]]);
        goes_round(Peer::told_by(command), &serial("line1", &wire, ROUND_MAP));
    });
}

#[test]
fn the_example_of_the_page_passes_the_check() {
    let page = page::text("modbus-devices.md");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("modbus-devices-page");
    std::fs::create_dir_all(&folder).unwrap();
    for name in ["oven-controller.toml", "oven.toml"] {
        std::fs::write(folder.join(name), page::file(&page, name)).unwrap();
    }
    let loaded = load::controller_file(&folder.join("oven-controller.toml")).unwrap();
    assert!(loaded.findings.is_empty(), "{:#?}", loaded.findings);
    let _ = std::fs::remove_dir_all(folder);
}
