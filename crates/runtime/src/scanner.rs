//! The state of the scan thread, and the steps that `scan_loop` and `obey` share: a change of mode,
//! the passes, publishing, records of events.
//!
//! The scanner owns the engine. It takes the time from its [`Clock`], the inputs and writes from
//! its side of the exchange, and hands on images, records and statistics. It allocates nothing,
//! takes no lock, writes no log and touches no file: `tests/scan_thread.rs` verifies this.
//!
//! Modes are those of `docs/semantics.md`, section 4. A panic of the engine is a fault, and so is a
//! scan that takes longer than the watchdog allows. That scan is not complete: its image is not
//! published, its writes are refused, and held outputs keep the values of the scan before it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use super::beat::Beat;
use super::command::Forces;
use super::exchange::{FaultReason, Mode, StopReason, Tempo};
use super::field::FieldDevices;
use super::link::{ScanFacts, ScanSide};
use super::machine::{ImageCells, ScannedMachine};
use super::pacing::{Clock, ScanGrid};
use super::record::{Journal, OverrunSummary, RecordEvent, WatchedCells, Watches};
use super::statistics::{RunMeter, ScanMeasurements, Statistics};
use super::swap::Swaps;

/// The longest time until the first report of statistics.
const FIRST_REPORT_NS: u64 = 5_000_000_000;
/// The longest time between two ticks in STOP and FAULT, and between two checks for commands while
/// the thread waits for a distant scan.
pub(super) const TICK_NS_MAX: u64 = 100_000_000;

/// The scanner's settings at the start.
#[derive(Clone, Debug)]
pub struct ScannerSettings {
    /// The period and the watchdog.
    pub tempo: Tempo,
    /// The number of the scan after which the controller stops in order.
    pub scans: Option<u64>,
    /// The time between two reports of statistics; `None`: there are none.
    pub statistics_every_ns: Option<u64>,
    /// Start in STOP for this reason: no scan, and memory as after a cold start, until an operator
    /// runs the controller.
    pub start_in_stop: Option<StopReason>,
}

/// The data that a scan thread leaves when it has ended.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// The mode at the end.
    pub mode: Mode,
    /// Complete scans.
    pub scans: u64,
    /// The statistics of the whole time in RUN.
    pub statistics: Statistics,
}

/// The scan thread's state: all that it owns.
pub struct Scanner<M, C> {
    pub(super) machine: M,
    pub(super) clock: C,
    pub(super) side: ScanSide,
    pub(super) journal: Journal,
    pub(super) beat: Arc<Beat>,
    pub(super) pace: ScannerSettings,
    pub(super) grid: ScanGrid,
    pub(super) books: ScanMeasurements,
    pub(super) watches: Watches,
    pub(super) swaps: Swaps<M>,
    pub(super) field: FieldDevices,
    pub(super) overruns: OverrunSummary,
    pub(super) mode: Mode,
    /// The time of the last change of mode.
    since_ns: u64,
    /// A stop was requested: this scan or the next one is the last of its RUN.
    pub(super) ending: bool,
    pub(super) forces: Forces,
    /// Complete scans.
    pub(super) scans: u64,
    /// The reason for which the engine was requested to stop, if it was.
    pub(super) stopping: Option<StopReason>,
    /// Whether the last changes are still to be published: the scan is not complete, it failed, or
    /// there was no spare snapshot.
    pub(super) unpublished: bool,
    pub(super) last_ticks: u32,
    pub(super) next_report_ns: u64,
    ended_ns: u64,
}

/// The parts of a scanner.
pub(super) struct ScannerParts<M, C> {
    pub machine: M,
    pub clock: C,
    pub side: ScanSide,
    pub journal: Journal,
    pub beat: Arc<Beat>,
    pub pace: ScannerSettings,
    pub watched: WatchedCells,
    pub swaps: Swaps<M>,
    pub field: FieldDevices,
}

impl<M: ScannedMachine, C: Clock> Scanner<M, C> {
    pub(super) fn new(parts: ScannerParts<M, C>) -> Scanner<M, C> {
        let ScannerParts { machine, clock, side, journal, beat, pace, watched, swaps, field } =
            parts;
        let now_ns = clock.now_ns();
        Scanner {
            watches: Watches::new(&watched, machine.image().words, now_ns),
            grid: ScanGrid::new(now_ns, pace.tempo.period_ns),
            books: ScanMeasurements::new(now_ns),
            overruns: OverrunSummary::default(),
            mode: Mode::Stop(StopReason::NotStarted),
            since_ns: now_ns,
            ending: false,
            forces: Forces::default(),
            scans: 0,
            stopping: None,
            unpublished: false,
            last_ticks: 0,
            next_report_ns: 0,
            ended_ns: now_ns,
            swaps,
            field,
            machine,
            clock,
            side,
            journal,
            beat,
            pace,
        }
    }

    /// Begins: in RUN, or in STOP if `start_in_stop` is set.
    pub fn start(&mut self) {
        match self.pace.start_in_stop {
            None => self.run(),
            Some(reason) => {
                let now_ns = self.clock.now_ns();
                self.enter(Mode::Stop(reason), now_ns);
                self.field.make_safe(Some(self.machine.image()));
                self.unpublished = true;
                self.publish_stop(now_ns);
            }
        }
    }

