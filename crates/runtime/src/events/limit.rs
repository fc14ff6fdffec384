//! Limits the number of log lines by token buckets: for the log, for alarms, for field devices.
//!
//! Pure: the time is an argument. A [`Limiter`] has a [`Budget`] for each key, so that a flood of
//! one key does not hide the other keys. It counts the lines that it withholds.

use std::collections::BTreeMap;

const SECOND_NS: u64 = 1_000_000_000;
/// The time from the first withheld line to the line that reports the count.
const TELL_AFTER_NS: u64 = 10 * SECOND_NS;

/// The limit of a kind of lines: `burst` lines at once, and in the long run one line per
/// `every_ms`. The lines beyond the limit are counted, and the log reports the count
/// (`lines-withheld`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineLimit {
    /// The number of lines at once; 0 means no limit.
    pub burst: u32,
    /// The time from line to line in the long run, in milliseconds.
    pub every_ms: u32,
}

impl LineLimit {
    /// For lines that are rare, or that are limited elsewhere.
    pub const NONE: LineLimit = LineLimit { burst: 0, every_ms: 0 };
    /// For lines that the plant can cause.
    pub const PLANT: LineLimit = LineLimit { burst: 200, every_ms: 50 };
    /// For lines that any client on the network or the socket can cause.
    pub const CLIENTS: LineLimit = LineLimit { burst: 20, every_ms: 1000 };
    /// For the lines of one alarm; [`LineLimit::PLANT`] limits all alarms together.
    pub const ALARM: LineLimit = LineLimit { burst: 20, every_ms: 500 };
    /// For the lines about the trouble of one field device.
    pub const DEVICE: LineLimit = LineLimit { burst: 20, every_ms: 10_000 };

    /// The number of lines per second in the long run.
    pub fn per_second(self) -> u32 {
        1000 / self.every_ms.max(1)
    }
}

/// The number of lines that a limit permits now.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    limit: LineLimit,
    left: u32,
    filled_ns: u64,
}

impl Budget {
    /// A full budget.
    pub fn new(limit: LineLimit) -> Budget {
        Budget { limit, left: limit.burst, filled_ns: 0 }
    }

    /// The lines that were left at the last look.
    pub fn left(&self) -> u32 {
        self.left
    }

    /// Whether `lines` lines may be written now.
    pub fn has(&mut self, now_ns: u64, lines: u32) -> bool {
        let LineLimit { burst, every_ms } = self.limit;
        let every_ns = (u64::from(every_ms) * 1_000_000).max(1);
        let earned = now_ns.saturating_sub(self.filled_ns) / every_ns;
        if earned > 0 {
            let earned = u32::try_from(earned).unwrap_or(burst);
            self.left = burst.min(self.left.saturating_add(earned));
            self.filled_ns = now_ns;
        }
        self.left >= lines
    }

    /// Takes `lines` lines, or none of them.
    pub fn draw(&mut self, now_ns: u64, lines: u32) -> bool {
        let is_enough = self.has(now_ns, lines);
        if is_enough {
            self.left -= lines;
        }
        is_enough
    }
}

/// The number of lines that were withheld and not yet reported.
#[derive(Clone, Copy, Debug, Default)]
pub struct WithheldCount {
    lines: u64,
    since_ns: u64,
}

/// The number of withheld lines, and the time in which they were withheld.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WithheldLines {
    /// The number of lines.
    pub lines: u64,
    /// The time, ns.
    pub lasted_ns: u64,
}

impl WithheldCount {
    /// Counts withheld lines.
    pub fn add(&mut self, lines: u64, now_ns: u64) {
        if self.lines == 0 {
            self.since_ns = now_ns;
        }
        self.lines += lines;
    }

    /// The count, once it is due; then the count starts again at 0.
    pub fn due(&mut self, now_ns: u64) -> Option<WithheldLines> {
        let waited_ns = now_ns.saturating_sub(self.since_ns);
        if waited_ns >= TELL_AFTER_NS { self.rest(now_ns) } else { None }
    }

