//! How many lines of an event are written, as its row says; what is beyond is counted.
//!
//! The log's layer asks before each line; the writing thread tells of what was withheld, ten
//! seconds after the first such line and at the end. Each event has a limit of its own, so a
//! flood of one hides no other. At level debug nothing is withheld here. Alarms have more refined
//! rules of their own (`allowance`).

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::events::{self, Event, Limit};

pub(super) const SECOND_NS: u64 = 1_000_000_000;
/// What was withheld is told this long after the first such line.
const TELL_AFTER_NS: u64 = 10 * SECOND_NS;

/// Lines that may go out: so many at once, so many a second in the long run.
#[derive(Clone, Copy)]
pub(super) struct Budget {
    limit: Limit,
    pub left: u32,
    filled_ns: u64,
}

impl Budget {
    pub fn new(limit: Limit) -> Budget {
        Budget { limit, left: limit.burst, filled_ns: 0 }
    }

    /// Whether there are so many by now.
    pub fn has(&mut self, now_ns: u64, lines: u32) -> bool {
        let Limit { burst, per_second } = self.limit;
        let passed_ns = u128::from(now_ns.saturating_sub(self.filled_ns));
        let earned = passed_ns * u128::from(per_second) / u128::from(SECOND_NS);
        if earned > 0 {
            let earned = u32::try_from(earned).unwrap_or(burst);
            self.left = burst.min(self.left.saturating_add(earned));
            self.filled_ns = now_ns;
        }
        self.left >= lines
    }

    /// Takes so many, if there are.
    pub fn draw(&mut self, now_ns: u64, lines: u32) -> bool {
        let enough = self.has(now_ns, lines);
        if enough {
            self.left -= lines;
        }
        enough
    }
}

/// What was withheld, until it is told.
#[derive(Clone, Copy, Default)]
pub(super) struct Withheld {
    lines: u64,
    since_ns: u64,
}

/// So many lines, since so long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Told {
    pub lines: u64,
    pub lasted_ns: u64,
}

impl Withheld {
    pub fn add(&mut self, lines: u64, now_ns: u64) {
        if self.lines == 0 {
            self.since_ns = now_ns;
        }
        self.lines += lines;
    }

    /// What is to be told, where it is time for it.
    pub fn due(&mut self, now_ns: u64) -> Option<Told> {
        let waited_ns = now_ns.saturating_sub(self.since_ns);
        if waited_ns >= TELL_AFTER_NS { self.rest(now_ns) } else { None }
    }

    /// The same, whatever the time: the end has come.
    pub fn rest(&mut self, now_ns: u64) -> Option<Told> {
        let Withheld { lines, since_ns } = std::mem::take(self);
        let lasted_ns = now_ns.saturating_sub(since_ns);
        (lines > 0).then_some(Told { lines, lasted_ns })
    }
}

struct Kind {
    event: &'static Event,
    budget: Budget,
    withheld: Withheld,
}

/// The limits of all events.
pub(super) struct Limits(Mutex<Vec<Kind>>);

impl Limits {
    pub fn new() -> Limits {
        let limited = events::all().filter(|event| event.limit != Limit::NONE);
        let kind = |event: &'static Event| {
            let budget = Budget::new(event.limit);
            Kind { event, budget, withheld: Withheld::default() }
        };
        Limits(Mutex::new(limited.map(kind).collect()))
    }

    fn kinds(&self) -> MutexGuard<'_, Vec<Kind>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether one more line of the event may go out; one that may not is counted.
    pub fn take(&self, event: &Event, now_ns: u64) -> bool {
        if event.limit == Limit::NONE {
            return true;
        }
        let mut kinds = self.kinds();
        let kind = kinds.binary_search_by_key(&event.number, |kind| kind.event.number);
        let Some(kind) = kind.ok().map(|at| &mut kinds[at]) else { return true };
        let taken = kind.budget.draw(now_ns, 1);
        if !taken {
            kind.withheld.add(1, now_ns);
        }
        taken
    }

    /// What is to be told of what was withheld: what is due, or at the end all.
    pub fn told(&self, now_ns: u64, all: bool) -> Vec<(&'static Event, Told)> {
        let mut kinds = self.kinds();
        let told = kinds.iter_mut().filter_map(|kind| {
            let withheld = &mut kind.withheld;
            let told = if all { withheld.rest(now_ns) } else { withheld.due(now_ns) };
            Some((kind.event, told?))
        });
        told.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS_NS: u64 = 1_000_000;

    fn event(name: &str) -> &'static Event {
        events::named(name).unwrap()
    }

    #[test]
    fn a_chatter_is_thinned_out_and_what_was_left_out_is_counted() {
        let (limits, chatter) = (Limits::new(), event("tag-on"));
        let start = 1000 * SECOND_NS;
        let taken = (0..6000).filter(|n| limits.take(chatter, start + n * 10 * MS_NS)).count();
        assert!((1350..1450).contains(&taken), "200 at once, 20 a second for a minute: {taken}");
        let told = limits.told(start + 60 * SECOND_NS, false);
        let [(of, Told { lines, .. })] = told[..] else { panic!("{}", told.len()) };
        assert_eq!((of.name, lines), ("tag-on", 6000 - taken as u64));
        assert!(limits.told(start + 60 * SECOND_NS, true).is_empty(), "told once");
        let later = start + 600 * SECOND_NS;
        assert_eq!((0..300).filter(|_| limits.take(chatter, later)).count(), 200);
    }

    #[test]
    fn what_was_left_out_is_told_at_the_end_however_early_that_is() {
        let (limits, chatter) = (Limits::new(), event("tag-off"));
        (0..Limit::PLANT.burst + 7).for_each(|_| _ = limits.take(chatter, SECOND_NS));
        assert!(limits.told(2 * SECOND_NS, false).is_empty());
        let told = limits.told(2 * SECOND_NS, true);
        let expected = Told { lines: 7, lasted_ns: SECOND_NS };
        assert_eq!(told.iter().map(|told| told.1).collect::<Vec<_>>(), [expected]);
    }

    #[test]
    fn a_flood_of_one_event_hides_no_other() {
        let limits = Limits::new();
        let (flood, other) = (event("modbus-write-refused"), event("modbus-connected"));
        let passed = (0..1000).filter(|n| limits.take(flood, SECOND_NS + n * MS_NS)).count();
        assert_eq!(passed, 20, "20 at once, one a second");
        assert!(limits.take(other, SECOND_NS));
        assert!((0..1000).all(|_| limits.take(event("alarm-on"), SECOND_NS)), "no limit here");
    }
}
