//! Tests of the scanner on a simulated clock, with a machine whose scans take a given time.

mod clock;
mod commands;
mod holds;
mod swaps;

use std::cell::Cell;
use std::rc::Rc;
use std::sync::{Arc, Mutex};

use super::exchange::{
    BatchOutcome, BatchRefusal, FaultReason, Mode, OperandWrite, Port, Snapshot, StopReason, Tempo,
};
use super::pacing::Clock;
use super::*;
use rungd_base::calendar::LocalTime;
use rungd_engine::{self as engine, BitCell, BlockEvent, ScanTimes, WordCell};

const MS: u64 = 1_000_000;

/// A clock that moves only when a thread sleeps or works; the local time; and the time for which
/// the machine was suspended.
#[derive(Clone, Default)]
struct SimulatedClock(Rc<Cell<u64>>, Rc<Cell<i64>>, Rc<Cell<u64>>);

impl SimulatedClock {
    fn pass(&self, ns: u64) {
        self.0.set(self.0.get() + ns);
    }
}

impl Clock for SimulatedClock {
    fn now_ns(&self) -> u64 {
        self.0.get()
    }

    fn boottime_ns(&self) -> u64 {
        self.now_ns() + self.2.get()
    }

    fn sleep_until(&mut self, deadline_ns: u64) {
        self.0.set(self.0.get().max(deadline_ns));
    }

    fn local_s(&self) -> i64 {
        self.1.get()
    }
}

/// Bit 0 toggles every scan, bit 1 is Y0 and is ON during scans, bit 2 is X0; word 0 counts. A
/// termination pass turns bit 1 OFF and bit 0 ON.
struct Fake {
    clock: SimulatedClock,
    bits: [u8; 3],
    words: [i32; 1],
    /// The durations of the scans; the last one holds for all further scans.
    takes_ns: Vec<u64>,
    panics_in: Option<usize>,
    stops_in: Option<usize>,
    scans: usize,
    stop: bool,
    /// The time of the last force.
    forced_ns: u64,
    times: Rc<Cell<ScanTimes>>,
    local: Rc<Cell<LocalTime>>,
}

impl ScannedMachine for Fake {
    fn start(&mut self, _now_ns: u64) {
        self.stop = false;
    }

    fn begin_scan(&mut self, start: &ScanStart) {
        let now_ns = self.clock.now_ns();
        assert_eq!(start.now_ns, now_ns, "the timestamp is taken at the scan's start");
        self.times.set(start.times);
        self.local.set(LocalTime::of(start.local_s));
    }

    fn set_input(&mut self, x: u32, on: bool) {
        self.bits[2 + x as usize] = u8::from(on);
    }

    fn write_bit(&mut self, cell: BitCell, on: bool) {
        self.bits[cell.0 as usize] = u8::from(on);
    }

    fn write_word(&mut self, cell: WordCell, value: i32) {
        self.words[cell.0 as usize] = value;
    }

    fn execute(&mut self) -> bool {
        let last = self.stop;
        self.bits[0] ^= 1;
        self.bits[1] = 1;
        self.words[0] += 1;
        let takes = self.takes_ns.get(self.scans).or(self.takes_ns.last()).copied().unwrap_or(0);
        self.clock.pass(takes);
        assert_ne!(self.panics_in, Some(self.scans), "this is a test");
        self.stop |= self.stops_in == Some(self.scans);
        self.scans += 1;
        last
    }

    fn request_stop(&mut self) {
        self.stop = true;
    }

    fn stops(&self) -> bool {
        self.stop
    }

    fn terminate(&mut self) {
        self.bits[0] = 1;
        self.bits[1] = 0;
    }

    fn force(&mut self, cell: engine::Cell, value: i32) {
        self.forced_ns = self.clock.now_ns();
        match cell {
            engine::Cell::Bit(bit) => self.bits[bit.0 as usize] = value as u8,
            engine::Cell::Word(word) => self.words[word.0 as usize] = value,
            engine::Cell::WordBit(_) => panic!("a bit of a word is never forced"),
        }
    }

    fn release(&mut self, _cell: engine::Cell) {}

    fn adopt(&mut self, old: &mut Self, _: &engine::Transfer, _: bool, _: &[engine::Cell]) {
        (self.bits, self.words) = (old.bits, old.words);
    }

    fn image(&self) -> ImageCells<'_> {
        ImageCells { bits: &self.bits, words: &self.words }
    }

    fn events(&self) -> (&[BlockEvent], u32) {
        (&[], 0)
    }

    fn maths(&self) -> &[engine::MathEvent] {
        &[]
    }
}

/// The calls that an observer received.
#[derive(Clone, Default)]
struct Heard(Arc<Mutex<Vec<String>>>);

