//! A histogram of durations with a fixed number of buckets, so that counting never allocates.
//!
//! One thread counts. Other threads may read at the same time; they see each count as it was at
//! some moment. Counting is a plain load and store: no thread waits.
//!
//! Buckets grow with the value: 32 of them for every doubling, so a percentile is at most about
//! three per cent above the true one, from nanoseconds to a minute.

use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

/// The number of buckets for each doubling.
const STEPS: u64 = 32;
const STEPS_LOG2: u32 = 5;
/// Values of 2^36 ns (69 s) and more are counted in the last bucket.
const TOP_LOG2: u32 = 36;
const BUCKETS: usize = ((TOP_LOG2 - STEPS_LOG2 + 1) as usize) * STEPS as usize;

/// Counts of durations in ns.
#[derive(Debug)]
pub struct Histogram {
    counts: Box<[AtomicU32]>,
}

/// A range of values, and the number of values in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HistogramBucket {
    /// The greatest value of the range; the least is the greatest of the bar before it plus 1.
    pub up_to_ns: u64,
    /// The number of values.
    pub count: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Histogram { counts: (0..BUCKETS).map(|_| AtomicU32::new(0)).collect() }
    }
}

impl Histogram {
    /// Counts a value.
    pub fn add(&self, value_ns: u64) {
        let count = &self.counts[bucket(value_ns)];
        count.store(count.load(Relaxed).saturating_add(1), Relaxed);
    }

    /// Sets all counts to 0.
    pub fn clear(&self) {
        self.counts.iter().for_each(|count| count.store(0, Relaxed));
    }

    /// The value that `per_mille` of 1000 counted values do not exceed; 0 if no value was counted.
    pub fn percentile(&self, per_mille: u64) -> u64 {
        let counts = || self.counts.iter().map(|count| u64::from(count.load(Relaxed)));
        let wanted = (counts().sum::<u64>() * per_mille).div_ceil(1000);
        let mut seen = 0;
        for (at, count) in counts().enumerate() {
            seen += count;
            if seen >= wanted && seen > 0 {
                return upper_edge(at);
            }
        }
        0
    }

    /// One bar for each doubling, from the first to the last one that has values.
    pub fn bars(&self) -> Vec<HistogramBucket> {
        let octaves = self.counts.chunks(STEPS as usize).enumerate();
        let bar = |(octave, counts): (usize, &[AtomicU32])| HistogramBucket {
            up_to_ns: upper_edge((octave + 1) * STEPS as usize - 1),
            count: counts.iter().map(|count| u64::from(count.load(Relaxed))).sum(),
        };
        let bars: Vec<HistogramBucket> = octaves.map(bar).collect();
        let counted = |bar: &HistogramBucket| bar.count > 0;
        let Some(first) = bars.iter().position(counted) else { return Vec::new() };
        let last = bars.iter().rposition(counted).unwrap_or(first);
        bars[first..=last].to_vec()
    }
}

fn bucket(value: u64) -> usize {
    if value < STEPS {
        return value as usize;
    }
    let log2 = 63 - value.leading_zeros();
    if log2 >= TOP_LOG2 {
        return BUCKETS - 1;
    }
    let step = (value >> (log2 - STEPS_LOG2)) & (STEPS - 1);
    ((log2 - STEPS_LOG2 + 1) as usize) * STEPS as usize + step as usize
}

/// The largest value of a bucket.
fn upper_edge(bucket: usize) -> u64 {
    let (octave, step) = (bucket as u64 / STEPS, bucket as u64 % STEPS);
    if octave == 0 {
        return step;
    }
    ((STEPS + step + 1) << (octave - 1)) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bucket_edge_exceeds_its_values_by_at_most_three_per_cent() {
        for log2 in 0..36 {
            for value in [1_u64 << log2, (1 << log2) + (1 << log2) / 3, (2 << log2) - 1] {
                let edge = upper_edge(bucket(value));
                assert!(edge >= value && edge - value <= value / 32, "{value} {edge}");
            }
        }
        assert_eq!(bucket(u64::MAX), BUCKETS - 1);
    }

    #[test]
    fn percentiles_are_accurate_to_four_per_cent() {
        let histogram = Histogram::default();
        assert_eq!(histogram.percentile(500), 0);
        (1..=1000).for_each(|n| histogram.add(n * 1000));
        let near = |found: u64, true_value: u64| {
            assert!(found >= true_value && found <= true_value * 104 / 100, "{found}");
        };
        near(histogram.percentile(500), 500_000);
        near(histogram.percentile(990), 990_000);
        near(histogram.percentile(999), 999_000);
        let bars = histogram.bars();
        assert_eq!(bars.iter().map(|bar| bar.count).sum::<u64>(), 1000);
        assert!(bars.is_sorted_by_key(|bar| bar.up_to_ns) && bars.len() == 11, "{bars:?}");
        assert!(bars[0].up_to_ns == 1023 && bars[0].count == 1, "{bars:?}");
        histogram.clear();
        assert_eq!(histogram.bars(), []);
        assert_eq!(histogram.percentile(999), 0);
    }
}
