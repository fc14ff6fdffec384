//! The loop of the scan thread: wait for the grid, scan or tick, measure, publish.
//!
//! Called by the scan thread, once for each scan or tick. `scanner` has the thread's state and the
//! steps that are shared with `obey`, which executes commands. Behaviour: `docs/semantics.md`,
//! section 4.

use super::exchange::{FaultReason, Mode, SCAN_WRITES_MAX, StopReason};
use super::field::InputStep;
use super::machine::{ScanStart, ScannedMachine};
use super::origin::Origin;
use super::pacing::Clock;
use super::scanner::{Scanner, TICK_NS_MAX, too_long};
use rungd_base::faults::{self, FaultPoint};

/// The number of ticks for which the thread waits, at its end, for a spare snapshot to show STOP.
const LAST_TICKS_MAX: u32 = 1000;

impl<M: ScannedMachine, C: Clock> Scanner<M, C> {
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

    /// Sleeps until the deadline, or until the last scan is requested, which then comes at once.
    /// During a long wait the thread gives a sign of life and executes commands every
    /// [`TICK_NS_MAX`].
    fn wait_until(&mut self, deadline_ns: u64) {
        loop {
            let now_ns = self.clock.now_ns();
            if deadline_ns.saturating_sub(now_ns) <= TICK_NS_MAX {
                return match self.mode {
                    Mode::Run => self.clock.await_scan(deadline_ns),
                    Mode::Stop(_) | Mode::Fault(_) => self.clock.sleep_until(deadline_ns),
                };
            }
            self.clock.sleep_until(now_ns + TICK_NS_MAX);
            if !self.pause() {
                return;
            }
        }
    }

    /// Executes commands during a long wait; false if the thread must not wait for the next scan.
    pub(super) fn pause(&mut self) -> bool {
        self.beat.pulse();
        if self.side.orders.wait() || self.unpublished {
            let now_ns = self.clock.now_ns();
            if self.guarded(|scanner| scanner.obey(now_ns)).is_none() {
                let _ = self.beat.arrive();
                self.fail(FaultReason::EnginePanic, now_ns);
            } else if self.stopping.is_none() {
                self.publish(now_ns);
                self.give();
            }
            // A stop is answered after its last scan, which comes next.
            self.machine.settle();
        }
        self.mode == Mode::Run && self.stopping.is_none() && !self.beat.stop_requested()
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
            Some(last) if !in_time => {
                self.note_last(last);
                self.fail(too_long(scan_ns), woke_ns);
            }
            Some(last) => {
                self.books.scan(scan_ns, lateness_ns);
                self.ending = last || self.machine.stops();
                self.note_last(last);
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
        // Not the beginning of the scan: the process may have stood still since then.
        self.side.now_ns = self.clock.boottime_ns();
        let mut writes_left = SCAN_WRITES_MAX;
        while let Some((ticket, writes)) = self.side.next_batch(writes_left) {
            writes_left -= writes.len();
            self.machine.comes_from(Origin::Batch(ticket));
            writes.iter().for_each(|write| self.machine.write_operand(write));
        }
        while let Some(ended) = self.side.ended_hold() {
            self.machine.comes_from(Origin::Batch(ended.hold));
            self.machine.write_operand(&ended.off);
        }
        self.machine.execute()
    }

    /// The rest of the input step: takes the inputs of field devices.
    fn bring_in(&mut self, now_ns: u64) {
        let Scanner { field, machine, journal, scans, .. } = self;
        let step = InputStep { scan: *scans, now_ns };
        field.bring_in(machine, step, |what| journal.push(*scans, now_ns, what));
    }

    /// Steps 8 and 9; false if local outputs took so long that it is a fault.
    fn complete(&mut self, now_ns: u64) -> bool {
        if let Err(reason) = self.bring_out() {
            self.fail(reason, now_ns);
            return false;
        }
        self.scans += 1;
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

    /// Notes that the ladder's STOP ended RUN in this scan.
    fn note_last(&mut self, last: bool) {
        if last {
            self.stopping.get_or_insert(StopReason::Instruction);
        }
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

    /// Counts overruns, and sends the reports that are due.
    fn account(&mut self, skipped: u64, late_ns: u64, now_ns: u64) {
        if skipped > 0 {
            self.books.overrun(skipped);
            self.overruns.add(skipped, self.books.last_scan_ns(), late_ns);
        }
        if let Some(what) = self.overruns.due(now_ns) {
            self.journal.push(self.scans, now_ns, what);
        }
        let Some(every_ns) = self.pace.statistics_every_ns else { return };
        if now_ns >= self.next_report_ns {
            self.next_report_ns = now_ns + every_ns;
            self.journal.report(self.books.take_report(now_ns));
        }
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