impl Heard {
    fn put(&self, line: String) {
        self.0.lock().unwrap().push(line);
    }

    fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.0.lock().unwrap())
    }
}

impl Observer for Heard {
    fn record(&mut self, record: &ScanRecord) {
        self.put(format!("{}: {:?}", record.scan, record.what));
    }

    fn statistics(&mut self, statistics: &Statistics) {
        self.put(format!("statistics of {} scans", statistics.scans));
    }

    fn dropped(&mut self, records: u64) {
        self.put(format!("dropped {records}"));
    }

    fn tripped(&mut self, reason: FaultReason, _now_ns: u64) {
        self.put(format!("tripped {reason:?}"));
    }

    fn turn(&mut self, _latest: &Snapshot, _now_ns: u64) {}

    fn ended(&mut self, _: u64) {}
}

struct Rig {
    scanner: Scanner<Fake, SimulatedClock>,
    monitor: Monitor<Heard>,
    port: Port,
    heard: Heard,
    clock: SimulatedClock,
    times: Rc<Cell<ScanTimes>>,
    local: Rc<Cell<LocalTime>>,
    reloader: Reloader<Fake>,
}

/// Period 10 ms, watchdog 35 ms; Y0 held.
fn rig(change: impl FnOnce(&mut Fake, &mut ThreadSettings)) -> Rig {
    let clock = SimulatedClock::default();
    clock.pass(1000 * MS);
    let times = Rc::new(Cell::new(ScanTimes::default()));
    let local = Rc::new(Cell::new(LocalTime::default()));
    let mut fake = Fake {
        clock: clock.clone(),
        bits: [0; 3],
        words: [0],
        takes_ns: vec![MS],
        panics_in: None,
        stops_in: None,
        scans: 0,
        stop: false,
        forced_ns: 0,
        times: Rc::clone(&times),
        local: Rc::clone(&local),
    };
    let mut settings = ThreadSettings {
        pace: ScannerSettings {
            tempo: Tempo { period_ns: 10 * MS, watchdog_ns: 35 * MS },
            scans: None,
            statistics_every_ns: Some(60_000 * MS),
            start_in_stop: None,
        },
        memory: PublicMemory {
            inputs: 1,
            bits: 3,
            words: 1,
            first_output: 1,
            forces_active: 0,
            safe: vec![SafeState::Hold],
        },
        watched: WatchedCells::default(),
        posture: Posture::default(),
        field: Vec::new(),
    };
    change(&mut fake, &mut settings);
    let heard = Heard::default();
    let (mut scanner, monitor, port, reloader) =
        assemble_reloadable(fake, clock.clone(), &settings, heard.clone());
    scanner.start();
    Rig { scanner, monitor, port, heard, clock, times, local, reloader }
}

impl Rig {
    /// A step of the scanner, then a turn of the monitor. Returns the result of [`Scanner::step`].
    fn step(&mut self) -> bool {
        let continues = self.scanner.step();
        self.monitor.turn(self.clock.now_ns());
        continues
    }

    fn steps(&mut self, count: usize) {
        for _ in 0..count {
            self.step();
        }
    }

    /// Milliseconds since the start at which the next scans begin.
    fn scans_at_ms(&mut self, count: usize) -> Vec<u64> {
        let mut found = Vec::new();
        for _ in 0..count {
            self.step();
            found.push((self.port.latest().now_ns - 1000 * MS) / MS);
        }
        found
    }
}

#[test]
fn scans_of_any_length_within_the_period_keep_the_grid() {
    let mut rig = rig(|fake, _| fake.takes_ns = vec![MS, 9 * MS, 10 * MS, 0, 3 * MS]);
    assert_eq!(rig.scans_at_ms(6), [0, 10, 20, 30, 40, 50]);
    assert_eq!(rig.scanner.report().statistics.overruns, 0);
}

#[test]
fn an_overrun_skips_to_the_grid_and_is_counted_and_reported_once() {
    let mut rig = rig(|fake, _| fake.takes_ns = vec![MS, 25 * MS, MS, 11 * MS, MS]);
    assert_eq!(rig.scans_at_ms(5), [0, 10, 40, 50, 70]);
    let statistics = rig.scanner.report().statistics;
    assert_eq!((statistics.overruns, statistics.skipped), (2, 3));
    let told = rig.heard.take();
    let first = "2: Overruns { count: 1, skipped: 2, scan_ns_max: 25000000, late_ns_max: 0 }";
    assert_eq!(told, ["0: Mode(Run)", first]);
}