    /// Begins RUN, with memory as it is: the grid, the statistics and the engine's time start now.
    pub(super) fn run(&mut self) {
        let now_ns = self.clock.now_ns();
        self.machine.start(now_ns);
        self.enter_run(now_ns);
    }

    pub(super) fn enter_run(&mut self, now_ns: u64) {
        (self.stopping, self.last_ticks) = (None, 0);
        self.overruns = OverrunSummary::default();
        self.grid = ScanGrid::new(now_ns, self.pace.tempo.period_ns);
        self.books.restart(now_ns);
        let first_ns = self.pace.statistics_every_ns.unwrap_or(0).min(FIRST_REPORT_NS);
        self.next_report_ns = now_ns + first_ns;
        self.side.set_running(true);
        self.enter(Mode::Run, now_ns);
    }

    /// The statistics since the start of RUN, for observers.
    pub(crate) fn meter(&self) -> RunMeter {
        self.books.meter()
    }

    /// The report at the end.
    pub(crate) fn report(&self) -> Report {
        let statistics = self.books.whole(self.ended_ns);
        Report { mode: self.mode, scans: self.scans, statistics }
    }

    /// Runs the passes of all that executed.
    pub(super) fn terminate(&mut self, now_ns: u64) -> Result<(), FaultReason> {
        let begin_ns = self.clock.now_ns();
        self.beat.begin(begin_ns);
        let done = self.guarded(|scanner| scanner.machine.terminate());
        let pass_ns = self.clock.now_ns().saturating_sub(begin_ns);
        let in_time = self.beat.end() && pass_ns <= self.pace.tempo.watchdog_ns;
        match done {
            None => Err(FaultReason::EnginePanic),
            Some(()) if !in_time => Err(too_long(pass_ns)),
            Some(()) => {
                self.tell_events(now_ns);
                Ok(())
            }
        }
    }

    pub(super) fn fail(&mut self, reason: FaultReason, now_ns: u64) {
        self.field.make_safe(None);
        self.side.set_running(false);
        self.side.answer(false);
        self.side.publish_fault(reason, now_ns);
        if self.mode == Mode::Run {
            self.leave_run(now_ns);
        }
        self.enter(Mode::Fault(reason), now_ns);
    }

    pub(super) fn publish_stop(&mut self, now_ns: u64) {
        if self.unpublished {
            self.publish(now_ns);
        }
    }

    pub(super) fn publish(&mut self, now_ns: u64) {
        let (side, facts, image) = self.shown(now_ns);
        self.unpublished = !side.publish(facts, image);
    }

    /// What is published: the facts and the image, beside the end that publishes them.
    pub(super) fn shown(&mut self, now_ns: u64) -> (&mut ScanSide, ScanFacts<'_>, ImageCells<'_>) {
        let Scanner { scans, mode, since_ns, ending, .. } = *self;
        let Scanner { side, forces, machine, .. } = self;
        let facts = ScanFacts { scans, now_ns, mode, since_ns, ending, forces };
        (side, facts, machine.image())
    }

    pub(super) fn enter(&mut self, mode: Mode, now_ns: u64) {
        (self.mode, self.since_ns, self.ending) = (mode, now_ns, false);
        if mode != Mode::Run {
            // An operator must not wait for a long period.
            self.grid = ScanGrid::new(now_ns, self.pace.tempo.period_ns.min(TICK_NS_MAX));
        }
        self.machine.enters(mode);
        self.journal.push(self.scans, now_ns, RecordEvent::Mode(mode));
    }

    pub(super) fn leave_run(&mut self, now_ns: u64) {
        self.ended_ns = now_ns;
        self.books.end(now_ns);
        if let Some(what) = self.overruns.take(now_ns) {
            self.journal.push(self.scans, now_ns, what);
        }
    }

    pub(super) fn tell_events(&mut self, now_ns: u64) {
        let Scanner { machine, journal, watches, scans, .. } = self;
        let (events, lost) = machine.events();
        for event in events {
            journal.push(*scans, now_ns, RecordEvent::Block(*event));
        }
        for event in machine.maths() {
            journal.push(*scans, now_ns, RecordEvent::Math(*event));
        }
        if lost > 0 {
            journal.push(*scans, now_ns, RecordEvent::EventsLost(lost));
        }
        watches.compare(machine.image(), |what| journal.push(*scans, now_ns, what), now_ns);
    }

    /// Reports the changes of memory outside RUN.
    pub(super) fn tell_changes(&mut self, now_ns: u64) {
        let Scanner { machine, journal, watches, scans, .. } = self;
        watches.compare(machine.image(), |what| journal.push(*scans, now_ns, what), now_ns);
    }

    /// Makes a call that may panic; `None` if it did.
    pub(super) fn guarded<T>(&mut self, call: impl FnOnce(&mut Self) -> T) -> Option<T> {
        // After a panic the engine is not called again, so nothing reads its inconsistent memory.
        catch_unwind(AssertUnwindSafe(|| call(self))).ok()
    }
}

/// The fault of a scan that took this time.
pub(super) fn too_long(scan_ns: u64) -> FaultReason {
    FaultReason::ScanTooLong { scan_us: u32::try_from(scan_ns / 1000).unwrap_or(u32::MAX) }
}
