//! Local devices: lines that the scan itself reads and writes. What goes to them in RUN, at a
//! stop, in a fault, where a scan never ends; and when the scan lets go of one.

use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

use rungd::engine::{Cell as MemoryCell, Engine, Transfer};
use rungd::io::device::{Health, Keeper, Opener};
use rungd::isa::{Address, Bit, BitSpace};
use rungd::lower::lower;
use rungd::resolve::{LoadOptions, load_ladders, resolve_operand};
use rungd::runtime::command::Command;
use rungd::runtime::exchange::{FaultReason, Mode, Port, Snapshot, Tempo};
use rungd::runtime::local::{Local, LocalEnd, LocalFailure};
use rungd::runtime::pacing::Clock;
use rungd::runtime::wiring::{Source, Target, Wiring};
use rungd::runtime::{
    Carried, Contents, Memory, Monitor, Observer, Pace, Package, Posture, Record, Reloader, Safe,
    Scanner, Settings, Statistics, Watched, Whole, assemble_whole,
};
use rungd::source::span::SourceFile;

const MS: u64 = 1_000_000;
/// An exchange of a fake that is not told to be late never takes so long.
const BUDGET_NS: u64 = 50 * MS;
const PATIENCE: Duration = Duration::from_secs(30);

const LADDER: &str = r#"
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
struct TestClock(Arc<AtomicU64>);

impl Clock for TestClock {
    fn now_ns(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    fn sleep_until(&mut self, deadline_ns: u64) {
        self.0.fetch_max(deadline_ns, Ordering::Relaxed);
    }
}

struct Deaf;

impl Observer for Deaf {
    fn record(&mut self, _: &Record) {}
    fn statistics(&mut self, _: &Statistics) {}
    fn dropped(&mut self, _: u64) {}
    fn tripped(&mut self, _: FaultReason, _: u64) {}
    fn turn(&mut self, _: &Snapshot, _: u64) {}
    fn ended(&mut self, _: u64) {}
}

/// Lines that do as a test says.
#[derive(Default)]
struct Fake {
    inputs: Mutex<[i32; 2]>,
    /// All that was written.
    writes: Mutex<Vec<Vec<i32>>>,
    /// The number with which calls fail; 0: none does.
    errno: AtomicI32,
    /// How long a read takes.
    slow_read: AtomicU64,
    /// The thread whose reads, or writes, do not end.
    stuck_read: Mutex<Option<ThreadId>>,
    stuck_write: Mutex<Option<ThreadId>>,
    is_stuck: AtomicBool,
}

impl Fake {
    fn wait(&self, whose: &Mutex<Option<ThreadId>>) {
        if *whose.lock().unwrap() != Some(thread::current().id()) {
            return;
        }
        self.is_stuck.store(true, Ordering::Release);
        while whose.lock().unwrap().is_some() {
            thread::sleep(Duration::from_millis(1));
        }
    }

    fn result(&self) -> Result<(), i32> {
        match self.errno.load(Ordering::Acquire) {
            0 => Ok(()),
            errno => Err(errno),
        }
    }

    /// What was written since it was asked last.
    fn written(&self) -> Vec<Vec<i32>> {
        std::mem::take(&mut self.writes.lock().unwrap())
    }

