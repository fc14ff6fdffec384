//! The monitor thread: it publishes images and records, and supervises the scan.
//!
//! Soon after each scan it makes the latest image visible in the port, and hands records to
//! the [`Observer`] (which must not block; the log has a writer thread for that reason). The scan
//! thread wakes nobody, because that is a system call: while it sleeps until a scan, the monitor
//! sleeps until a moment behind the same deadline. So one turn serves a short scan. It also
//! checks whether the current scan takes longer than the watchdog, or a due scan is missing for as
//! long. The scan thread cannot end such a scan; the monitor reports a fault and makes outputs
//! safe. Because there is no further sign of life, systemd's watchdog then ends the process.
//!
//! If the whole process was suspended (SIGSTOP, a paused machine), the monitor was suspended too:
//! then it gives the scan thread one more watchdog time.

use std::ops::RangeInclusive;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use super::beat::{Beat, Life};
use super::exchange::{FaultReason, Port, Snapshot};
use super::link::WorldSide;
use super::local::OutputRescue;
use super::record::{JournalReader, ScanRecord};
use super::statistics::Statistics;
use rungd_base::faults::{self, FaultPoint};

/// The observer: the log writer. Called on the monitor thread; none of its methods may block.
pub trait Observer: Send {
    /// Receives a record.
    fn record(&mut self, record: &ScanRecord);
    /// Receives a report of statistics.
    fn statistics(&mut self, statistics: &Statistics);
    /// Receives the number of further records that were dropped because the ring was full.
    fn dropped(&mut self, records: u64);
    /// The monitor itself has reported a fault.
    fn tripped(&mut self, reason: FaultReason, now_ns: u64);
    /// The end of every turn, after all calls above.
    fn turn(&mut self, latest: &Snapshot, now_ns: u64);
    /// The scan thread has ended; no further call follows.
    fn ended(&mut self, now_ns: u64);
}

/// The monitor thread's state.
pub struct Monitor<O> {
    pub(super) world: WorldSide,
    pub(super) journal: JournalReader,
    pub(super) beat: Arc<Beat>,
    pub(super) port: Port,
    pub(super) observer: O,
    pub(super) dropped: u64,
    pub(super) lost: bool,
    /// The time at which it last checked the scan.
    pub(super) looked_ns: u64,
    pub(super) grace: Grace,
    /// The outputs of local devices.
    pub(super) rescues: Vec<OutputRescue>,
}

/// The extra time for one due scan, because the monitor itself did not run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Grace {
    due_ns: u64,
    until_ns: u64,
}

impl<O: Observer> Monitor<O> {
    /// Executes one turn; false once the scan thread has ended and all its messages are handed on.
    pub fn turn(&mut self, now_ns: u64) -> bool {
        faults::point(FaultPoint::Monitor);
        let life = self.beat.life();
        self.world.pump();
        self.read_journal();
        self.watch(life, now_ns);
        self.observer.turn(&self.port.latest(), now_ns);
        if life == Life::Ended {
            self.observer.ended(now_ns);
        }
        life != Life::Ended
    }

    /// The time from a turn to the next one.
    pub(super) fn rest(&self, now_ns: u64) -> Duration {
        rest(now_ns, self.beat.awaited(), self.port.tempo().period_ns)
    }

    fn read_journal(&mut self) {
        // Only the records that are present now: many new records must not delay the check of the
        // watchdog.
        for _ in 0..self.journal.records.slots() {
            if let Ok(record) = self.journal.records.pop() {
                self.observer.record(&record);
            }
        }
        while let Ok(statistics) = self.journal.reports.pop() {
            self.observer.statistics(&statistics);
        }
        let dropped = self.journal.dropped.load(Ordering::Relaxed);
        if dropped > self.dropped {
            self.observer.dropped(dropped - self.dropped);
            self.dropped = dropped;
        }
    }

    fn watch(&mut self, life: Life, now_ns: u64) {
        let reason = if life == Life::Lost && !self.lost {
            self.lost = true;
            FaultReason::ScanThreadGone
        } else if self.beat.trip(now_ns, self.port.tempo().watchdog_ns) {
            FaultReason::ScanNeverEnds
        } else if life == Life::Alive && self.is_missing(now_ns) {
            FaultReason::ScanNeverBegins
        } else {
            self.looked_ns = now_ns;
            return;
        };
        self.looked_ns = now_ns;
        self.world.trip(reason, now_ns);
        let latest = self.port.latest();
        for rescue in &self.rescues {
            let _ = rescue.make_safe(&latest);
        }
        self.observer.tripped(reason, now_ns);
    }

    /// Whether the due scan is late by more than the watchdog allows.
    fn is_missing(&mut self, now_ns: u64) -> bool {
        let Some(due_ns) = self.beat.awaited() else { return false };
        let watchdog_ns = self.port.tempo().watchdog_ns;
        if now_ns.saturating_sub(due_ns) <= watchdog_ns {
            return false;
        }
        let stood_still = now_ns.saturating_sub(self.looked_ns) > watchdog_ns;
        if stood_still && self.grace.due_ns != due_ns {
            self.grace = Grace { due_ns, until_ns: now_ns + watchdog_ns };
        }
        let excused = self.grace.due_ns == due_ns && now_ns <= self.grace.until_ns;
        !excused && self.beat.miss(due_ns)
    }
}

/// The least and the greatest time between two turns. A scan that hangs is noticed within the
/// greatest one.
const REST_NS: RangeInclusive<u64> = 250_000..=10_000_000;

/// Until an eighth of a period after the deadline of the awaited scan; while a scan executes, or
/// none is awaited, a quarter of a period.
fn rest(now_ns: u64, awaited_ns: Option<u64>, period_ns: u64) -> Duration {
    let (least, most) = (*REST_NS.start(), *REST_NS.end());
    let part = |divisor: u64| (period_ns / divisor).clamp(least, most);
    let ns = match awaited_ns.and_then(|due_ns| due_ns.checked_sub(now_ns)) {
        Some(until_due_ns) => until_due_ns.saturating_add(part(8)).min(most),
        None => part(4),
    };
    Duration::from_nanos(ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn check(awaited_ns: Option<u64>, period_ns: u64, us: u64) {
        assert_eq!(rest(100 * MS, awaited_ns, period_ns), Duration::from_micros(us));
    }

    #[test]
    fn the_monitor_sleeps_until_a_moment_after_the_next_scan_is_due() {
        check(Some(108 * MS), 8 * MS, 9000);
        check(Some(100 * MS + 700_000), MS, 950);
        check(Some(100 * MS), 8 * MS, 1000);
    }

    #[test]
    fn while_a_scan_executes_or_is_late_the_monitor_looks_each_quarter_of_a_period() {
        check(None, 8 * MS, 2000);
        check(None, MS, 250);
        check(Some(99 * MS), 8 * MS, 2000);
    }

    #[test]
    fn the_monitor_looks_at_least_a_hundred_times_a_second() {
        check(Some(600 * MS), 1000 * MS, 10_000);
        check(None, 1000 * MS, 10_000);
        check(Some(u64::MAX - 2), u64::MAX, 10_000);
    }
}
