//! Measurements of the scan thread: execution time, wake-up lateness, overruns.
//!
//! Kept twice, since the last report and since the start of RUN, in memory that was allocated at
//! start. A [`Statistics`] is a copy of one of the two, with percentiles. The figures are atomics
//! that one thread writes, so a [`RunMeter`] reads them without any help of the scan thread.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use super::histogram::{Histogram, HistogramBucket};
use rungd_engine::ScanTimes;

/// One measured quantity, in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Spread {
    pub last_ns: u64,
    pub min_ns: u64,
    pub sum_ns: u64,
    pub mean_ns: u64,
    pub max_ns: u64,
    pub p50_ns: u64,
    pub p99_ns: u64,
    pub p999_ns: u64,
}

/// A report of statistics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Whether it covers the whole time since the start of RUN; else the time since the last
    /// report.
    pub(crate) whole: bool,
    /// The length of that time.
    pub over_ns: u64,
    /// Complete scans in that time.
    pub scans: u64,
    /// The durations of scans, from the timestamp to the end of `BottomOfScan`.
    pub execution: Spread,
    /// The delay from a grid point to the wake-up of the scan thread.
    pub lateness: Spread,
    /// Scans that ended after the next grid point.
    pub overruns: u64,
    /// Grid points that passed without a scan because of overruns.
    pub skipped: u64,
}

/// The measurements of one quantity. The scan thread alone writes.
#[derive(Debug, Default)]
struct QuantityMeter {
    histogram: Histogram,
    last_ns: AtomicU64,
    min_ns: AtomicU64,
    max_ns: AtomicU64,
    sum_ns: AtomicU64,
    count: AtomicU64,
}

/// Both quantities and the overruns, since a given time.
#[derive(Debug, Default)]
struct PeriodMeter {
    from_ns: AtomicU64,
    /// The time of its end; 0 until it has ended.
    until_ns: AtomicU64,
    execution: QuantityMeter,
    lateness: QuantityMeter,
    overruns: AtomicU64,
    skipped: AtomicU64,
}

/// The statistics since the start of RUN, for observers. Cheap to clone.
#[derive(Clone, Debug)]
pub struct RunMeter(Arc<PeriodMeter>);

/// The figures of a [`RunMeter`]. The scan thread continues to count during the reading: figures
/// may differ by one scan.
#[derive(Clone, Debug)]
pub struct MeterReading {
    /// The figures.
    pub statistics: Statistics,
    /// The distribution of the scans' execution times.
    pub execution: Vec<HistogramBucket>,
    /// The distribution of their lateness.
    pub lateness: Vec<HistogramBucket>,
}

impl RunMeter {
    /// Reads the figures. Walks a few thousand counts: not for the scan thread.
    pub fn read(&self, now_ns: u64) -> MeterReading {
        let since = &self.0;
        MeterReading {
            statistics: Statistics { whole: true, ..since.statistics(now_ns) },
            execution: since.execution.histogram.bars(),
            lateness: since.lateness.histogram.bars(),
        }
    }
}

/// The measurements that the scan thread keeps.
pub struct ScanMeasurements {
    report: PeriodMeter,
    whole: Arc<PeriodMeter>,
    mean: FilteredMean,
}

/// `DST1`: a mean that each scan moves by a sixteenth of the difference, in 1/16 ns.
#[derive(Default)]
struct FilteredMean(Option<i64>);

impl ScanMeasurements {
    /// Begins without measurements, at this time.
    pub fn new(now_ns: u64) -> ScanMeasurements {
        let since = || PeriodMeter { from_ns: now_ns.into(), ..PeriodMeter::default() };
        ScanMeasurements { report: since(), whole: Arc::new(since()), mean: FilteredMean(None) }
    }

    /// The figures since the start of RUN, for observers.
    pub fn meter(&self) -> RunMeter {
        RunMeter(Arc::clone(&self.whole))
    }

    /// Ends the measured time; called at the end of RUN.
    pub fn end(&self, now_ns: u64) {
        self.whole.until_ns.store(now_ns, Relaxed);
    }

    /// Deletes all measurements; called at the begin of RUN.
    pub fn restart(&mut self, now_ns: u64) {
        self.report.clear(now_ns);
        self.whole.clear(now_ns);
        self.mean = FilteredMean(None);
    }

    /// Adds a complete scan.
    pub fn scan(&mut self, execution_ns: u64, lateness_ns: u64) {
        for since in [&self.report, &*self.whole] {
            since.execution.add(execution_ns);
            since.lateness.add(lateness_ns);
        }
        self.mean.add(execution_ns);
    }

    /// Adds an overrun.
    pub fn overrun(&mut self, skipped: u64) {
        for since in [&self.report, &*self.whole] {
            add(&since.overruns, 1);
            add(&since.skipped, skipped);
        }
    }

    /// The duration of the last scan.
    pub fn last_scan_ns(&self) -> u64 {
        self.whole.execution.last_ns.load(Relaxed)
    }

    /// The values of DST1..DST4.
    pub fn scan_times(&self) -> ScanTimes {
        let us = |ns: &AtomicU64| i32::try_from(ns.load(Relaxed) / 1000).unwrap_or(i32::MAX);
        let execution = &self.whole.execution;
        ScanTimes {
            mean_us: i32::try_from(self.mean.ns() / 1000).unwrap_or(i32::MAX),
            min_us: us(&execution.min_ns),
            max_us: us(&execution.max_ns),
            last_us: us(&execution.last_ns),
        }
    }

