//! A controller with a simulated plant, in virtual time.

use rungd_base::calendar::LocalTime;
use rungd_config::controller::device::{Device, DriverSettings, OnLoss};
use rungd_config::load::Loaded;
use rungd_engine::isa::{Address, Bit, BitSpace, DeviceBit, Real};
use rungd_engine::{Cell, Engine, ScanTimes};
use rungd_io::plant::Model;
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::scope::Scope;

/// The controller and its plant, on the same time grid: a scan reads the plant's inputs of the same
/// time.
pub struct Plant {
    scope: Scope,
    symbols: Symbols,
    engine: Engine,
    device: Device,
    model: Model,
    period_ms: u64,
    pub now_ms: u64,
    /// The ladder's time of day at time 0, as seconds since 1970.
    pub clock_s: i64,
    /// The time of the last good exchange.
    good_ms: u64,
}

impl Plant {
    /// The plant of a controller file with one device and no findings.
    pub fn of(loaded: Loaded) -> Plant {
        assert!(loaded.findings.is_empty(), "{:#?}", loaded.findings);
        let (program, controller) = (loaded.program.unwrap(), loaded.controller.unwrap());
        let (code, symbols) = lower(&program);
        let mut engine = Engine::new(code);
        engine.start(0);
        let device = controller.devices[0].clone();
        let DriverSettings::Simulated(settings) = &device.driver else { panic!("{device:?}") };
        let model = Model::new(settings);
        let scope = Scope::of(&program);
        Plant {
            scope,
            symbols,
            engine,
            device,
            model,
            period_ms: controller.period.ms_up().into(),
            now_ms: 0,
            clock_s: LocalTime::SIMULATED_S,
            good_ms: 0,
        }
    }

    fn cell(&self, name: &str) -> Cell {
        let address = self.scope.address(name).expect("an operand");
        self.symbols.layout.cell(address).expect("a bit or a word")
    }

    pub fn value(&self, name: &str) -> i32 {
        self.engine.image().value(self.cell(name))
    }

    /// The value of an R word.
    pub fn real(&self, name: &str) -> f64 {
        Real::of_cell(self.value(name)).into()
    }

    /// Writes a word, as an operator does; for an R word, `value` is the content of the cell.
    pub fn write(&mut self, name: &str, value: i32) {
        let Cell::Word(word) = self.cell(name) else { panic!("{name} is a bit") };
        self.engine.write_word(word, value);
    }

    pub fn force(&mut self, name: &str, on: bool) {
        let Cell::Bit(bit) = self.cell(name) else { panic!("{name} is a word") };
        self.engine.force_bit(bit, on);
    }

    pub fn scan(&mut self) {
        let image = self.engine.image();
        let value = |address| match self.symbols.layout.cell(address) {
            Some(cell) => image.value(cell),
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
        if stale && self.device.on_loss == OnLoss::Zero {
            inputs.fill(0);
        }
        self.engine.begin_scan(
            self.now_ms * 1_000_000,
            &ScanTimes::default(),
            &LocalTime::of(self.clock_s + (self.now_ms / 1000) as i64),
        );
        for (row, value) in self.device.inputs.iter().zip(inputs) {
            match (row.address, self.symbols.layout.cell(row.address)) {
                (Address::Bit(Bit::Space(BitSpace::X, n)), _) => {
                    self.engine.set_input(n, value != 0);
                }
                (_, Some(Cell::Word(word))) => self.engine.write_word(word, value),
                (address, _) => panic!("{address}"),
            }
        }
        for (health, on) in [(DeviceBit::Ok, done.is_ok()), (DeviceBit::Stale, stale)] {
            let bit = self.symbols.layout.bit(Bit::Device(self.device.id, health));
            self.engine.write_bit(bit, on);
        }
        self.engine.execute();
        self.now_ms += self.period_ms;
    }

    /// Scans up to a time; calls `look` after each scan.
    pub fn until(&mut self, end_ms: u64, mut look: impl FnMut(&Plant)) {
        while self.now_ms < end_ms {
            self.scan();
            look(self);
        }
    }

    /// The operands among `names` that are ON.
    pub fn on<'a>(&self, names: &[&'a str]) -> Vec<&'a str> {
        names.iter().copied().filter(|name| self.value(name) != 0).collect()
    }
}