    fn set(&self, x0: i32, x1: i32) {
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

struct Rig {
    scanner: Scanner<Engine, TestClock>,
    monitor: Monitor<Deaf>,
    port: Port,
    reloader: Reloader<Engine>,
    line: LocalEnd,
    clock: TestClock,
    code: rungd::engine::Program,
    contents: Contents,
    c8: rungd::engine::BitCell,
}

/// X0 and X1 come in. Out go Y0 (safe: OFF), Y1 (ON), Y2 (as it is), C0 (ON) and C0 again (as it is).
fn rig() -> Rig {
    let file = SourceFile { name: "local.toml".into(), text: LADDER.into() };
    let (program, findings) = load_ladders(&[file], &LoadOptions::default());
    let program = program.unwrap_or_else(|| panic!("{findings:#?}"));
    let (code, symbols) = lower(&program);
    let layout = &symbols.layout;
    let bit = |name: &str| match resolve_operand(&program, name) {
        Ok(Address::Bit(bit)) => layout.bit(bit),
        other => panic!("{name}: {other:?}"),
    };
    let c0 = MemoryCell::Bit(bit("C0"));
    let wiring = Wiring {
        inputs: vec![Target::Input(0), Target::Input(1)],
        outputs: vec![
            Source::Output(0),
            Source::Output(1),
            Source::Output(2),
            Source::Cell(c0, Some(1)),
            Source::Cell(c0, None),
        ],
        ok: bit("local.Ok"),
        stale: bit("local.Stale"),
        loss_after_ns: 100 * MS,
        zero_on_loss: false,
        local_budget_ns: Some(BUDGET_NS),
    };
    let mut safe = vec![Safe::Off; program.sizes.y as usize];
    safe[1..3].copy_from_slice(&[Safe::On, Safe::Hold]);
    let settings = Settings {
        pace: Pace {
            tempo: Tempo { period_ns: 10 * MS, watchdog_ns: 200 * MS },
            scans: None,
            statistics_every_ns: None,
            start_in_stop: None,
        },
        memory: Memory {
            inputs: program.sizes.x,
            bits: layout.bit_count() as usize,
            words: layout.word_count() as usize,
            first_output: layout.bit(Bit::Space(BitSpace::Y, 0)).0 as usize,
            forces_active: layout.bit(Bit::Space(BitSpace::St, 9)).0 as usize,
            safe,
        },
        watched: Watched::default(),
        posture: Posture::default(),
        field: vec![wiring],
    };
    let clock = TestClock::default();
    clock.0.store(1000 * MS, Ordering::Relaxed);
    let contents = Contents {
        transfer: Transfer::memory(layout, layout),
        generation: 0,
        tempo: settings.pace.tempo,
        asked: Vec::new(),
        watched: Watched::default(),
        carried: Carried::default(),
        bits: settings.memory.bits,
        words: settings.memory.words,
        safe: settings.memory.safe.clone(),
    };
    let whole = assemble_whole(Engine::new(code.clone()), clock.clone(), &settings, Deaf);
    let Whole { mut scanner, monitor, port, reloader, mut lines } = whole;
    scanner.start();
    let line = lines.remove(0).local.expect("it is local");
    Rig { scanner, monitor, port, reloader, line, clock, code, contents, c8: bit("C8") }
}

impl Rig {
    /// With lines that were handed in before the first scan.
    fn with(fake: &Arc<Fake>) -> Rig {
        let mut rig = rig();
        rig.hand_in(fake);
        rig
    }

    fn hand_in(&mut self, fake: &Arc<Fake>) {
        let local: Arc<dyn Local> = Arc::clone(fake) as Arc<dyn Local>;
        assert!(self.line.hand_in(local));
    }

    fn scans(&mut self, count: u64) {
        for _ in 0..count {
            assert!(self.scanner.step());
            self.monitor.turn(self.clock.now_ns());
        }
    }

    /// Goes on with the same program, whose Y0, Y1 and Y2 do this outside RUN.
    fn reload(&mut self, safe: [Safe; 3]) {
        self.contents.generation += 1;
        self.contents.safe[..3].copy_from_slice(&safe);
        let (machine, latest) = (Engine::new(self.code.clone()), self.port.latest());
        let package = Package::new(machine, self.contents.clone(), &latest);
        self.reloader.hand_in(package, false).unwrap();
        self.scans(2);
    }

    fn mode(&self) -> Mode {
        self.port.latest().mode
    }

    fn is_ok(&self) -> bool {
        self.port.latest().bit(self.c8)
    }
}

fn fake(x0: i32) -> Arc<Fake> {
    let fake = Arc::new(Fake::default());
    fake.set(x0, 0);
    fake
}

/// What goes out while X0 is ON, and while it is OFF, in RUN.
const ON: [i32; 5] = [1, 0, 1, 1, 1];
const OFF: [i32; 5] = [0, 1, 0, 0, 0];

#[test]
fn inputs_are_of_this_scan_and_outputs_go_out_where_they_changed() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    rig.scans(3);
    assert_eq!(fake.written(), [ON], "in the first scan already, and once");
    fake.set(0, 0);
    rig.scans(1);
    assert_eq!(fake.written(), [OFF], "the same scan reads and writes");
    assert!(rig.is_ok());
}

#[test]
fn a_stop_makes_outputs_safe() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    rig.scans(2);
    fake.set(1, 1);
    fake.written();
    // The scan of the STOP instruction, and the last one.
    rig.scans(3);
    assert!(matches!(rig.mode(), Mode::Stop(_)));
    assert_eq!(fake.written().last().unwrap()[..], [0, 1, 1, 1, 1]);
    rig.scans(5);
    assert_eq!(fake.written(), [[0; 0]; 0], "nothing is written in STOP");
}

#[test]
fn other_safe_values_of_a_reload_in_stop_go_out_at_once() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    rig.scans(2);
    fake.set(1, 1);
    rig.scans(3);
    assert_eq!(fake.written().last().unwrap()[..], [0, 1, 1, 1, 1]);
    rig.reload([Safe::Off, Safe::On, Safe::Hold]);
    assert_eq!(fake.written(), [[0; 0]; 0], "the same ones");
    rig.reload([Safe::On, Safe::Hold, Safe::Hold]);
    assert_eq!(fake.written(), [[1, 1, 1, 1, 1]], "what is held stays as it is");
    rig.reload([Safe::Hold, Safe::Off, Safe::Off]);
    assert_eq!(fake.written(), [[1, 0, 0, 1, 1]]);
    assert_eq!(rig.port.latest().outputs[..3], [1, 0, 0], "and for all others");
}

