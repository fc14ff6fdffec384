//! `config/bottling-plant.toml`: its ladder against its simulated plant in virtual time, where
//! every fault brings its alarm about; and the same with the real binary, for some seconds.

mod live;

use std::path::{Path, PathBuf};

use rungd::engine::{Cell, Engine, ScanTimes};
use rungd::io::plant::Model;
use rungd::isa::{Address, Bit, BitSpace, Health};
use rungd::load;
use rungd::lower::{Symbols, lower};
use rungd::resolve::device::{Device, Driver};
use rungd::resolve::scope::Scope;

const PERIOD_MS: u64 = 10;

/// The controller with its plant, on one grid: a scan sees what the plant told at its time.
struct Plant {
    scope: Scope,
    symbols: Symbols,
    engine: Engine,
    device: Device,
    model: Model,
    now_ms: u64,
    /// When the last good exchange was.
    good_ms: u64,
}

fn config() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("config")
}

impl Plant {
    fn new() -> Plant {
        let loaded = load::controller_file(&config().join("bottling-plant.toml")).unwrap();
        assert!(loaded.findings.is_empty(), "{:#?}", loaded.findings);
        let (program, controller) = (loaded.program.unwrap(), loaded.controller.unwrap());
        let (code, symbols) = lower(&program);
        let mut engine = Engine::new(code);
        engine.start(0);
        let device = controller.devices[0].clone();
        let Driver::Simulated(settings) = &device.driver else { panic!("{device:?}") };
        let model = Model::new(settings);
        let scope = Scope::of(&program);
        Plant { scope, symbols, engine, device, model, now_ms: 0, good_ms: 0 }
    }

    fn cell(&self, name: &str) -> Cell {
        let address = self.scope.address(name).expect("an operand");
        self.symbols.layout.cell(address).expect("a bit or a word")
    }

    fn value(&self, name: &str) -> i32 {
        let image = self.engine.image();
        match self.cell(name) {
            Cell::Bit(bit) => image.bit(bit).into(),
            Cell::Word(word) => image.word(word),
        }
    }

    fn force(&mut self, name: &str, on: bool) {
        let Cell::Bit(bit) = self.cell(name) else { panic!("{name} is a word") };
        self.engine.force_bit(bit, on);
    }

    fn scan(&mut self) {
        let image = self.engine.image();
        let value = |address| match self.symbols.layout.cell(address) {
            Some(Cell::Bit(bit)) => i32::from(image.bit(bit)),
            Some(Cell::Word(word)) => image.word(word),
            None => panic!("{address}"),
        };
        let outputs: Vec<i32> = self.device.outputs.iter().map(|out| value(out.address)).collect();
        let mut inputs: Vec<i32> =
            self.device.inputs.iter().map(|row| value(row.address)).collect();
        let done = self.model.step(self.now_ms, &outputs, &mut inputs);
        if done.is_ok() {
            self.good_ms = self.now_ms;
        }
        let stale = self.now_ms - self.good_ms > u64::from(self.device.loss_after_ms);
        if stale {
            inputs.fill(0);
        }
        self.engine.begin_scan(self.now_ms * 1_000_000, &ScanTimes::default());
        for (row, value) in self.device.inputs.iter().zip(inputs) {
            match (row.address, self.symbols.layout.cell(row.address)) {
                (Address::Bit(Bit::Space(BitSpace::X, n)), _) => {
                    self.engine.set_input(n, value != 0);
                }
                (_, Some(Cell::Word(word))) => self.engine.write_word(word, value),
                (address, _) => panic!("{address}"),
            }
        }
        for (health, on) in [(Health::Ok, done.is_ok()), (Health::Stale, stale)] {
            let bit = self.symbols.layout.bit(Bit::Device(self.device.id, health));
            self.engine.write_bit(bit, on);
        }
        self.engine.execute();
        self.now_ms += PERIOD_MS;
    }

