//! The scan thread's loop: wait for the grid, scan or tick, measure, publish.
//!
//! It owns the engine. It takes the time from its [`Clock`], the inputs and writes from its side of
//! the exchange, and hands on images, records and statistics. It allocates nothing, takes no lock,
//! writes no log and touches no file: `tests/scan_thread.rs` verifies this.
//!
//! Modes are those of `docs/semantics.md`, section 4. A panic of the engine is a fault, and so is a
//! scan that takes longer than the watchdog allows. That scan is not complete: its image is not
//! published, its writes are refused, and held outputs keep the values of the scan before it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use super::beat::Beat;
use super::command::Forces;
use super::exchange::{FaultReason, Mode, SCAN_WRITES_MAX, StopReason, Tempo, Write};
use super::field::{Field, InputStep};
use super::link::{Facts, ScanSide};
use super::machine::{Machine, ScanStart};
use super::origin::Origin;
use super::pacing::{Clock, Grid};
use super::record::{Journal, OverrunSummary, RecordEvent, Watched, Watches};
use super::statistics::{Books, Meter, Statistics};
use super::swap::Swaps;
use crate::faults::{self, FaultPoint};

/// The longest time until the first report of statistics.
const FIRST_REPORT_NS: u64 = 5_000_000_000;
/// The longest time between two ticks in STOP and FAULT, and between two checks for commands while
/// the thread waits for a distant scan.
pub(super) const TICK_NS_MAX: u64 = 100_000_000;
/// The number of ticks for which the thread waits, at its end, for a spare snapshot to show STOP.
const LAST_TICKS_MAX: u32 = 1000;