#[test]
fn a_command_of_an_operator_does_so_too() {
    let fake = fake(0);
    let mut rig = Rig::with(&fake);
    rig.scans(2);
    fake.written();
    let _ = rig.port.command(Command::Stop);
    rig.scans(3);
    assert!(matches!(rig.mode(), Mode::Stop(_)));
    assert_eq!(fake.written().last().unwrap()[..], [0, 1, 0, 1, 0]);
    let _ = rig.port.command(Command::Run);
    rig.scans(3);
    assert_eq!(fake.written().last().unwrap()[..], OFF);
}

#[test]
fn a_scan_that_took_too_long_makes_outputs_safe_and_drives_nothing() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    rig.scans(2);
    fake.written();
    fake.set(0, 0);
    // Reading takes the clock beyond the watchdog.
    let clock = rig.clock.clone();
    let (port, monitor) = (rig.port.clone(), &mut rig.monitor);
    *fake.stuck_read.lock().unwrap() = None;
    thread::scope(|scope| {
        let scanner = &mut rig.scanner;
        let scan = scope.spawn(|| {
            *fake.stuck_read.lock().unwrap() = Some(thread::current().id());
            scanner.step()
        });
        await_stuck(&fake);
        clock.0.fetch_add(300 * MS, Ordering::Relaxed);
        *fake.stuck_read.lock().unwrap() = None;
        assert!(scan.join().unwrap());
    });
    monitor.turn(clock.now_ns());
    assert!(matches!(port.latest().mode, Mode::Fault(FaultReason::ScanTooLong { .. })));
    assert_eq!(fake.written(), [[0, 1, 1, 1, 1]], "what holds is as it was written last");
}

