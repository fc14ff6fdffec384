//! A histogram of durations with a fixed number of buckets, so that counting never allocates.
//!
//! Buckets grow with the value: 32 of them for every doubling, so a percentile is at most about
//! three per cent above the true one, from nanoseconds to a minute.

/// Buckets of a doubling.
const STEPS: u64 = 32;
const STEPS_LOG2: u32 = 5;
/// Values from 2^36 ns (69 s) on count as the last bucket.
const TOP_LOG2: u32 = 36;
const BUCKETS: usize = ((TOP_LOG2 - STEPS_LOG2 + 1) as usize) * STEPS as usize;

/// Counts of durations in ns.
#[derive(Clone, Debug)]
pub struct Histogram {
    counts: Box<[u32]>,
    total: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Histogram { counts: vec![0; BUCKETS].into_boxed_slice(), total: 0 }
    }
}

impl Histogram {
    /// Counts one.
    pub fn add(&mut self, value_ns: u64) {
        let count = &mut self.counts[bucket(value_ns)];
        *count = count.saturating_add(1);
        self.total += 1;
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.counts.fill(0);
        self.total = 0;
    }

    /// The value that `per_mille` of 1000 counted ones do not exceed; 0 if none was counted.
    pub fn percentile(&self, per_mille: u64) -> u64 {
        let wanted = (self.total * per_mille).div_ceil(1000);
        let mut seen = 0;
        for (at, count) in self.counts.iter().enumerate() {
            seen += u64::from(*count);
            if seen >= wanted && seen > 0 {
                return upper_edge(at);
            }
        }
        0
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
    fn every_value_lies_below_its_edge_by_three_per_cent_at_most() {
        for log2 in 0..36 {
            for value in [1_u64 << log2, (1 << log2) + (1 << log2) / 3, (2 << log2) - 1] {
                let edge = upper_edge(bucket(value));
                assert!(edge >= value && edge - value <= value / 32, "{value} {edge}");
            }
        }
        assert_eq!(bucket(u64::MAX), BUCKETS - 1);
    }

    #[test]
    fn percentiles_of_a_thousand() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.percentile(500), 0);
        (1..=1000).for_each(|n| histogram.add(n * 1000));
        let near = |found: u64, true_value: u64| {
            assert!(found >= true_value && found <= true_value * 104 / 100, "{found}");
        };
        near(histogram.percentile(500), 500_000);
        near(histogram.percentile(990), 990_000);
        near(histogram.percentile(999), 999_000);
        histogram.clear();
        assert_eq!(histogram.percentile(999), 0);
    }
}