/// The scanner's settings at the start.
#[derive(Clone, Debug)]
pub struct Pace {
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

/// The scan thread's loop and all that it owns.
pub struct Scanner<M, C> {
    pub(super) machine: M,
    pub(super) clock: C,
    pub(super) side: ScanSide,
    pub(super) journal: Journal,
    pub(super) beat: Arc<Beat>,
    pub(super) pace: Pace,
    pub(super) grid: Grid,
    books: Books,
    pub(super) watches: Watches,
    pub(super) swaps: Swaps<M>,
    pub(super) field: Field,
    overruns: OverrunSummary,
    pub(super) mode: Mode,
    /// The time of the last change of mode.
    since_ns: u64,
    /// A stop was requested: this scan or the next one is the last of its RUN.
    ending: bool,
    pub(super) forces: Forces,
    /// Complete scans.
    pub(super) scans: u64,
    /// The reason for which the engine was requested to stop, if it was.
    pub(super) stopping: Option<StopReason>,
    /// Whether the last changes are still to be published: the scan is not complete, it failed, or
    /// there was no spare snapshot.
    pub(super) unpublished: bool,
    last_ticks: u32,
    next_report_ns: u64,
    ended_ns: u64,
}

/// The parts of a scanner.
pub(super) struct ScannerParts<M, C> {
    pub machine: M,
    pub clock: C,
    pub side: ScanSide,
    pub journal: Journal,
    pub beat: Arc<Beat>,
    pub pace: Pace,
    pub watched: Watched,
    pub swaps: Swaps<M>,
    pub field: Field,
}

impl<M: Machine, C: Clock> Scanner<M, C> {
    pub(super) fn new(parts: ScannerParts<M, C>) -> Scanner<M, C> {
        let ScannerParts { machine, clock, side, journal, beat, pace, watched, swaps, field } =
            parts;
        let now_ns = clock.now_ns();
        Scanner {
            watches: Watches::new(&watched, machine.image().1, now_ns),
            grid: Grid::new(now_ns, pace.tempo.period_ns),
            books: Books::new(now_ns),
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
        self.grid = Grid::new(now_ns, self.pace.tempo.period_ns);
        self.books.restart(now_ns);
        let first_ns = self.pace.statistics_every_ns.unwrap_or(0).min(FIRST_REPORT_NS);
        self.next_report_ns = now_ns + first_ns;
        self.side.set_running(true);
        self.enter(Mode::Run, now_ns);
    }

    /// Waits for the next grid point and does its work; false once the thread is to end.
    pub fn step(&mut self) -> bool {
        faults::point(FaultPoint::Thread);
        let deadline_ns = self.grid.deadline_ns();
        let scans = self.mode == Mode::Run;
        if scans {
            self.beat.expect(deadline_ns);
        }
        self.wait_until(deadline_ns);
        let woke_ns = self.clock.now_ns();
        if scans && self.mode == Mode::Run {
            self.scan(woke_ns, woke_ns.saturating_sub(deadline_ns));
        } else {
            self.tick(woke_ns);
        }
        self.give();
        self.machine.settle();
        self.journal.catch_up();
        if !scans && self.mode == Mode::Run {
            // An operator has started RUN: its first scan is due at once.
            return true;
        }
        let end_ns = self.clock.now_ns();
        let skipped = self.grid.advance(end_ns);
        if self.mode == Mode::Run {
            self.account(skipped, woke_ns.saturating_sub(deadline_ns), end_ns);
        }
        !self.is_over()
    }

    /// The statistics since the start of RUN, for observers.
    pub(crate) fn meter(&self) -> Meter {
        self.books.meter()
    }

    /// The report at the end.
    pub(crate) fn report(&self) -> Report {
        let statistics = self.books.whole(self.ended_ns);
        Report { mode: self.mode, scans: self.scans, statistics }
    }

    fn scan(&mut self, woke_ns: u64, lateness_ns: u64) {
        self.beat.begin(woke_ns);
        if !self.beat.arrive() {
            // The monitor has reported the scan as missing, and outputs are safe already.
            let _ = self.beat.end();
            return self.fail(FaultReason::ScanNeverBegins, woke_ns);
        }
        self.ask_for_stop();
        let last = self.guarded(|scanner| scanner.execute(woke_ns));
        let scan_ns = self.clock.now_ns().saturating_sub(woke_ns);
        let in_time = self.beat.end() && scan_ns <= self.pace.tempo.watchdog_ns;
        match last {
            None => self.fail(FaultReason::EnginePanic, woke_ns),
            Some(_) if !in_time => self.fail(too_long(scan_ns), woke_ns),
            Some(last) => {
                self.books.scan(scan_ns, lateness_ns);
                self.ending = last || self.machine.stops();
                if self.complete(woke_ns) && last {
                    self.stop(woke_ns);
                }
            }
        }
    }

    /// Executes an operator's commands, then steps 1 to 7.
    fn execute(&mut self, now_ns: u64) -> bool {
        faults::point(FaultPoint::Scan);
        faults::point(FaultPoint::Stall);
        faults::point(FaultPoint::Hang);
        self.obey(now_ns);
        let (times, local_s) = (self.books.scan_times(), self.clock.local_s());
        self.machine.begin_scan(&ScanStart { number: self.scans + 1, now_ns, times, local_s });
        let Scanner { side, machine, field, .. } = self;
        side.inputs(field.moved()).for_each(|inputs| machine.set_inputs(inputs));
        self.bring_in(now_ns);
        let mut writes_left = SCAN_WRITES_MAX;
        while let Some((ticket, writes)) = self.side.next_batch(writes_left) {
            writes_left -= writes.len();
            self.machine.comes_from(Origin::Batch(ticket));
            for write in writes {
                match *write {
                    Write::Bit(cell, on) => self.machine.write_bit(cell, on),
                    Write::Word(cell, value) => self.machine.write_word(cell, value),
                    Write::Masked { cell, and, or, signed } => {
                        let held = self.machine.image().1[cell.0 as usize];
                        self.machine.write_word(cell, Write::masked(held, (and, or), signed));
                    }
                    Write::Input(x, on) => self.machine.set_input(x, on),
                }
            }
        }
        self.machine.execute()
    }

    /// The rest of the input step: takes the inputs of field devices.
    fn bring_in(&mut self, now_ns: u64) {
        let Scanner { field, machine, journal, scans, .. } = self;
        let step = InputStep { scan: *scans, now_ns };
        field.bring_in(machine, step, |what| journal.tell(*scans, now_ns, what));
    }

    /// Steps 8 and 9; false if local outputs took so long that it is a fault.
    fn complete(&mut self, now_ns: u64) -> bool {
        if let Err(reason) = self.bring_out() {
            self.fail(reason, now_ns);
            return false;
        }
        self.scans += 1;
        // If the monitor closed the entry for batches by mistake, this opens it again.
        self.side.set_running(true);
        self.side.answer(true);
        self.publish(now_ns);
        self.tell_events(now_ns);
        self.beat.pulse();
        true
    }

    /// Writes local outputs; the watchdog covers that time too.
    fn bring_out(&mut self) -> Result<(), FaultReason> {
        if !self.field.has_local() {
            return Ok(());
        }
        let begin_ns = self.clock.now_ns();
        self.beat.begin(begin_ns);
        self.field.bring_out(&self.machine);
        let took_ns = self.clock.now_ns().saturating_sub(begin_ns);
        let in_time = self.beat.end() && took_ns <= self.pace.tempo.watchdog_ns;
        if in_time { Ok(()) } else { Err(too_long(took_ns)) }
    }

    /// After the last scan: the passes, then STOP.
    fn stop(&mut self, now_ns: u64) {
        self.side.set_running(false);
        match self.terminate(now_ns) {
            Err(fault) => self.fail(fault, now_ns),
            Ok(()) => {
                self.field.make_safe(Some(self.machine.image()));
                self.leave_run(now_ns);
                self.enter(Mode::Stop(self.stopping.unwrap_or(StopReason::Instruction)), now_ns);
                self.unpublished = true;
                self.publish_stop(now_ns);
            }
        }
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

    /// A tick in STOP and FAULT: no scan, but a sign of life.
    fn tick(&mut self, now_ns: u64) {
        self.side.refuse_waiting();
        self.field.tick((!matches!(self.mode, Mode::Fault(_))).then(|| self.machine.image()));
        if self.guarded(|scanner| scanner.obey(now_ns)).is_none() {
            self.fail(FaultReason::EnginePanic, now_ns);
        }
        if self.mode != Mode::Run {
            self.publish_stop(now_ns);
        }
        self.beat.pulse();
    }

    fn publish_stop(&mut self, now_ns: u64) {
        if self.unpublished {
            self.publish(now_ns);
        }
    }

    pub(super) fn publish(&mut self, now_ns: u64) {
        let (side, facts, image) = self.shown(now_ns);
        self.unpublished = !side.publish(facts, image);
    }

    /// What is published: the facts and the image, beside the end that publishes them.
    pub(super) fn shown(&mut self, now_ns: u64) -> (&mut ScanSide, Facts<'_>, (&[u8], &[i32])) {
        let Scanner { scans, mode, since_ns, ending, .. } = *self;
        let Scanner { side, forces, machine, .. } = self;
        let facts = Facts { scans, now_ns, mode, since_ns, ending, forces };
        (side, facts, machine.image())
    }

    fn ask_for_stop(&mut self) {
        if self.stopping.is_some() {
            return;
        }
        if self.beat.stop_requested() {
            self.stopping = Some(StopReason::Signal);
        } else if self.pace.scans.is_some_and(|limit| self.scans + 1 >= limit) {
            self.stopping = Some(StopReason::ScanLimit);
        }
        if self.stopping.is_some() {
            self.machine.request_stop();
        }
    }

    fn enter(&mut self, mode: Mode, now_ns: u64) {
        (self.mode, self.since_ns, self.ending) = (mode, now_ns, false);
        if mode != Mode::Run {
            // An operator must not wait for a long period.
            self.grid = Grid::new(now_ns, self.pace.tempo.period_ns.min(TICK_NS_MAX));
        }
        self.machine.enters(mode);
        self.journal.tell(self.scans, now_ns, RecordEvent::Mode(mode));
    }

    fn leave_run(&mut self, now_ns: u64) {
        self.ended_ns = now_ns;
        self.books.end(now_ns);
        if let Some(what) = self.overruns.take(now_ns) {
            self.journal.tell(self.scans, now_ns, what);
        }
    }

    pub(super) fn tell_events(&mut self, now_ns: u64) {
        let Scanner { machine, journal, watches, scans, .. } = self;
        let (events, lost) = machine.events();
        for event in events {
            journal.tell(*scans, now_ns, RecordEvent::Block(*event));
        }
        for event in machine.maths() {
            journal.tell(*scans, now_ns, RecordEvent::Math(*event));
        }
        if lost > 0 {
            journal.tell(*scans, now_ns, RecordEvent::EventsLost(lost));
        }
        watches.compare(machine.image(), |what| journal.tell(*scans, now_ns, what), now_ns);
    }

    /// Reports the changes of memory outside RUN.
    pub(super) fn tell_changes(&mut self, now_ns: u64) {
        let Scanner { machine, journal, watches, scans, .. } = self;
        watches.compare(machine.image(), |what| journal.tell(*scans, now_ns, what), now_ns);
    }

    /// Counts overruns, and sends the reports that are due.
    fn account(&mut self, skipped: u64, late_ns: u64, now_ns: u64) {
        if skipped > 0 {
            self.books.overrun(skipped);
            self.overruns.add(skipped, self.books.last_scan_ns(), late_ns);
        }
        if let Some(what) = self.overruns.due(now_ns) {
            self.journal.tell(self.scans, now_ns, what);
        }
        let Some(every_ns) = self.pace.statistics_every_ns else { return };
        if now_ns >= self.next_report_ns {
            self.next_report_ns = now_ns + every_ns;
            self.journal.report(self.books.take_report(now_ns));
        }
    }

    /// Makes a call that may panic; `None` if it did.
    pub(super) fn guarded<T>(&mut self, call: impl FnOnce(&mut Self) -> T) -> Option<T> {
        // After a panic the engine is not called again, so nothing reads its inconsistent memory.
        catch_unwind(AssertUnwindSafe(|| call(self))).ok()
    }

    /// Whether the thread ends. A signal ends it in STOP and FAULT too. With a limited number of
    /// scans, only an intended STOP waits for an operator.
    fn is_over(&mut self) -> bool {
        let asked = match self.mode {
            Mode::Run => false,
            Mode::Stop(StopReason::Signal | StopReason::ScanLimit) => true,
            Mode::Stop(reason) if reason.is_meant() => self.beat.stop_requested(),
            Mode::Stop(_) | Mode::Fault(_) => {
                self.pace.scans.is_some() || self.beat.stop_requested()
            }
        };
        self.last_ticks += u32::from(asked);
        asked && (!self.unpublished || self.last_ticks > LAST_TICKS_MAX)
    }
}

fn too_long(scan_ns: u64) -> FaultReason {
    FaultReason::ScanTooLong { scan_us: u32::try_from(scan_ns / 1000).unwrap_or(u32::MAX) }
}