    /// The count at any time, for example at the end of the log.
    pub fn rest(&mut self, now_ns: u64) -> Option<WithheldLines> {
        let WithheldCount { lines, since_ns } = std::mem::take(self);
        let lasted_ns = now_ns.saturating_sub(since_ns);
        (lines > 0).then_some(WithheldLines { lines, lasted_ns })
    }
}

/// The budget of each key, with the count of its withheld lines.
#[derive(Debug, Default)]
pub struct Limiter<K>(BTreeMap<K, (Budget, WithheldCount)>);

impl<K: Ord + Copy> Limiter<K> {
    /// A limiter without any key.
    pub const fn new() -> Limiter<K> {
        Limiter(BTreeMap::new())
    }

    /// Whether one more line of this key may be written. If not, the line is counted.
    pub fn take(&mut self, key: K, limit: LineLimit, now_ns: u64) -> bool {
        if limit == LineLimit::NONE {
            return true;
        }
        let fresh = || (Budget::new(limit), WithheldCount::default());
        let (budget, withheld) = self.0.entry(key).or_insert_with(fresh);
        let is_taken = budget.draw(now_ns, 1);
        if !is_taken {
            withheld.add(1, now_ns);
        }
        is_taken
    }

    /// The counts of withheld lines for each key: those that are due, or at the end all of them.
    pub fn due_reports(&mut self, now_ns: u64, all: bool) -> Vec<(K, WithheldLines)> {
        let told = self.0.iter_mut().filter_map(|(key, (_, withheld))| {
            let told = if all { withheld.rest(now_ns) } else { withheld.due(now_ns) };
            Some((*key, told?))
        });
        told.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS_NS: u64 = 1_000_000;

    #[test]
    fn excess_lines_of_an_event_are_withheld_and_counted() {
        let mut limiter = Limiter::new();
        let start = 1000 * SECOND_NS;
        let mut take = |now_ns| limiter.take("tag-on", LineLimit::PLANT, now_ns);
        let taken = (0..6000).filter(|n| take(start + n * 10 * MS_NS)).count();
        assert!((1350..1450).contains(&taken), "200 at once, 20 a second for a minute: {taken}");
        let told = limiter.due_reports(start + 60 * SECOND_NS, false);
        let [(event_name, WithheldLines { lines, .. })] = told[..] else {
            panic!("{}", told.len())
        };
        assert_eq!((event_name, lines), ("tag-on", 6000 - taken as u64));
        assert!(limiter.due_reports(start + 60 * SECOND_NS, true).is_empty(), "told once");
        let later = start + 600 * SECOND_NS;
        let taken = (0..300).filter(|_| limiter.take("tag-on", LineLimit::PLANT, later)).count();
        assert_eq!(taken, 200);
    }

    #[test]
    fn withheld_lines_are_always_reported_at_the_end() {
        let mut limiter = Limiter::new();
        (0..LineLimit::PLANT.burst + 7)
            .for_each(|_| _ = limiter.take(1, LineLimit::PLANT, SECOND_NS));
        assert!(limiter.due_reports(2 * SECOND_NS, false).is_empty());
        let expected = WithheldLines { lines: 7, lasted_ns: SECOND_NS };
        assert_eq!(limiter.due_reports(2 * SECOND_NS, true), [(1, expected)]);
    }

    #[test]
    fn a_flood_of_one_event_does_not_limit_other_events() {
        let mut limiter = Limiter::new();
        let mut take = |key, limit, now_ns| limiter.take(key, limit, now_ns);
        let flood = |n| SECOND_NS + n * MS_NS;
        let passed = (0..1000).filter(|n| take("flood", LineLimit::CLIENTS, flood(*n))).count();
        assert_eq!(passed, 20, "20 at once, one a second");
        assert!(take("other", LineLimit::CLIENTS, SECOND_NS));
        assert!((0..1000).all(|_| take("rare", LineLimit::NONE, SECOND_NS)), "no limit here");
    }

    #[test]
    fn a_limit_is_shown_in_lines_per_second() {
        let per_second = |limit: LineLimit| limit.per_second();
        assert_eq!(
            (
                per_second(LineLimit::PLANT),
                per_second(LineLimit::CLIENTS),
                per_second(LineLimit::ALARM)
            ),
            (20, 1, 2)
        );
    }
}
