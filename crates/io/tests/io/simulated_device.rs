//! The rules of `[[simulated-device]]` and the real engine, together in virtual time: the plant of
//! `docs/simulated-device.md` in its older form.

use rungd_base::calendar::LocalTime;
use rungd_config::controller::{Controller, read, resolve_controller};
use rungd_engine::Engine;
use rungd_engine::isa::Address;
use rungd_io::plant::RuleSet;
use rungd_io::plant::settings::{InputRule, PartSettings};
use rungd_language::format::upgraded;
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::reader::Text;
use rungd_language::source::span::{FileId, SourceFile};
use rungd_test_support::page;

const PERIOD_MS: u64 = 10;

/// The page's controller file in the older form.
const OLD: &str = r#"# conveyor-controller.toml
ladder = ["conveyor.toml"]

[[simulated-device]]           # a part passes the eye every 800 ms while the motor runs
input  = "X0"
pulse  = "200ms"
every  = "800ms"
offset = "100ms"
while  = "Y1"

[[simulated-device]]           # the contactor answers after 300 ms, and lets go after 50 ms
input   = "X4"
follows = "Y1"
after   = "300ms"
release = "50ms"

[[simulated-device]]           # a guard that is closed (ON) while nothing moves
input   = "X5"
follows = "Y1"
invert  = true
"#;

struct Plant {
    engine: Engine,
    symbols: Symbols,
    device: RuleSet,
    program: Program,
    now_ms: u64,
}

/// The page's ladder, loaded without a finding with a controller file.
fn load(page: &str, controller: &str) -> (Program, Controller) {
    let devices = match controller.contains("[[device]]") {
        true => vec![Text { text: "simulated".into(), ..Text::default() }],
        false => Vec::new(),
    };
    let options = LoadOptions { devices, ..LoadOptions::default() };
    let name = "conveyor.toml".to_owned();
    let source = SourceFile { text: page::file(page, &name), name };
    let (program, findings) = load_ladders(&[source], &options);
    let program = program.unwrap_or_else(|| panic!("{findings:#?}"));
    let (written, findings) = read(controller, FileId(1));
    assert!(findings.is_empty(), "{findings:#?}");
    let (controller, findings) = resolve_controller(&written.expect("TOML"), &program);
    assert!(findings.is_empty(), "{findings:#?}");
    (program, controller)
}

/// The page's plant with changed rules.
fn plant(change: impl Fn(&mut [InputRule])) -> Plant {
    let page = page::text("simulated-device.md");
    let (program, controller) = load(&page, OLD);
    let (code, symbols) = lower(&program);
    let mut engine = Engine::new(code);
    engine.start(0);
    let mut rules = controller.rules;
    change(&mut rules);
    Plant { engine, symbols, device: RuleSet::new(&rules), program, now_ms: 0 }
}

impl Plant {
    /// Scans for a time. Before each scan, the device moves by the outputs of the previous scan.
    fn run_for(&mut self, time_ms: u64) {
        let end_ms = self.now_ms + time_ms;
        while self.now_ms < end_ms {
            self.engine.begin_scan(
                self.now_ms * 1_000_000,
                &Default::default(),
                &LocalTime::default(),
            );
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
        match self.program.scope().address(operand).unwrap() {
            Address::Bit(bit) => image.bit(layout.bit(bit)).into(),
            Address::Word(word) => image.word(layout.word(word)),
            Address::Structure(_) => panic!("{operand} is a structure"),
        }
    }
}

#[test]
fn parts_arrive_only_while_the_motor_runs() {
    let mut plant = plant(|_| {});
    plant.run_for(2_000);
    assert_eq!(plant.value("parts.Acc"), 0, "nothing moves before the start");
    plant.press(2);
    plant.run_for(300);
    assert_eq!((plant.value("answer"), plant.value("parts.Acc")), (0, 1));
    plant.run_for(10);
    assert_eq!(plant.value("answer"), 1, "300 ms after the scan that drove the motor");
    plant.run_for(4 * 800);
    assert_eq!((plant.value("parts.Acc"), plant.value("parts.Done")), (5, 1));
    assert_eq!(plant.value("no_motor"), 0);
    plant.press(3);
    plant.run_for(2_000);
    assert_eq!((plant.value("motor"), plant.value("answer"), plant.value("parts.Acc")), (0, 0, 5));
    plant.press(2);
    plant.run_for(200);
    assert_eq!(plant.value("parts.Acc"), 6, "the phase began anew with the motor");
}

#[test]
fn a_slow_motor_answer_raises_an_alarm() {
    let mut plant = plant(|rules| {
        let PartSettings::Delay { delays, .. } = &mut rules[1].part else {
            panic!("the answer follows: {:?}", rules[1])
        };
        delays.after_ms = 600;
    });
    plant.press(2);
    plant.run_for(1_000);
    assert_eq!((plant.value("motor"), plant.value("no_motor")), (0, 1));
}

#[test]
fn the_controller_file_of_the_page_is_in_the_new_form() {
    let page = page::text("simulated-device.md");
    let text = page::file(&page, "conveyor-controller.toml");
    let present = upgraded(OLD).expect("TOML").text;
    assert_eq!(text.trim_end(), present.trim_end());
    let (_, controller) = load(&page, &text);
    assert_eq!((controller.devices.len(), controller.rules.len()), (1, 0));
}

#[test]
fn two_runs_of_the_simulation_give_equal_memory() {
    let run = || {
        let mut plant = plant(|_| {});
        plant.press(2);
        plant.run_for(12_345);
        (plant.engine.image().bits().to_vec(), plant.engine.image().words().to_vec())
    };
    assert!(run() == run());
}