#[test]
fn a_late_wake_up_counts_as_lateness_and_not_as_an_overrun() {
    let mut rig = rig(|_, _| {});
    rig.step();
    rig.clock.pass(12 * MS);
    rig.step();
    let statistics = rig.scanner.report().statistics;
    assert_eq!((statistics.lateness.max_ns, statistics.overruns), (3 * MS, 0));
}

#[test]
fn the_controller_terminates_its_blocks_after_the_configured_number_of_scans() {
    let mut rig = rig(|_, settings| settings.pace.scans = Some(3));
    assert!(rig.step() && rig.step());
    assert_eq!(rig.port.latest().mode, Mode::Run);
    assert!(!rig.step());
    let latest = rig.port.latest();
    assert_eq!((latest.scans, latest.mode), (3, Mode::Stop(StopReason::ScanLimit)));
    assert_eq!((&*latest.bits, &*latest.outputs), (&[1, 0, 0][..], &[0][..]), "hold: terminated");
    assert_eq!(rig.scanner.report().scans, 3);
}

#[test]
fn a_run_of_one_scan_ends_after_that_scan() {
    let mut rig = rig(|_, settings| settings.pace.scans = Some(1));
    assert!(!rig.step());
    assert_eq!(rig.port.latest().scans, 1);
}

#[test]
fn a_stop_request_is_followed_by_one_last_scan() {
    let mut rig = rig(|_, _| {});
    rig.step();
    rig.monitor.beat.request_stop();
    assert!(!rig.step());
    let latest = rig.port.latest();
    assert_eq!((latest.scans, latest.mode), (2, Mode::Stop(StopReason::Signal)));
}

#[test]
fn the_scan_thread_keeps_running_after_a_stop_instruction_until_a_signal() {
    let mut rig = rig(|fake, _| fake.stops_in = Some(1));
    assert!(rig.step() && rig.step() && rig.step());
    let before = rig.monitor.beat.pulses();
    assert!(rig.step() && rig.step());
    assert_eq!(rig.port.latest().mode, Mode::Stop(StopReason::Instruction));
    assert_eq!((rig.port.latest().scans, rig.monitor.beat.pulses() - before), (3, 2));
    rig.monitor.beat.request_stop();
    assert!(!rig.step());
}

#[test]
fn the_scan_thread_of_a_start_in_stop_waits_with_initial_memory_until_a_signal() {
    let reason = StopReason::RestartGuard;
    let mut rig = rig(|_, settings| settings.pace.start_in_stop = Some(reason));
    assert!(rig.step() && rig.step());
    let latest = rig.port.latest();
    assert_eq!((latest.scans, latest.mode), (0, Mode::Stop(reason)));
    assert_eq!((&*latest.bits, &*latest.words), (&[0, 0, 0][..], &[0][..]));
    assert_eq!(rig.monitor.beat.pulses(), 2);
    assert!(rig.port.submit(vec![]).is_err());
    assert_eq!(rig.heard.take(), ["0: Mode(Stop(RestartGuard))"]);
    rig.monitor.beat.request_stop();
    assert!(!rig.step());
}

#[test]
fn a_scan_longer_than_the_watchdog_is_a_fault_and_not_a_complete_scan() {
    let mut rig = rig(|fake, _| fake.takes_ns = vec![MS, 35 * MS, 36 * MS]);
    assert!(rig.step() && rig.step());
    let ticket = rig.port.submit(vec![OperandWrite::Word(WordCell(0), 77)]).unwrap();
    assert!(rig.step());
    let latest = rig.port.latest();
    assert_eq!(latest.mode, Mode::Fault(FaultReason::ScanTooLong { scan_us: 36_000 }));
    assert_eq!((latest.scans, &*latest.words, &*latest.outputs), (2, &[2][..], &[1][..]));
    assert_eq!(rig.port.outcome(ticket), BatchOutcome::Refused(BatchRefusal::NotRunning));
    let scans = rig.port.latest().scans;
    assert!(rig.step() && rig.step(), "it ticks");
    assert_eq!(rig.port.latest().scans, scans);
}

#[test]
fn a_panic_in_the_engine_is_a_fault() {
    let mut rig = rig(|fake, _| fake.panics_in = Some(1));
    assert!(rig.step() && rig.step() && rig.step());
    let latest = rig.port.latest();
    assert_eq!((latest.scans, latest.mode), (1, Mode::Fault(FaultReason::EnginePanic)));
    assert_eq!(rig.heard.take(), ["0: Mode(Run)", "1: Mode(Fault(EnginePanic))"]);
}

#[test]
fn a_fault_ends_the_scan_thread_if_the_number_of_scans_is_limited() {
    let mut rig = rig(|fake, settings| {
        settings.pace.scans = Some(9);
        fake.panics_in = Some(0);
    });
    assert!(!rig.step());
}

