//! The Modbus server before clients that this project did not write: mbpoll and pymodbus.
//!
//! What `docs/modbus.md` shows is executed: its ladder and controller file run on the real scan
//! thread, its commands are typed, and what it says they print must be what they print. Where a
//! client is not installed its test says so and does nothing, unless `RUNGD_REQUIRE_CLIENTS=1`.

mod common;

use std::process::{Command, Output};
use std::sync::mpsc::{Sender, channel};
use std::thread::{self, JoinHandle};

use rungd::engine::Engine;
use rungd::io::modbus::{Map, Server};
use rungd::isa::{Bit, BitSpace};
use rungd::lower::lower;
use rungd::runtime::exchange::{FaultReason, Mode, Snapshot};
use rungd::runtime::{
    Memory, Observer, Pace, Posture, Record, Runtime, Safe, Settings, Statistics, Watched, prepare,
};
use tokio::sync::oneshot;

/// The page's controller, running.
struct Controller {
    port: u16,
    runtime: Option<Runtime>,
    server: Option<JoinHandle<()>>,
    stop: Option<oneshot::Sender<()>>,
}

/// Tells of the first complete scan.
struct FirstScan(Sender<()>);

impl Observer for FirstScan {
    fn record(&mut self, _: &Record) {}
    fn statistics(&mut self, _: &Statistics) {}
    fn dropped(&mut self, _: u64) {}
    fn tripped(&mut self, _: FaultReason, _: u64) {}
    fn turn(&mut self, latest: &Snapshot, _: u64) {
        if latest.mode == Mode::Run {
            let _ = self.0.send(());
        }
    }
}

fn start(page: &str) -> Controller {
    let (program, controller) = common::load(page, "filler.toml", "filler-controller.toml");
    let (code, symbols) = lower(&program);
    let layout = symbols.layout.clone();
    let ms = |ms: u32| u64::from(ms) * 1_000_000;
    let settings = Settings {
        pace: Pace {
            period_ns: ms(controller.period_ms),
            watchdog_ns: ms(2_000),
            scans: None,
            statistics_every_ns: Some(ms(60_000)),
        },
        memory: Memory {
            inputs: layout.sizes().x,
            bits: layout.bit_count() as usize,
            words: layout.word_count() as usize,
            first_output: layout.bit(Bit::Space(BitSpace::Y, 0)).0 as usize,
            safe: vec![Safe::Off; layout.sizes().y as usize],
        },
        watched: Watched::default(),
        posture: Posture::default(),
    };
    let (first, scanned) = channel();
    let prepared = prepare(Engine::new(code), &settings, FirstScan(first)).unwrap();
    let mut modbus = controller.modbus.unwrap();
    modbus.listen.set_port(0);
    let map = Map::new(&modbus, &layout, |word| symbols.limits(word));
    let tokio = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let server = tokio.block_on(Server::bind(modbus, map, prepared.port())).unwrap();
    let port = server.address().unwrap().port();
    let runtime = prepared.start().unwrap();
    scanned.recv().unwrap();
    let (stop, stopped) = oneshot::channel();
    let serve = move || tokio.block_on(server.run(async move { drop(stopped.await) }));
    let server = thread::spawn(serve);
    Controller { port, runtime: Some(runtime), server: Some(server), stop: Some(stop) }
}

impl Drop for Controller {
    fn drop(&mut self) {
        drop(self.stop.take());
        let _ = self.server.take().map(JoinHandle::join);
        if let Some(runtime) = self.runtime.take() {
            runtime.request_stop();
            runtime.join();
        }
    }
}

/// Whether a client is there to be tested with.
fn installed(client: &str, probe: &[&str]) -> bool {
    let found = Command::new(probe[0]).args(&probe[1..]).output();
    if found.is_ok_and(|output| output.status.success()) {
        return true;
    }
    let required = std::env::var("RUNGD_REQUIRE_CLIENTS").is_ok_and(|value| value == "1");
    assert!(!required, "{client} is not installed, and RUNGD_REQUIRE_CLIENTS=1 wants it");
    eprintln!("SKIPPED: {client} is not installed");
    false
}

/// Every line, with its words one space apart.
fn words(text: &str) -> Vec<String> {
    text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
}

fn everything(output: &Output) -> String {
    [&output.stdout[..], &output.stderr].map(String::from_utf8_lossy).concat()
}

#[test]
fn mbpoll_sees_what_the_page_shows() {
    if !installed("mbpoll", &["mbpoll", "-h"]) {
        return;
    }
    let page = common::page("modbus.md");
    let controller = start(&page);
    let session = common::blocks(&page, "console").join("");
    let mut commands = 0;
    for exchange in session.split("$ ").skip(1) {
        let (command, shown) = exchange.split_once('\n').expect("a command's line");
        let command = command.replace("1502", &controller.port.to_string());
        let output = Command::new("sh").args(["-c", &command]).output().unwrap();
        let printed = everything(&output);
        let mut lines = words(&printed).into_iter();
        for line in words(shown) {
            assert!(lines.any(|printed| printed == line), "{command}: {line}\n{printed}");
        }
        commands += 1;
    }
    assert!(commands >= 7, "the page's session was found: {commands} commands");
}

#[test]
fn pymodbus_sees_what_the_page_shows() {
    if !installed("pymodbus", &["python3", "-c", "import pymodbus"]) {
        return;
    }
    let page = common::page("modbus.md");
    let controller = start(&page);
    let script = common::blocks(&page, "python").concat();
    let script = script.replace("1502", &controller.port.to_string());
    let output = Command::new("python3").args(["-c", &script]).output().unwrap();
    let shown = common::blocks(&page, "text").concat();
    assert_eq!(String::from_utf8_lossy(&output.stdout), shown, "{}", everything(&output));
}
