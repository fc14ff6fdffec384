//! Local devices: lines that the scan itself reads and writes. Their outputs in RUN, at a stop, in
//! a fault and while a scan never ends; and when the scan releases a device.

use crate::io::local_rig::*;
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self};
use std::time::{Duration, Instant};

use rungd_io::device::{DeviceHealth, DeviceKeeper, Opener};
use rungd_runtime::SafeState;
use rungd_runtime::command::ScanCommand;
use rungd_runtime::exchange::{FaultReason, Mode};
use rungd_runtime::local::{Local, LocalFailure};
use rungd_runtime::pacing::Clock;

/// The outputs in RUN while X0 is ON; `OFF` has those while X0 is OFF.
const ON: [i32; 5] = [1, 0, 1, 1, 1];
const OFF: [i32; 5] = [0, 1, 0, 0, 0];

#[test]
fn a_local_device_reads_inputs_and_writes_changed_outputs_in_the_same_scan() {
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
    // These include the scan of the STOP instruction and the last scan.
    rig.scans(3);
    assert!(matches!(rig.mode(), Mode::Stop(_)));
    assert_eq!(fake.written().last().unwrap()[..], [0, 1, 1, 1, 1]);
    rig.scans(5);
    assert_eq!(fake.written(), [[0; 0]; 0], "nothing is written in STOP");
}

#[test]
fn safe_values_changed_by_a_reload_in_stop_are_written_at_once() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    rig.scans(2);
    fake.set(1, 1);
    rig.scans(3);
    assert_eq!(fake.written().last().unwrap()[..], [0, 1, 1, 1, 1]);
    rig.reload([SafeState::Off, SafeState::On, SafeState::Hold]);
    assert_eq!(fake.written(), [[0; 0]; 0], "the same ones");
    rig.reload([SafeState::On, SafeState::Hold, SafeState::Hold]);
    assert_eq!(fake.written(), [[1, 1, 1, 1, 1]], "what is held stays as it is");
    rig.reload([SafeState::Hold, SafeState::Off, SafeState::Off]);
    assert_eq!(fake.written(), [[1, 0, 0, 1, 1]]);
    assert_eq!(rig.port.latest().outputs[..3], [1, 0, 0], "and for all others");
}

#[test]
fn a_stop_by_an_operator_makes_outputs_safe_and_a_run_drives_them_again() {
    let fake = fake(0);
    let mut rig = Rig::with(&fake);
    rig.scans(2);
    fake.written();
    let _ = rig.port.command(ScanCommand::Stop);
    rig.scans(3);
    assert!(matches!(rig.mode(), Mode::Stop(_)));
    assert_eq!(fake.written().last().unwrap()[..], [0, 1, 0, 1, 0]);
    let _ = rig.port.command(ScanCommand::Run);
    rig.scans(3);
    assert_eq!(fake.written().last().unwrap()[..], OFF);
}

#[test]
fn a_scan_longer_than_the_watchdog_only_writes_safe_outputs() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    rig.scans(2);
    fake.written();
    fake.set(0, 0);
    // Reading takes longer than the watchdog allows.
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
fn the_monitor_makes_outputs_safe_if_a_scan_never_ends() {
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
fn the_monitor_detects_an_output_step_that_never_ends() {
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
    // The write that hung arrives late, also at outputs that hold their value. The other outputs
    // are made safe after it.
    assert_eq!(fake.written(), [OFF, [0, 1, 0, 1, 0]]);
    assert!(matches!(port.latest().mode, Mode::Fault(_)));
}

#[test]
fn failed_lines_are_released_and_requested_again() {
    let first = fake(1);
    let mut rig = Rig::with(&first);
    rig.scans(2);
    assert_eq!(rig.line.failure(), None);
    first.errno.store(19, Ordering::Release);
    rig.scans(2);
    assert_eq!(rig.line.failure(), Some(LocalFailure::System(19)));
    assert!(!rig.is_ok());
    assert_eq!(Arc::strong_count(&first), 1, "nobody has it: it is closed");
    // In RUN, new lines receive all outputs, even unchanged ones.
    let second = fake(1);
    rig.hand_in(&second);
    rig.scans(3);
    assert_eq!((rig.line.failure(), second.written()), (None, vec![ON.to_vec()]));
    assert!(rig.is_ok());
}

#[test]
fn a_failed_write_releases_the_lines() {
    let fake = fake(1);
    let mut rig = Rig::with(&fake);
    rig.scans(2);
    fake.set(0, 0);
    let errno = Arc::clone(&fake);
    // Reading succeeds and writing fails: the error begins between the two.
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
fn only_several_late_exchanges_are_a_failure() {
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
fn the_last_and_the_slowest_exchange_are_counted_separately() {
    let fake = fake(0);
    let mut rig = Rig::with(&fake);
    fake.slow_read.store(BUDGET_NS + MS, Ordering::Release);
    rig.scans(1);
    fake.slow_read.store(0, Ordering::Release);
    rig.scans(9);
    let exchanged = rig.line.exchanged();
    // A read in each scan, and one write in the first scan: no output changes later.
    assert_eq!(exchanged.count, 11);
    assert!(exchanged.slowest_ns > BUDGET_NS && exchanged.last_ns < exchanged.slowest_ns);
}

/// In every scan the read is late, and the write is in time.
#[test]
fn timely_writes_do_not_excuse_late_reads() {
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
fn lines_opened_in_stop_get_safe_values() {
    let fake = fake(1);
    let mut rig = rig();
    let _ = rig.port.command(ScanCommand::Stop);
    rig.scans(3);
    assert!(matches!(rig.mode(), Mode::Stop(_)));
    rig.hand_in(&fake);
    rig.scans(2);
    assert_eq!(fake.written().first().unwrap()[..4], [0, 1, 0, 1]);
}

/// Opens fakes; the first attempts fail.
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
fn lines_are_reopened_and_closed_with_safe_values() {
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_time().build().expect("a runtime");
    let Rig { mut scanner, mut monitor, port, line, clock, .. } = rig();
    let fake = fake(1);
    let (refusals, opened) = (AtomicI32::new(2), Mutex::default());
    let shop = Arc::new(Shop { fake: Arc::clone(&fake), refusals, opened });
    let health = DeviceHealth::new("local", "gpio", "a shop".into());
    let mut keeper = DeviceKeeper::new(Arc::clone(&shop) as _, line, health.clone(), port.clone());
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
fn a_shutdown_writes_safe_values_to_a_chip_that_returns_within_two_seconds() {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .start_paused(true)
        .build()
        .expect("a runtime");
    for (refusals, opens) in [(6, 1), (1000, 0)] {
        let Rig { mut scanner, mut monitor, port, line, clock, .. } = rig();
        let (refusals, opened) = (AtomicI32::new(refusals), Mutex::default());
        let shop = Arc::new(Shop { fake: fake(1), refusals, opened });
        let health = DeviceHealth::new("local", "gpio", "a shop".into());
        let mut keeper = DeviceKeeper::new(Arc::clone(&shop) as _, line, health, port.clone());
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