#[test]
fn the_monitor_detects_a_scan_that_does_not_end() {
    let mut rig = rig(|_, _| {});
    rig.step();
    // The monitor checks while a scan executes.
    let since = rig.clock.now_ns();
    rig.monitor.beat.begin(since);
    rig.monitor.turn(since + 35 * MS);
    assert_eq!(rig.port.latest().mode, Mode::Run);
    rig.monitor.turn(since + 36 * MS);
    rig.monitor.turn(since + 37 * MS);
    assert_eq!(rig.port.latest().mode, Mode::Fault(FaultReason::ScanNeverEnds));
    assert!(rig.port.submit(vec![]).is_err());
    assert_eq!(rig.heard.take(), ["0: Mode(Run)", "tripped ScanNeverEnds"]);
}

#[test]
fn the_monitor_detects_a_scan_that_does_not_start() {
    let mut rig = rig(|_, _| {});
    rig.step();
    let due = rig.clock.now_ns() + 9 * MS;
    // The monitor checks while the scan thread sleeps.
    rig.monitor.beat.expect(due);
    for ms in 0..=35 {
        rig.monitor.turn(due + ms * MS);
        assert_eq!(rig.port.latest().mode, Mode::Run, "{ms} ms late");
    }
    rig.monitor.turn(due + 36 * MS);
    rig.monitor.turn(due + 37 * MS);
    let fault = Mode::Fault(FaultReason::ScanNeverBegins);
    assert_eq!(rig.port.latest().mode, fault);
    assert!(rig.port.submit(vec![]).is_err());
    assert_eq!(rig.heard.take(), ["0: Mode(Run)", "tripped ScanNeverBegins"]);
    // The scan thread wakes late, and does not scan.
    rig.step();
    rig.step();
    assert_eq!((rig.port.latest().mode, rig.port.latest().scans), (fault, 1));
}

#[test]
fn a_suspended_process_gets_one_more_watchdog_time() {
    let mut rig = rig(|_, _| {});
    rig.step();
    let due = rig.clock.now_ns() + 9 * MS;
    rig.monitor.beat.expect(due);
    rig.monitor.turn(due);
    let again = due + 60_000 * MS;
    for ms in [0, 10, 20, 35] {
        rig.monitor.turn(again + ms * MS);
        assert_eq!(rig.port.latest().mode, Mode::Run, "{ms} ms after it");
    }
    rig.monitor.turn(again + 36 * MS);
    assert_eq!(rig.port.latest().mode, Mode::Fault(FaultReason::ScanNeverBegins));
}

#[test]
fn inputs_and_writes_reach_the_scan_and_scan_times_reach_the_program() {
    let mut rig = rig(|_, _| {});
    rig.port.set_input(0, true);
    let ticket = rig.port.submit(vec![OperandWrite::Word(WordCell(0), 100)]).unwrap();
    rig.step();
    assert_eq!(rig.port.outcome(ticket), BatchOutcome::Applied);
    let latest = rig.port.latest();
    assert_eq!((&*latest.bits, &*latest.words), (&[1, 1, 1][..], &[101][..]));
    rig.step();
    let times = rig.times.get();
    assert_eq!(
        (times.last_us, times.min_us, times.max_us, times.mean_us),
        (1000, 1000, 1000, 1000)
    );
}

#[test]
fn statistics_are_reported_once_early_and_then_at_their_interval() {
    let mut rig = rig(|_, _| {});
    rig.steps(499);
    assert_eq!(rig.heard.take().len(), 1, "the mode, and no statistics yet");
    rig.steps(3);
    assert_eq!(rig.heard.take(), ["statistics of 501 scans"]);
    rig.steps(6000);
    assert_eq!(rig.heard.take(), ["statistics of 6000 scans"]);
}

#[test]
fn a_stalled_reader_delays_publications_but_not_scans() {
    let mut rig = rig(|_, _| {});
    for _ in 0..100 {
        rig.scanner.step();
    }
    rig.monitor.turn(rig.clock.now_ns());
    assert!(rig.port.latest().scans < 100);
    rig.step();
    assert_eq!(rig.port.latest().scans, 101);
}

#[test]
fn one_scan_applies_the_inputs_and_the_writes_of_a_batch() {
    let mut rig = rig(|_, _| {});
    let ticket =
        rig.port.submit(vec![OperandWrite::Word(WordCell(0), 5), OperandWrite::Input(0, true)]);
    rig.step();
    assert_eq!(rig.port.outcome(ticket.unwrap()), BatchOutcome::Applied);
    assert_eq!((rig.port.latest().bits[2], rig.port.latest().words[0]), (1, 6));
    rig.step();
    assert_eq!(rig.port.latest().bits[2], 1, "it stays as it was set");
}
