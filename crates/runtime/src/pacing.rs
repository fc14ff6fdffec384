//! When scans are due: a fixed grid of absolute deadlines.
//!
//! The scan thread sleeps until a grid point, scans, and requests the next point. A scan that ends
//! after the next point is an overrun: the points that have passed are skipped and counted, and no
//! burst makes up for them. The clock is an argument, so that all of this is tested with numbers.

use std::sync::Arc;

use super::sys;
use super::wall::UtcOffset;

/// The monotonic clock, the way to wait for it, and the time of day.
pub trait Clock {
    /// Nanoseconds of a clock that never steps.
    fn now_ns(&self) -> u64;
    /// Nanoseconds of the clock of clients' deadlines: unlike [`Clock::now_ns`], it goes on while
    /// the machine is suspended.
    fn boottime_ns(&self) -> u64 {
        self.now_ns()
    }
    /// Returns at the deadline, or as soon after it as the machine manages.
    fn sleep_until(&mut self, deadline_ns: u64);
    /// As [`Clock::sleep_until`], for the deadline of a scan: the thread may be awake before it.
    fn await_scan(&mut self, deadline_ns: u64) {
        self.sleep_until(deadline_ns);
    }
    /// The local time of day, as seconds since 1970-01-01 00:00:00 of the local clock. It may jump
    /// either way, so only the ladder uses it, and no duration is measured with it.
    fn local_s(&self) -> i64;
}

/// The machine's own clocks, and the offset of local time, which a different thread updates.
#[derive(Clone, Debug, Default)]
pub struct MachineClock {
    /// Shared with the thread that updates it.
    pub offset: Arc<UtcOffset>,
    /// How long before the deadline of a scan the thread is awake and looks at the clock, ns.
    pub spin_ns: u64,
}

impl Clock for MachineClock {
    fn now_ns(&self) -> u64 {
        sys::monotonic_ns()
    }

    fn boottime_ns(&self) -> u64 {
        sys::boottime_ns()
    }

    fn sleep_until(&mut self, deadline_ns: u64) {
        sys::sleep_until_ns(deadline_ns);
    }

    fn await_scan(&mut self, deadline_ns: u64) {
        sys::sleep_until_ns(deadline_ns.saturating_sub(self.spin_ns));
        while sys::monotonic_ns() < deadline_ns {
            std::hint::spin_loop();
        }
    }

    fn local_s(&self) -> i64 {
        self.offset.local_s(sys::wall_s())
    }
}

/// The grid: `first`, `first + period`, `first + 2 periods`, …
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanGrid {
    period_ns: u64,
    deadline_ns: u64,
}

impl ScanGrid {
    /// A grid whose first point is `first_ns`. The period is at least 1 ns.
    pub fn new(first_ns: u64, period_ns: u64) -> ScanGrid {
        ScanGrid { period_ns: period_ns.max(1), deadline_ns: first_ns }
    }

    /// The point that is due next.
    pub fn deadline_ns(&self) -> u64 {
        self.deadline_ns
    }

    /// Sets the period after the point that is due next; that point stays.
    pub fn change(&mut self, period_ns: u64) {
        self.period_ns = period_ns.max(1);
    }

    /// Moves on to the first point at or after `end_ns`. Returns the number of points that were
    /// skipped: 0 unless the scan overran.
    pub fn advance(&mut self, end_ns: u64) -> u64 {
        self.deadline_ns += self.period_ns;
        let behind_ns = end_ns.saturating_sub(self.deadline_ns);
        let skipped = behind_ns.div_ceil(self.period_ns);
        self.deadline_ns += skipped * self.period_ns;
        skipped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the grid with periods of 10 from 100, after scans that end at the given times.
    fn check(ends: &[u64], expected: &[(u64, u64)]) {
        let mut grid = ScanGrid::new(100, 10);
        let found: Vec<_> =
            ends.iter().map(|end| (grid.advance(*end), grid.deadline_ns())).collect();
        assert_eq!(found, expected, "{ends:?}");
    }

    #[test]
    fn scans_in_time_keep_the_grid() {
        check(&[101, 119, 129], &[(0, 110), (0, 120), (0, 130)]);
    }

    #[test]
    fn a_new_period_counts_from_the_next_due_time() {
        let mut grid = ScanGrid::new(100, 10);
        assert_eq!((grid.advance(101), grid.deadline_ns()), (0, 110));
        grid.change(25);
        assert_eq!(grid.deadline_ns(), 110);
        assert_eq!((grid.advance(112), grid.deadline_ns()), (0, 135));
        grid.change(5);
        assert_eq!((grid.advance(136), grid.deadline_ns()), (0, 140));
        assert_eq!((grid.advance(141), grid.deadline_ns()), (0, 145));
    }

    #[test]
    fn a_scan_that_ends_exactly_at_the_next_deadline_is_in_time() {
        check(&[110], &[(0, 110)]);
    }

    #[test]
    fn an_overrun_skips_to_the_next_deadline_of_the_grid() {
        check(&[111, 121], &[(1, 120), (0, 130)]);
        check(&[145], &[(4, 150)]);
        check(&[150], &[(4, 150)]);
    }
}
