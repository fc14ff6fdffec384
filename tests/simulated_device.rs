//! The simulated device and the real engine, together in virtual time.

use rungd::engine::Engine;
use rungd::io::simulated::Device;
use rungd::isa::{Address, Bit, BitSpace};
use rungd::lower::{Symbols, lower};
use rungd::resolve::controller::{Device as Rule, Motion};
use rungd::resolve::{LoadOptions, load_ladders, resolve_operand};
use rungd::source::span::{SourceFile, Span};

const PERIOD_MS: u64 = 10;
const MOTOR: Bit = Bit::Space(BitSpace::Y, 1);

/// A conveyor: a button starts it, a part passes the eye every 800 ms while it runs, the motor's
/// contactor answers after 300 ms; without its answer within 500 ms there is an alarm.
const CONVEYOR: &str = r#"
[ladder]
name = "conveyor"

[tags]
start_pb = { at = "X2" }
stop_pb  = { at = "X3" }
motor    = { at = "Y1" }
answer   = { at = "X4" }
eye      = { at = "X0" }
no_motor = { at = "C0" }

[[program]]
name = "Main"

[[program.rung]]
when = ["start_pb | motor", "!stop_pb", "!no_motor"]
do   = ["OUT motor"]

[[program.rung]]
when = ["motor", "!answer"]
do   = ["TMR T0 preset=500ms"]

[[program.rung]]
when = ["T0.Done"]
do   = ["SET no_motor"]

[[program.rung]]
leg.up  = ["eye"]
leg.rst = ["$Off"]
do      = ["CNT CT0 preset=5"]
"#;

struct Plant {
    engine: Engine,
    symbols: Symbols,
    device: Device,
    program: rungd::resolve::program::Program,
    now_ms: u64,
}

fn plant(rules: &[Rule]) -> Plant {
    let file = SourceFile { name: "conveyor.toml".into(), text: CONVEYOR.into() };
    let (program, findings) = load_ladders(&[file], &LoadOptions::default());
    let program = program.unwrap_or_else(|| panic!("{findings:#?}"));
    let (code, symbols) = lower(&program);
    let mut engine = Engine::new(code);
    engine.start(0);
    Plant { engine, symbols, device: Device::new(rules), program, now_ms: 0 }
}

impl Plant {
    /// Scans for so long: the device moves before each scan, by what the scan before has shown.
    fn run_for(&mut self, time_ms: u64) {
        let end_ms = self.now_ms + time_ms;
        while self.now_ms < end_ms {
            self.engine.begin_scan(self.now_ms * 1_000_000, &Default::default());
            let (image, layout) = (self.engine.image(), &self.symbols.layout);
            for (x, on) in self.device.step(self.now_ms, |bit| image.bit(layout.bit(bit))) {
                self.engine.set_input(x, on);
            }
            self.engine.execute();
            self.now_ms += PERIOD_MS;
        }
    }

    fn press(&mut self, x: u32) {
        self.engine.set_input(x, true);
        self.run_for(PERIOD_MS);
        self.engine.set_input(x, false);
    }

    fn value(&self, operand: &str) -> i32 {
        let (image, layout) = (self.engine.image(), &self.symbols.layout);
        match resolve_operand(&self.program, operand).unwrap() {
            Address::Bit(bit) => image.bit(layout.bit(bit)).into(),
            Address::Word(word) => image.word(layout.word(word)),
            Address::Structure(_) => panic!("{operand} is a structure"),
        }
    }
}

fn eye() -> Rule {
    let motion = Motion::Pulse { width_ms: 200, every_ms: 800, offset_ms: 100 };
    Rule { input: 0, motion, while_on: Some(MOTOR), invert: false, span: Span::default() }
}

fn answer(after_ms: u32) -> Rule {
    let motion = Motion::Follow { bit: MOTOR, after_ms, release_ms: 50 };
    Rule { input: 4, motion, while_on: None, invert: false, span: Span::default() }
}

#[test]
fn parts_come_while_the_motor_runs() {
    let mut plant = plant(&[eye(), answer(300)]);
    plant.run_for(2_000);
    assert_eq!(plant.value("CT0.Acc"), 0, "nothing moves before the start");
    plant.press(2);
    plant.run_for(300);
    assert_eq!((plant.value("answer"), plant.value("CT0.Acc")), (0, 1));
    plant.run_for(10);
    assert_eq!(plant.value("answer"), 1, "300 ms after the scan that drove the motor");
    plant.run_for(4 * 800);
    assert_eq!((plant.value("CT0.Acc"), plant.value("CT0.Done")), (5, 1));
    assert_eq!(plant.value("no_motor"), 0);
    plant.press(3);
    plant.run_for(2_000);
    assert_eq!((plant.value("motor"), plant.value("answer"), plant.value("CT0.Acc")), (0, 0, 5));
    plant.press(2);
    plant.run_for(200);
    assert_eq!(plant.value("CT0.Acc"), 6, "the phase began anew with the motor");
}

#[test]
fn a_slow_answer_is_an_alarm() {
    let mut plant = plant(&[eye(), answer(600)]);
    plant.press(2);
    plant.run_for(1_000);
    assert_eq!((plant.value("motor"), plant.value("no_motor")), (0, 1));
}

#[test]
fn two_runs_are_the_same() {
    let run = || {
        let mut plant = plant(&[eye(), answer(300)]);
        plant.press(2);
        plant.run_for(12_345);
        (plant.engine.image().bits().to_vec(), plant.engine.image().words().to_vec())
    };
    assert!(run() == run());
}
