//! A scanner with a local device whose lines a test controls, in virtual time.

use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, ThreadId};
use std::time::Duration;

use rungd_base::calendar::LocalTime;
use rungd_engine::isa::Address;
use rungd_engine::{Cell as MemoryCell, Engine, Transfer};
use rungd_language::lower::lower;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use rungd_runtime::exchange::{FaultReason, Mode, Port, Snapshot, Tempo};
use rungd_runtime::local::{Local, LocalEnd};
use rungd_runtime::pacing::Clock;
use rungd_runtime::wiring::{OutputSource, Wiring, WiringTarget};
use rungd_runtime::{
    CarriedWatches, Monitor, Observer, Package, PackageParts, Posture, PublicMemory, Reloader,
    RuntimeParts, SafeState, ScanRecord, Scanner, ScannerSettings, Statistics, ThreadSettings,
    WatchedCells, assemble_whole,
};

pub use rungd_test_support::patience::PATIENCE;

pub const MS: u64 = 1_000_000;
/// The budget of an exchange. A fake needs that long only if a test makes it late.
pub const BUDGET_NS: u64 = 50 * MS;

pub const LADDER: &str = r#"
[ladder]
devices = ["local"]

[[program]]
name = "Main"
rung = [
  { when = ["X0"], do = ["OUT Y0", "SET Y2", "SET C0"] },
  { when = ["!X0"], do = ["OUT Y1", "RST Y2", "RST C0"] },
  { when = ["X1"], do = ["STOP"] },
  { when = ["local.Ok"], do = ["OUT C8"] },
]
"#;

#[derive(Clone, Default)]
pub struct TestClock(pub Arc<AtomicU64>);

impl Clock for TestClock {
    fn now_ns(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    fn sleep_until(&mut self, deadline_ns: u64) {
        self.0.fetch_max(deadline_ns, Ordering::Relaxed);
    }

    fn local_s(&self) -> i64 {
        LocalTime::SIMULATED_S
    }
}

pub struct Deaf;

impl Observer for Deaf {
    fn record(&mut self, _: &ScanRecord) {}
    fn statistics(&mut self, _: &Statistics) {}
    fn dropped(&mut self, _: u64) {}
    fn tripped(&mut self, _: FaultReason, _: u64) {}
    fn turn(&mut self, _: &Snapshot, _: u64) {}
    fn ended(&mut self, _: u64) {}
}

/// Lines that a test controls.
#[derive(Default)]
pub struct Fake {
    pub inputs: Mutex<[i32; 2]>,
    /// All writes.
    pub writes: Mutex<Vec<Vec<i32>>>,
    /// The error number with which calls fail; 0: calls succeed.
    pub errno: AtomicI32,
    /// The duration of a read, ns.
    pub slow_read: AtomicU64,
    /// The thread whose reads do not end; `stuck_write` has the thread whose writes do not end.
    pub stuck_read: Mutex<Option<ThreadId>>,
    pub stuck_write: Mutex<Option<ThreadId>>,
    pub is_stuck: AtomicBool,
}

impl Fake {
    pub fn wait(&self, whose: &Mutex<Option<ThreadId>>) {
        if *whose.lock().unwrap() != Some(thread::current().id()) {
            return;
        }
        self.is_stuck.store(true, Ordering::Release);
        while whose.lock().unwrap().is_some() {
            thread::sleep(Duration::from_millis(1));
        }
    }

    pub fn result(&self) -> Result<(), i32> {
        match self.errno.load(Ordering::Acquire) {
            0 => Ok(()),
            errno => Err(errno),
        }
    }

    /// The writes since the last call.
    pub fn written(&self) -> Vec<Vec<i32>> {
        std::mem::take(&mut self.writes.lock().unwrap())
    }

    pub fn set(&self, x0: i32, x1: i32) {
        *self.inputs.lock().unwrap() = [x0, x1];
    }
}

impl Local for Fake {
    fn read(&self, inputs: &mut [i32]) -> Result<(), i32> {
        self.wait(&self.stuck_read);
        thread::sleep(Duration::from_nanos(self.slow_read.load(Ordering::Acquire)));
        inputs.copy_from_slice(&*self.inputs.lock().unwrap());
        self.result()
    }