fn await_stuck(fake: &Fake) {
    let deadline = Instant::now() + PATIENCE;
    while !fake.is_stuck.load(Ordering::Acquire) {
        assert!(Instant::now() < deadline, "it is not stuck");
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn where_a_scan_never_ends_the_monitor_makes_outputs_safe() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    rig.scans(2);
    fake.written();
    let (clock, port) = (rig.clock.clone(), rig.port.clone());
    let Rig { scanner, monitor, .. } = &mut rig;
    thread::scope(|scope| {
        let scan = scope.spawn(|| {
            *fake.stuck_read.lock().unwrap() = Some(thread::current().id());
            scanner.step()
        });
        await_stuck(&fake);
        clock.0.fetch_add(300 * MS, Ordering::Relaxed);
        monitor.turn(clock.now_ns());
        assert_eq!(port.latest().mode, Mode::Fault(FaultReason::ScanNeverEnds));
        assert_eq!(fake.written(), [[0, 1, 1, 1, 1]], "while the scan still hangs");
        *fake.stuck_read.lock().unwrap() = None;
        scan.join().unwrap();
    });
    assert!(fake.written().iter().all(|values| values[..4] == [0, 1, 1, 1]));
}

#[test]
fn where_the_output_step_never_ends_the_monitor_sees_it() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    rig.scans(2);
    fake.written();
    fake.set(0, 0);
    let (clock, port) = (rig.clock.clone(), rig.port.clone());
    let Rig { scanner, monitor, .. } = &mut rig;
    thread::scope(|scope| {
        let scan = scope.spawn(|| {
            *fake.stuck_write.lock().unwrap() = Some(thread::current().id());
            scanner.step()
        });
        await_stuck(&fake);
        clock.0.fetch_add(300 * MS, Ordering::Relaxed);
        monitor.turn(clock.now_ns());
        let mode = port.latest().mode;
        let written = fake.written();
        *fake.stuck_write.lock().unwrap() = None;
        scan.join().unwrap();
        assert_eq!(mode, Mode::Fault(FaultReason::ScanNeverEnds));
        assert_eq!(written, [[0, 1, 1, 1, 1]], "while the scan still hangs");
    });
    // What hung came through late, also to what holds: the rest is made safe behind it.
    assert_eq!(fake.written(), [OFF, [0, 1, 0, 1, 0]]);
    assert!(matches!(port.latest().mode, Mode::Fault(_)));
}

#[test]
fn lines_that_fail_are_let_go_of_and_others_taken() {
    let first = fake(1);
    let mut rig = Rig::with(&first);
    rig.scans(2);
    assert_eq!(rig.line.failure(), None);
    first.errno.store(19, Ordering::Release);
    rig.scans(2);
    assert_eq!(rig.line.failure(), Some(LocalFailure::System(19)));
    assert!(!rig.is_ok());
    assert_eq!(Arc::strong_count(&first), 1, "nobody has it: it is closed");
    // In RUN, outputs that are as they were are written to what is new.
    let second = fake(1);
    rig.hand_in(&second);
    rig.scans(3);
    assert_eq!((rig.line.failure(), second.written()), (None, vec![ON.to_vec()]));
    assert!(rig.is_ok());
}

#[test]
fn a_write_that_fails_lets_go_too() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    rig.scans(2);
    fake.set(0, 0);
    let errno = Arc::clone(&fake);
    // Reading goes well, and writing does not: the error comes in between.
    *fake.stuck_write.lock().unwrap() = Some(thread::current().id());
    let helper = thread::spawn(move || {
        await_stuck(&errno);
        errno.errno.store(5, Ordering::Release);
        *errno.stuck_write.lock().unwrap() = None;
    });
    rig.scans(1);
    helper.join().unwrap();
    assert_eq!(rig.line.failure(), Some(LocalFailure::System(5)));
}

#[test]
fn one_late_exchange_is_forgiven_and_several_are_not() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    fake.slow_read.store(BUDGET_NS + MS, Ordering::Release);
    rig.scans(2);
    fake.slow_read.store(0, Ordering::Release);
    rig.scans(1);
    fake.slow_read.store(BUDGET_NS + MS, Ordering::Release);
    rig.scans(2);
    assert_eq!(rig.line.failure(), None);
    rig.scans(1);
    let Some(LocalFailure::Late { took_us }) = rig.line.failure() else { panic!("not let go") };
    assert!(u64::from(took_us) * 1000 > BUDGET_NS && rig.line.exchanged().slowest_ns > BUDGET_NS);
}

#[test]
fn exchanges_are_counted_and_the_last_and_the_slowest_are_told_apart() {
    let fake = fake(0);
    let mut rig = Rig::with(&fake);
    fake.slow_read.store(BUDGET_NS + MS, Ordering::Release);
    rig.scans(1);
    fake.slow_read.store(0, Ordering::Release);
    rig.scans(9);
    let exchanged = rig.line.exchanged();
    // A read with each scan, and the first write: no output changes.
    assert_eq!(exchanged.count, 11);
    assert!(exchanged.slowest_ns > BUDGET_NS && exchanged.last_ns < exchanged.slowest_ns);
}

/// Reads are late in every scan, while every scan writes too, and in time.
#[test]
fn writes_in_time_do_not_excuse_reads_that_are_late() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    fake.slow_read.store(BUDGET_NS + MS, Ordering::Release);
    for scan in 0..3 {
        fake.set(scan % 2, 0);
        rig.scans(1);
    }
    assert!(matches!(rig.line.failure(), Some(LocalFailure::Late { .. })));
}

