//! The time that passed in a recording, by the heads of its blocks.
//!
//! The times of one head come from a monotonic clock, and differ by the time that passed. Between
//! two heads the wall clock may have been set: a step of more than ten seconds counts as no time.
//! Used for the age of files (`stored_files`) and for the reach of memory (`recent`).

use super::block::BlockHead;

const SECOND_NS: i64 = 1_000_000_000;
/// The longest time that counts within one section. A section ends after about two seconds; only
/// the last scan may be late.
const SECTION_NS_MAX: i64 = 3600 * SECOND_NS;
/// The longest time that counts between two sections.
const PAUSE_NS_MAX: i64 = 10 * SECOND_NS;

/// The time that passed in sections, in the order of the recording.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PassedTime {
    ns: u64,
    /// The end of the last section.
    end_ns: Option<i64>,
}

impl PassedTime {
    /// The time, ns.
    pub fn ns(self) -> u64 {
        self.ns
    }

    /// Adds the next section; returns the time that it adds.
    pub fn add(&mut self, head: &BlockHead) -> u64 {
        // A longer span is a clock that was set: how much time passed is unknown, perhaps none.
        let span = |from: i64, to: i64, most: i64| match to.saturating_sub(from) {
            span if (0..=most).contains(&span) => span.unsigned_abs(),
            _ => 0,
        };
        let within = span(head.begin_ns, head.end_ns, SECTION_NS_MAX);
        let pause = self.end_ns.map_or(0, |end_ns| span(end_ns, head.begin_ns, PAUSE_NS_MAX));
        self.end_ns = Some(head.end_ns);
        self.ns = self.ns.saturating_add(within + pause);
        within + pause
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(begin_s: i64, end_s: i64) -> BlockHead {
        BlockHead {
            sequence: 0,
            number: 0,
            scans: 1,
            begin_ns: begin_s * SECOND_NS,
            end_ns: end_s * SECOND_NS,
            follows: true,
            end_hash: None,
        }
    }

    #[test]
    fn a_clock_adjustment_adds_no_recorded_time() {
        let mut passed = PassedTime::default();
        let thousand_days = 86_400_000;
        for (begin_s, end_s, expected_s) in [
            (100, 101, 1),
            (102, 103, 3),
            (103 + thousand_days, 104 + thousand_days, 3 + 1),
            (105, 106, 5),
            (i64::MAX / SECOND_NS, i64::MIN / SECOND_NS, 5),
        ] {
            passed.add(&head(begin_s, end_s));
            assert_eq!(passed.ns(), expected_s * SECOND_NS as u64, "{begin_s}");
        }
    }
}
