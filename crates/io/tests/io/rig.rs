//! A ladder with a field device, scanned on a simulated clock; the test acts as the device.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::{Arc, Mutex};

use rungd_base::calendar::LocalTime;
use rungd_engine::Engine;
use rungd_engine::isa::Address;
use rungd_language::lower::lower;
use rungd_language::resolve::program::Program;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use rungd_runtime::exchange::{FaultReason, Port, Snapshot, Tempo};
use rungd_runtime::inputs::InputEnd;
use rungd_runtime::pacing::Clock;
use rungd_runtime::wiring::{OutputSource, Wiring, WiringTarget};
use rungd_runtime::{
    DeviceEdge, Monitor, Observer, Posture, PublicMemory, RecordEvent, RuntimeParts, SafeState,
    ScanRecord, Scanner, ScannerSettings, Statistics, ThreadSettings, WatchedCells, assemble_whole,
    monotonic_ns,
};

pub const MS: u64 = 1_000_000;
pub const PERIOD_NS: u64 = 10 * MS;
pub const LOSS_NS: u64 = 100 * MS;

#[derive(Clone, Default)]
pub struct SimulatedClock(pub Rc<Cell<u64>>);

impl Clock for SimulatedClock {
    fn now_ns(&self) -> u64 {
        self.0.get()
    }

    fn sleep_until(&mut self, deadline_ns: u64) {
        self.0.set(self.0.get().max(deadline_ns));
    }

    fn local_s(&self) -> i64 {
        LocalTime::SIMULATED_S
    }
}

/// Keeps the events about devices.
#[derive(Clone, Default)]
pub struct Heard(pub Arc<Mutex<Vec<(u64, DeviceEdge)>>>);

impl Observer for Heard {
    fn record(&mut self, record: &ScanRecord) {
        if let RecordEvent::Device { device: 0, edge } = record.what {
            self.0.lock().unwrap().push((record.scan, edge));
        }
    }

    fn statistics(&mut self, _: &Statistics) {}
    fn dropped(&mut self, _: u64) {}
    fn tripped(&mut self, _: FaultReason, _: u64) {}
    fn turn(&mut self, _: &Snapshot, _: u64) {}
    fn ended(&mut self, _: u64) {}
}

const LADDER: &str = r#"
[ladder]
devices = ["line1"]

[tags]
ready = { at = "X3", initial = true }

[[program]]
name = "Main"
rung = [
  { when = ["line1.Ok"], do = ["OUT Y0"] },
  { when = ["line1.Stale"], do = ["OUT Y1"] },
  { when = ["X0"], do = ["OUT Y2"] },
  { when = ["ready"], do = ["OUT Y3"] },
  { when = ["$On"], do = ["MOVE D0 to=D1", "ADD V0 1 to=V0"] },
]
"#;

pub struct Rig {
    pub program: Program,
    pub symbols: rungd_language::lower::Symbols,
    pub scanner: Scanner<Engine, SimulatedClock>,
    pub monitor: Monitor<Heard>,
    pub port: Port,
    pub heard: Heard,
    line: Option<InputEnd>,
    pub clock: SimulatedClock,
    /// The device's outputs: Y2, D1 (safe: -1), V0 (safe: as it is).
    pub sources: Vec<OutputSource>,
}

/// X0, X3, D0 and V0 come from the device; Y2, D1 and V0 go to it.
pub fn rig(zero_on_loss: bool) -> Rig {
    let file = SourceFile { name: "line.toml".into(), text: LADDER.into() };
    let (program, findings) = load_ladders(&[file], &LoadOptions::default());
    let program = program.unwrap_or_else(|| panic!("{findings:#?}"));
    let (code, symbols) = lower(&program);
    let layout = &symbols.layout;
    let bit = |name: &str| match program.scope().address(name) {
        Ok(Address::Bit(bit)) => layout.bit(bit),
        other => panic!("{name}: {other:?}"),
    };
    let word = |name: &str| match program.scope().address(name) {
        Ok(Address::Word(word)) => (layout.word(word), word.range()),
        other => panic!("{name}: {other:?}"),
    };
    let target = |name: &str| {
        let (cell, (min, max)) = word(name);
        WiringTarget::Word { cell, min, max }
    };
    let wiring = Wiring {
        inputs: vec![WiringTarget::Input(0), WiringTarget::Input(3), target("D0"), target("V0")],
        outputs: vec![
            OutputSource::Output(2),
            OutputSource::Cell(rungd_engine::Cell::Word(word("D1").0), Some(-1)),
            OutputSource::Cell(rungd_engine::Cell::Word(word("V0").0), None),
        ],
        ok: bit("line1.Ok"),
        stale: bit("line1.Stale"),
        loss_after_ns: LOSS_NS,
        zero_on_loss,
        local_budget_ns: None,
    };
    let mut safe = vec![SafeState::Off; program.sizes.y as usize];
    safe[3] = SafeState::Hold;
    let settings = ThreadSettings {
        pace: ScannerSettings {
            tempo: Tempo { period_ns: PERIOD_NS, watchdog_ns: 200 * MS },
            scans: None,
            statistics_every_ns: None,
            start_in_stop: None,
        },
        memory: PublicMemory::new(layout, safe),
        watched: WatchedCells::default(),
        posture: Posture::default(),
        field: vec![wiring.clone()],
    };
    let (clock, heard) = (SimulatedClock::default(), Heard::default());
    clock.0.set(1000 * MS);
    let engine = Engine::new(code);
    let whole = assemble_whole(engine, clock.clone(), &settings, heard.clone());
    let RuntimeParts { mut scanner, monitor, port, mut lines, .. } = whole;
    port.set_input(3, true);
    scanner.start();
    let (line, sources) = (Some(lines.remove(0).inputs), wiring.outputs);
    Rig { program, symbols, scanner, monitor, port, heard, line, clock, sources }
}

impl Rig {
    /// The line, for a driver's task.
    pub fn take_line(&mut self) -> InputEnd {
        self.line.take().expect("it is taken once")
    }

    /// The line, for the test itself.
    pub fn line(&mut self) -> &mut InputEnd {
        self.line.as_mut().expect("no task has it")
    }

    /// Advances the simulated clock to the real one, by which tasks measure the age of exchanges.
    pub fn advance_to_now(&self) {
        self.clock.0.set(self.clock.0.get().max(monotonic_ns()));
    }

    /// A good exchange, now.
    pub fn deliver(&mut self, x0: i32, x3: i32, d0: i32, v0: i32) {
        let now_ns = self.clock.now_ns();
        self.line().deliver(&[x0, x3, d0, v0].map(Some), now_ns);
        self.line().well(now_ns);
    }

    /// A failed exchange that has read these inputs nevertheless.
    pub fn deliver_part(&mut self, inputs: [Option<i32>; 4]) {
        let now_ns = self.clock.now_ns();
        self.line().trouble();
        self.line().deliver(&inputs, now_ns);
    }

    pub fn scans(&mut self, count: u64) {
        for _ in 0..count {
            assert!(self.scanner.step());
            self.monitor.turn(self.clock.now_ns());
        }
    }

    pub fn value(&self, name: &str) -> i32 {
        let image = self.port.latest();
        let address = self.program.scope().address(name).expect(name);
        image.value(self.symbols.layout.cell(address).expect(name))
    }

    pub fn values(&self, names: &[&str]) -> Vec<i32> {
        names.iter().map(|name| self.value(name)).collect()
    }

    pub fn told(&self) -> Vec<(u64, DeviceEdge)> {
        std::mem::take(&mut self.heard.0.lock().unwrap())
    }
}