#[test]
fn lines_that_come_in_stop_are_made_safe() {
    let fake = fake(1);
    let mut rig = rig();
    let _ = rig.port.command(Command::Stop);
    rig.scans(3);
    assert!(matches!(rig.mode(), Mode::Stop(_)));
    rig.hand_in(&fake);
    rig.scans(2);
    assert_eq!(fake.written().first().unwrap()[..4], [0, 1, 0, 1]);
}

/// Opens fakes; fails at first.
struct Shop {
    fake: Arc<Fake>,
    refusals: AtomicI32,
    opened: Mutex<Vec<Vec<i32>>>,
}

impl Opener for Shop {
    fn open(&self, outputs: &[i32]) -> std::io::Result<Arc<dyn Local>> {
        if self.refusals.fetch_sub(1, Ordering::Relaxed) > 0 {
            return Err(std::io::Error::from_raw_os_error(16));
        }
        self.opened.lock().unwrap().push(outputs.to_vec());
        Ok(Arc::clone(&self.fake) as Arc<dyn Local>)
    }
}

#[test]
fn a_keeper_opens_again_with_safe_values_and_ends_with_them() {
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_time().build().expect("a runtime");
    let Rig { mut scanner, mut monitor, port, line, clock, .. } = rig();
    let fake = fake(1);
    let (refusals, opened) = (AtomicI32::new(2), Mutex::default());
    let shop = Arc::new(Shop { fake: Arc::clone(&fake), refusals, opened });
    let health = Health::new("local", "gpio", "a shop".into());
    let mut keeper = Keeper::new(Arc::clone(&shop) as _, line, health.clone(), port.clone());
    keeper.open();
    assert_eq!(
        health.condition().trouble.as_deref(),
        Some("Device or resource busy (os error 16)")
    );
    let mut scan = || {
        assert!(scanner.step());
        monitor.turn(clock.now_ns());
    };
    let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
    runtime.block_on(async {
        let stopped = async {
            let _ = stopped.await;
        };
        let task = tokio::task::spawn(keeper.run(stopped));
        let deadline = Instant::now() + PATIENCE;
        while fake.writes.lock().unwrap().is_empty() {
            assert!(Instant::now() < deadline, "{:?}", health.condition());
            scan();
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        assert_eq!(*shop.opened.lock().unwrap(), [[0, 1, 0, 1, 0]], "before the ladder's values");
        assert_eq!(fake.written(), [ON]);
        fake.errno.store(19, Ordering::Release);
        scan();
        while health.condition().trouble.is_none() {
            assert!(Instant::now() < deadline, "{:?}", health.condition());
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        fake.errno.store(0, Ordering::Release);
        while fake.writes.lock().unwrap().is_empty() {
            assert!(Instant::now() < deadline, "{:?}", health.condition());
            scan();
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        fake.written();
        stop.send(()).unwrap();
        task.await.unwrap();
    });
    assert_eq!(fake.written(), [[0, 1, 1, 1, 1]], "the last words, in RUN still");
}

#[test]
fn a_keeper_opens_a_chip_that_comes_back_within_two_seconds_of_the_end_with_safe_values() {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .start_paused(true)
        .build()
        .expect("a runtime");
    for (refusals, opens) in [(6, 1), (1000, 0)] {
        let Rig { mut scanner, mut monitor, port, line, clock, .. } = rig();
        let (refusals, opened) = (AtomicI32::new(refusals), Mutex::default());
        let shop = Arc::new(Shop { fake: fake(1), refusals, opened });
        let health = Health::new("local", "gpio", "a shop".into());
        let mut keeper = Keeper::new(Arc::clone(&shop) as _, line, health, port.clone());
        keeper.open();
        assert!(scanner.step());
        monitor.turn(clock.now_ns());
        let took = runtime.block_on(async {
            let begun = tokio::time::Instant::now();
            keeper.run(std::future::ready(())).await;
            begun.elapsed()
        });
        assert_eq!(shop.opened.lock().unwrap().len(), opens);
        assert!(took <= Duration::from_secs(2) && (opens == 1) == (took < Duration::from_secs(2)));
    }
}
