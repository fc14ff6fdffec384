//! A first scan that takes a second with a watchdog of less, observed by a Modbus client: the mode
//! is FAULT, outputs are safe, reads are answered, writes are refused.
//!
//! The client is a dozen lines of raw TCP, so that no library stands between the test and the
//! bytes.

use std::io::{BufRead, BufReader, Read, Write as _};
use std::net::{TcpListener, TcpStream};
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rungd_test_support::metronome::Stopwatch;
use rungd_test_support::running::process::{
    BLINKS, Need, PATIENCE, Plant, Running, message, mounted, skip,
};

/// The first complete scan would drive Y0 and Y1 ON. The safe value of Y2 is ON.
const LADDER: &str = r#"
[[program]]
name = "Main"
rung = [ { when = ["$On"], do = ["OUT Y0", "OUT Y1"] } ]
"#;

struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Sends a PDU and returns the PDU of the reply.
fn ask(client: &mut TcpStream, pdu: &[u8]) -> Vec<u8> {
    let mut frame = vec![0, 7, 0, 0, 0, pdu.len() as u8 + 1, 1];
    frame.extend(pdu);
    client.write_all(&frame).unwrap();
    let mut head = [0; 7];
    client.read_exact(&mut head).unwrap();
    let mut reply = vec![0; usize::from(head[5]) - 1];
    client.read_exact(&mut reply).unwrap();
    reply
}

/// An address that was free a moment ago.
fn free_address() -> String {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string()
}

#[test]
fn a_client_that_sees_a_fault_sees_safe_outputs() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a build without debug assertions has no faults on purpose");
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("watchdog-fault");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("ladder.toml"), LADDER).unwrap();
    std::fs::write(folder.join("faults"), "stall").unwrap();
    let listen = free_address();
    let controller = format!(
        "ladder = [\"ladder.toml\"]\nscan.watchdog = \"100ms\"\noutputs.on = [\"Y2\"]\n\
         [modbus-server]\nlisten = \"{listen}\"\nwritable = [\"MC9\"]\n\
         image.outputs = {{ from = \"Y0..Y7\", to = \"MI1..MI8\" }}\n"
    );
    std::fs::write(folder.join("controller.toml"), controller).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.arg("run").arg(folder.join("controller.toml")).env_remove("RUNGD_LOG");
    let _ = std::fs::remove_file(folder.join("notify"));
    let systemd = UnixDatagram::bind(folder.join("notify")).unwrap();
    command.env("NOTIFY_SOCKET", folder.join("notify")).env("RUNGD_FAULTS", folder.join("faults"));
    let mut rungd = Killed(command.stderr(Stdio::piped()).spawn().unwrap());
    let log = BufReader::new(rungd.0.stderr.take().unwrap());
    let mut said = String::new();
    let fault = log.lines().map(Result::unwrap).find(|line| {
        said += line;
        line.contains("FAULT: a scan")
    });
    assert!(fault.is_some(), "{said}");

    let mut client = TcpStream::connect(&listen).unwrap();
    client.set_read_timeout(Some(PATIENCE)).unwrap();
    // FC 2, eight inputs from MI1: only Y2 is ON.
    let deadline = Instant::now() + PATIENCE;
    while ask(&mut client, &[2, 0, 0, 0, 8]) != [2, 1, 0b100] {
        assert!(Instant::now() < deadline, "outputs are not safe");
        std::thread::sleep(Duration::from_millis(5));
    }
    // FC 5, MC9 ON: exception 4 (server device failure), at once.
    let watch = Stopwatch::start(rungd.0.id());
    assert_eq!(ask(&mut client, &[5, 0, 8, 0xff, 0]), [0x85, 4]);
    assert!(watch.elapsed() < Duration::from_secs(5), "refused, not timed out");
    // No scan ever completed: systemd receives the FAULT as status, and never READY.
    systemd.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut heard = String::new();
    while !heard.contains("STATUS=FAULT") {
        let mut bytes = [0; 512];
        let length = systemd.recv(&mut bytes).unwrap_or_else(|_| panic!("only {heard}"));
        heard += &String::from_utf8_lossy(&bytes[..length]);
    }
    assert!(!heard.contains("READY=1"), "{heard}");
    let _ = std::fs::remove_dir_all(&folder);
}

/// A fault within the first second of a loaded machine: its line has what would help, the load, and
/// a command for the scans before it.
#[test]
fn a_fault_under_load_names_its_remedy() {
    if !cfg!(debug_assertions) {
        return skip(Need::Faults, "a build without debug assertions has no faults on purpose");
    }
    let plant = Plant::new(BLINKS, "scan.watchdog = \"200ms\"\n[operator]\nsocket = \"op\"\n");
    let load = plant.0.join("loadavg");
    std::fs::write(&load, "10.40 9.00 8.00 3/400 1234\n").unwrap();
    let bound = format!("mount --bind {} /proc/loadavg && exec \"$@\"", load.display());
    let prefix = mounted(&bound).filter(|prefix| {
        let mut probe = Command::new(&prefix[0]);
        let done = probe.args(&prefix[1..]).arg("true").stderr(Stdio::null()).status();
        done.is_ok_and(|status| status.success())
    });
    let Some(prefix) = prefix else {
        return skip(Need::MountNamespace, "no mount namespace to be had");
    };
    let faults = plant.0.join("faults");
    let mut command = plant.command(&prefix);
    let running = Running::new(command.env("RUNGD_FAULTS", &faults));
    running.line("lamp is ON");
    std::fs::write(&faults, "stall").unwrap();
    let line = running.line("FAULT: ");
    let said = message(&line);
    let processors = std::thread::available_parallelism().unwrap();
    for words in [
        "give the scan thread a real-time priority (`[realtime] policy = \"fifo\"`",
        &format!(" (load 10.4 on {processors} processor"),
        "`rungd record cut --from \"scan 1\" --to \"scan ",
    ] {
        assert!(said.contains(words), "no {words}: {said}");
    }
    assert!(!said.contains("--to \"scan 0\""), "{said}");
}