    fn write(&self, outputs: &[i32]) -> Result<(), i32> {
        self.wait(&self.stuck_write);
        self.result()?;
        self.writes.lock().unwrap().push(outputs.to_vec());
        Ok(())
    }
}

pub struct Rig {
    pub scanner: Scanner<Engine, TestClock>,
    pub monitor: Monitor<Deaf>,
    pub port: Port,
    pub reloader: Reloader<Engine>,
    pub line: LocalEnd,
    pub clock: TestClock,
    pub code: rungd_engine::EngineProgram,
    pub contents: PackageParts,
    pub c8: rungd_engine::BitCell,
}

/// Inputs: X0 and X1. Outputs: Y0 (safe: OFF), Y1 (ON), Y2 (as it is), C0 (ON) and C0 again (as it
/// is).
pub fn rig() -> Rig {
    let file = SourceFile { name: "local.toml".into(), text: LADDER.into() };
    let (program, findings) = load_ladders(&[file], &LoadOptions::default());
    let program = program.unwrap_or_else(|| panic!("{findings:#?}"));
    let (code, symbols) = lower(&program);
    let layout = &symbols.layout;
    let bit = |name: &str| match program.scope().address(name) {
        Ok(Address::Bit(bit)) => layout.bit(bit),
        other => panic!("{name}: {other:?}"),
    };
    let c0 = MemoryCell::Bit(bit("C0"));
    let wiring = Wiring {
        inputs: vec![WiringTarget::Input(0), WiringTarget::Input(1)],
        outputs: vec![
            OutputSource::Output(0),
            OutputSource::Output(1),
            OutputSource::Output(2),
            OutputSource::Cell(c0, Some(1)),
            OutputSource::Cell(c0, None),
        ],
        ok: bit("local.Ok"),
        stale: bit("local.Stale"),
        loss_after_ns: 100 * MS,
        zero_on_loss: false,
        local_budget_ns: Some(BUDGET_NS),
    };
    let mut safe = vec![SafeState::Off; program.sizes.y as usize];
    safe[1..3].copy_from_slice(&[SafeState::On, SafeState::Hold]);
    let settings = ThreadSettings {
        pace: ScannerSettings {
            tempo: Tempo { period_ns: 10 * MS, watchdog_ns: 200 * MS },
            scans: None,
            statistics_every_ns: None,
            start_in_stop: None,
        },
        memory: PublicMemory::new(layout, safe),
        watched: WatchedCells::default(),
        posture: Posture::default(),
        field: vec![wiring],
    };
    let clock = TestClock::default();
    clock.0.store(1000 * MS, Ordering::Relaxed);
    let contents = PackageParts {
        transfer: Transfer::memory(layout, layout),
        generation: 0,
        tempo: settings.pace.tempo,
        asked: Vec::new(),
        watched: WatchedCells::default(),
        carried: CarriedWatches::default(),
        bits: settings.memory.bits,
        words: settings.memory.words,
        safe: settings.memory.safe.clone(),
    };
    let whole = assemble_whole(Engine::new(code.clone()), clock.clone(), &settings, Deaf);
    let RuntimeParts { mut scanner, monitor, port, reloader, mut lines } = whole;
    scanner.start();
    let line = lines.remove(0).local.expect("it is local");
    Rig { scanner, monitor, port, reloader, line, clock, code, contents, c8: bit("C8") }
}

impl Rig {
    /// A rig with lines from before the first scan.
    pub fn with(fake: &Arc<Fake>) -> Rig {
        let mut rig = rig();
        rig.hand_in(fake);
        rig
    }

    pub fn hand_in(&mut self, fake: &Arc<Fake>) {
        let local: Arc<dyn Local> = Arc::clone(fake) as Arc<dyn Local>;
        assert!(self.line.hand_in(local));
    }

    pub fn scans(&mut self, count: u64) {
        for _ in 0..count {
            assert!(self.scanner.step());
            self.monitor.turn(self.clock.now_ns());
        }
    }

    /// Reloads the same program with these safe values of Y0, Y1 and Y2.
    pub fn reload(&mut self, safe: [SafeState; 3]) {
        self.contents.generation += 1;
        self.contents.safe[..3].copy_from_slice(&safe);
        let (machine, latest) = (Engine::new(self.code.clone()), self.port.latest());
        let package = Package::new(machine, self.contents.clone(), &latest);
        self.reloader.hand_in(package, false).unwrap();
        self.scans(2);
    }

    pub fn mode(&self) -> Mode {
        self.port.latest().mode
    }

    pub fn is_ok(&self) -> bool {
        self.port.latest().bit(self.c8)
    }
}

pub fn fake(x0: i32) -> Arc<Fake> {
    let fake = Arc::new(Fake::default());
    fake.set(x0, 0);
    fake
}