    /// The statistics since the last call; begins the next interval.
    pub fn take_report(&mut self, now_ns: u64) -> Statistics {
        let statistics = self.report.statistics(now_ns);
        self.report.clear(now_ns);
        statistics
    }

    /// The statistics since the start of RUN.
    pub fn whole(&self, now_ns: u64) -> Statistics {
        Statistics { whole: true, ..self.whole.statistics(now_ns) }
    }
}

impl PeriodMeter {
    fn statistics(&self, now_ns: u64) -> Statistics {
        let until_ns = match self.until_ns.load(Relaxed) {
            0 => now_ns,
            ended_ns => ended_ns,
        };
        Statistics {
            whole: false,
            over_ns: until_ns.saturating_sub(self.from_ns.load(Relaxed)),
            scans: self.execution.count.load(Relaxed),
            execution: self.execution.spread(),
            lateness: self.lateness.spread(),
            overruns: self.overruns.load(Relaxed),
            skipped: self.skipped.load(Relaxed),
        }
    }

    fn clear(&self, now_ns: u64) {
        self.from_ns.store(now_ns, Relaxed);
        self.execution.clear();
        self.lateness.clear();
        for zero in [&self.until_ns, &self.overruns, &self.skipped] {
            zero.store(0, Relaxed);
        }
    }
}

impl QuantityMeter {
    fn add(&self, value_ns: u64) {
        self.histogram.add(value_ns);
        self.last_ns.store(value_ns, Relaxed);
        let (min_ns, max_ns) = (self.min_ns.load(Relaxed), self.max_ns.load(Relaxed));
        if self.count.load(Relaxed) == 0 || value_ns < min_ns {
            self.min_ns.store(value_ns, Relaxed);
        }
        self.max_ns.store(max_ns.max(value_ns), Relaxed);
        add(&self.sum_ns, value_ns);
        add(&self.count, 1);
    }

    fn spread(&self) -> Spread {
        let [last_ns, min_ns, max_ns, sum_ns, count] =
            [&self.last_ns, &self.min_ns, &self.max_ns, &self.sum_ns, &self.count]
                .map(|figure| figure.load(Relaxed));
        // A bucket's upper edge may be above the largest measured value.
        let percentile = |per_mille| self.histogram.percentile(per_mille).min(max_ns);
        Spread {
            last_ns,
            min_ns,
            sum_ns,
            mean_ns: sum_ns.checked_div(count).unwrap_or(0),
            max_ns,
            p50_ns: percentile(500),
            p99_ns: percentile(990),
            p999_ns: percentile(999),
        }
    }

    fn clear(&self) {
        self.histogram.clear();
        for zero in [&self.last_ns, &self.min_ns, &self.max_ns, &self.sum_ns, &self.count] {
            zero.store(0, Relaxed);
        }
    }
}

/// Only one thread writes: a load and a store are enough.
fn add(figure: &AtomicU64, more: u64) {
    figure.store(figure.load(Relaxed).saturating_add(more), Relaxed);
}

impl FilteredMean {
    fn add(&mut self, value_ns: u64) {
        let value = i64::try_from(value_ns).unwrap_or(i64::MAX / 32) * 16;
        self.0 = Some(match self.0 {
            None => value,
            Some(mean) => mean + (value - mean) / 16,
        });
    }

    fn ns(&self) -> u64 {
        self.0.map_or(0, |mean| (mean / 16) as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_resets_its_interval_but_not_the_totals() {
        let mut books = ScanMeasurements::new(0);
        books.scan(4_000, 100);
        books.scan(2_000, 300);
        books.overrun(3);
        let first = books.take_report(50);
        assert_eq!((first.scans, first.overruns, first.skipped, first.over_ns), (2, 1, 3, 50));
        let execution = first.execution;
        assert_eq!((execution.min_ns, execution.max_ns, execution.last_ns), (2000, 4000, 2000));
        assert_eq!((execution.mean_ns, execution.p999_ns), (3000, 4000));
        books.scan(9_000, 0);
        let second = books.take_report(80);
        assert_eq!((second.scans, second.execution.min_ns, second.overruns), (1, 9000, 0));
        let whole = books.whole(80);
        assert_eq!((whole.scans, whole.overruns, whole.lateness.max_ns), (3, 1, 300));
    }

    #[test]
    fn scan_times_are_in_microseconds_and_their_mean_is_filtered() {
        let mut books = ScanMeasurements::new(0);
        assert_eq!(books.scan_times(), ScanTimes::default());
        books.scan(16_000, 0);
        books.scan(32_000, 0);
        let times = books.scan_times();
        assert_eq!((times.mean_us, times.min_us, times.max_us, times.last_us), (17, 16, 32, 32));
        (0..200).for_each(|_| books.scan(32_000, 0));
        assert_eq!(books.scan_times().mean_us, 31);
    }

    #[test]
    fn statistics_without_measurements_are_zero() {
        assert_eq!(ScanMeasurements::new(7).take_report(7), Statistics::default());
    }
}