    /// Scans up to a time, and looks behind each.
    fn until(&mut self, end_ms: u64, mut look: impl FnMut(&Plant)) {
        while self.now_ms < end_ms {
            self.scan();
            look(self);
        }
    }

    /// Which of these are ON.
    fn on<'a>(&self, names: &[&'a str]) -> Vec<&'a str> {
        names.iter().copied().filter(|name| self.value(name) != 0).collect()
    }
}

const ALARMS: [&str; 5] =
    ["contactor_fault", "no_bottle", "not_leaving", "signal_fault", "plant_lost"];

#[test]
fn a_minute_of_bottles() {
    let mut plant = Plant::new();
    let (mut least, mut most) = (i32::MAX, 0);
    plant.until(60_000, |plant| {
        assert_eq!(plant.on(&ALARMS), [""; 0], "at {} ms", plant.now_ms);
        assert!(plant.value("filler") == 0 || plant.value("belt") == 0, "filled on the move");
        (least, most) = (least.min(plant.value("level")), most.max(plant.value("level")));
    });
    // The first bottle is under the filler 5.1 s from the start, and away 9 s later; each stands
    // for 1.5 s, and the belt moves for 3 s from one to the next.
    assert_eq!(plant.value("bottles"), 11);
    assert!((150..300).contains(&least) && (900..=910).contains(&most), "{least} to {most}");
}

#[test]
fn every_fault_brings_its_alarm_about_and_start_acknowledges_it() {
    for (fault, alarm) in [
        ("C100", "no_bottle"),
        ("C101", "not_leaving"),
        ("C102", "contactor_fault"),
        ("C103", "no_bottle"),
        ("C104", "signal_fault"),
        ("C106", "plant_lost"),
    ] {
        let mut plant = Plant::new();
        plant.until(21_500, |_| {});
        assert_eq!((plant.value("running"), plant.on(&ALARMS)), (1, vec![]), "{fault}");
        plant.force(fault, true);
        plant.until(32_000, |_| {});
        assert_eq!((plant.value("running"), plant.on(&ALARMS)), (0, vec![alarm]), "{fault}");
        assert_eq!(plant.on(&["belt", "filler"]), [""; 0], "{fault}");
        plant.force(fault, false);
        // START comes every 20 s: once it acknowledges, then it starts.
        plant.until(42_000, |_| {});
        assert_eq!((plant.value("running"), plant.on(&ALARMS)), (0, vec![]), "{fault}");
        plant.until(62_000, |_| {});
        assert_eq!((plant.value("running"), plant.on(&ALARMS)), (1, vec![]), "{fault}");
    }
}

#[test]
fn noise_on_the_level_brings_nothing_about() {
    let mut plant = Plant::new();
    plant.force("C105", true);
    plant.until(60_000, |plant| assert_eq!(plant.on(&ALARMS), [""; 0]));
    assert_eq!(plant.value("bottles"), 11);
}

#[test]
fn stop_stops_the_line() {
    let mut plant = Plant::new();
    plant.until(3_000, |_| {});
    plant.force("C107", true);
    plant.until(3_100, |_| {});
    assert_eq!(plant.on(&["running", "belt"]), [""; 0]);
}

#[test]
fn the_binary_runs_it_and_a_forced_bit_cuts_the_cable() {
    let text = |name: &str| std::fs::read_to_string(config().join(name)).unwrap();
    let controller = text("bottling-plant.toml");
    let controller = controller.replace("ladder = [\"programs/bottling-plant.toml\"]", "");
    let mut live = live::Live::start(&text("programs/bottling-plant.toml"), &controller, &[]);
    live.line("belt is ON");
    live.await_values("plant.Ok plant.Stale running belt_aux", "ON OFF ON ON");
    live.ok("force C106 1");
    live.await_values("plant.Ok plant.Stale plant_lost running stop_ok", "OFF ON ON OFF OFF");
    assert!(live.ok("status").contains("the plant does not answer"));
    live.ok("force C106 0");
    live.await_values("plant.Ok plant.Stale stop_ok", "ON OFF ON");
    live.end();
}
