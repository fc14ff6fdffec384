//! How much may be told of what changes all the time, and the count of what was left out.
//!
//! The log writer asks before each line. Alarms have an allowance each besides one in common: one
//! that chatters does not hide the others. An alarm's ON and OFF are told both or neither, and an
//! alarm that stands untold is told as soon as there is room: the log never shows an alarm that
//! is over as one that lasts, nor hides one that does.

use super::narration::span;

pub(super) const SECOND_NS: u64 = 1_000_000_000;
/// So many lines of one kind at once, and so many a second in the long run.
const BURST: u32 = 200;
const LINES_PER_SECOND: u64 = 20;
/// The same of one alarm.
const ALARM_BURST: u32 = 20;
const ALARM_LINES_PER_SECOND: u64 = 2;
/// What was left out is told this long after the first such line.
const TELL_AFTER_NS: u64 = 10 * SECOND_NS;

/// Lines that may go out: so many at once, so many a second in the long run.
#[derive(Clone, Copy)]
struct Budget {
    burst: u32,
    per_second: u64,
    left: u32,
    filled_ns: u64,
}

impl Budget {
    fn new(burst: u32, per_second: u64) -> Budget {
        Budget { burst, per_second, left: burst, filled_ns: 0 }
    }

    /// Whether there are so many by now.
    fn has(&mut self, now_ns: u64, lines: u32) -> bool {
        let since_ns = now_ns.saturating_sub(self.filled_ns);
        let earned = since_ns.saturating_mul(self.per_second) / SECOND_NS;
        if earned > 0 {
            let earned = u32::try_from(earned).unwrap_or(self.burst);
            self.left = self.burst.min(self.left.saturating_add(earned));
            self.filled_ns = now_ns;
        }
        self.left >= lines
    }
}

/// What keeps a chatter of lines within bounds.
pub(super) struct Allowance {
    what: &'static str,
    budget: Budget,
    withheld: u64,
    withheld_since_ns: u64,
}

impl Allowance {
    pub fn new(what: &'static str) -> Allowance {
        let budget = Budget::new(BURST, LINES_PER_SECOND);
        Allowance { what, budget, withheld: 0, withheld_since_ns: 0 }
    }

    /// Whether one more line may go out; one that may not is counted.
    pub fn take(&mut self, now_ns: u64) -> bool {
        let taken = self.draw(now_ns, 1);
        if !taken {
            self.withhold(1, now_ns);
        }
        taken
    }

    /// Whether so many more lines may go out.
    fn draw(&mut self, now_ns: u64, lines: u32) -> bool {
        let enough = self.budget.has(now_ns, lines);
        if enough {
            self.budget.left -= lines;
        }
        enough
    }

    /// Likewise, and of another budget as many: of both or of neither.
    fn draw_with(&mut self, other: &mut Budget, now_ns: u64, lines: u32) -> bool {
        let enough = other.has(now_ns, lines) && self.draw(now_ns, lines);
        if enough {
            other.left -= lines;
        }
        enough
    }

    fn withhold(&mut self, lines: u64, now_ns: u64) {
        if self.withheld == 0 {
            self.withheld_since_ns = now_ns;
        }
        self.withheld += lines;
    }

    /// The sentence on what was left out, with its count, where it is time for it.
    pub fn due(&mut self, now_ns: u64) -> Option<(u64, String)> {
        let waited_ns = now_ns.saturating_sub(self.withheld_since_ns);
        if waited_ns >= TELL_AFTER_NS { self.rest(now_ns) } else { None }
    }

    /// The same, whatever the time: the end has come.
    pub fn rest(&mut self, now_ns: u64) -> Option<(u64, String)> {
        let lasted = span(now_ns.saturating_sub(self.withheld_since_ns));
        let lines = std::mem::take(&mut self.withheld);
        let what = self.what;
        let text =
            format!("{what} come too often: so many lines of the last {lasted} were left out");
        (lines > 0).then_some((lines, text))
    }
}

/// The alarms: which stand, and whether the log knows.
pub(super) struct Alarms {
    allowance: Allowance,
    /// By the number of the watch.
    states: Vec<State>,
    /// Likewise: what each may still tell.
    budgets: Vec<Budget>,
    /// How many states are [`State::Untold`].
    untold: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Off,
    /// ON, and the log says so.
    Told,
    /// ON since this scan, and there was no room to say so.
    Untold {
        scan: u64,
    },
}

/// ON and OFF.
const PAIR: u32 = 2;

impl Alarms {
    pub fn new() -> Alarms {
        let (states, budgets) = (Vec::new(), Vec::new());
        Alarms { allowance: Allowance::new("alarms"), states, budgets, untold: 0 }
    }

    /// Whether the change of an alarm is to be told.
    pub fn change(&mut self, watch: u32, on: bool, scan: u64, now_ns: u64) -> bool {
        let at = watch as usize;
        if at >= self.states.len() {
            self.states.resize(at + 1, State::Off);
            self.budgets.resize(at + 1, Budget::new(ALARM_BURST, ALARM_LINES_PER_SECOND));
        }
        let (common, own) = (&mut self.allowance, &mut self.budgets[at]);
        let was = self.states[at];
        self.untold -= usize::from(matches!(was, State::Untold { .. }));
        let (is, told) = match (was, on) {
            (_, true) if common.draw_with(own, now_ns, PAIR) => (State::Told, true),
            (_, true) => (State::Untold { scan }, false),
            (State::Told, false) => (State::Off, true),
            (State::Untold { .. }, false) => {
                self.allowance.withhold(PAIR.into(), now_ns);
                (State::Off, false)
            }
            // Its ON was lost on the way.
            (State::Off, false) => (State::Off, self.allowance.take(now_ns)),
        };
        self.untold += usize::from(matches!(is, State::Untold { .. }));
        self.states[at] = is;
        told
    }

    /// Alarms that stand untold, as far as there is room to tell of them by now, each with the
    /// scan in which it went ON.
    pub fn belated(&mut self, now_ns: u64) -> Vec<(u32, u64)> {
        let mut belated = Vec::new();
        if self.untold == 0 {
            return belated;
        }
        for (watch, state) in self.states.iter_mut().enumerate() {
            let State::Untold { scan } = *state else { continue };
            if !self.allowance.draw_with(&mut self.budgets[watch], now_ns, PAIR) {
                continue;
            }
            *state = State::Told;
            self.untold -= 1;
            belated.push((watch as u32, scan));
        }
        belated
    }

    /// As [`Allowance::due`].
    pub fn due(&mut self, now_ns: u64) -> Option<(u64, String)> {
        self.allowance.due(now_ns)
    }

    /// As [`Allowance::rest`]; what stands untold counts too.
    pub fn rest(&mut self, now_ns: u64) -> Option<(u64, String)> {
        if self.untold > 0 {
            self.allowance.withhold(self.untold as u64, now_ns);
        }
        self.allowance.rest(now_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS_NS: u64 = 1_000_000;

    #[test]
    fn a_chatter_is_thinned_out_and_what_was_left_out_is_counted() {
        let mut allowance = Allowance::new("changes");
        let start = 1000 * SECOND_NS;
        let taken = (0..6000).filter(|n| allowance.take(start + n * 10 * MS_NS)).count();
        assert!((1350..1450).contains(&taken), "200 at once, 20 a second for a minute: {taken}");
        let left_out = allowance.due(start + 60 * SECOND_NS).map(|told| told.0);
        assert_eq!(left_out, Some(6000 - taken as u64));
        assert_eq!(allowance.rest(start + 60 * SECOND_NS), None, "told once");
        let later = start + 600 * SECOND_NS;
        assert_eq!((0..300).filter(|_| allowance.take(later)).count(), 200);
    }

    #[test]
    fn what_was_left_out_is_told_at_the_end_however_early_that_is() {
        let mut allowance = Allowance::new("changes");
        (0..BURST + 7).for_each(|_| _ = allowance.take(SECOND_NS));
        assert_eq!(allowance.due(2 * SECOND_NS), None);
        let (lines, text) = allowance.rest(2 * SECOND_NS).unwrap();
        assert_eq!(lines, 7);
        assert_eq!(text, "changes come too often: so many lines of the last 1s were left out");
    }

    #[test]
    fn an_alarm_is_told_with_both_its_lines_or_with_neither() {
        let mut alarms = Alarms::new();
        let (mut told, mut on) = (0, false);
        for n in 0..4000 {
            on = n % 2 == 0;
            let is_told = alarms.change(3, on, n, n * 2 * MS_NS);
            told += u64::from(is_told);
            if !on {
                assert_eq!(told % 2, 0, "a pair is whole");
            }
        }
        assert!(!on && (30..40).contains(&told), "20 at once, 2 a second for 8 s: {told}");
        assert_eq!(alarms.rest(8 * SECOND_NS).map(|rest| rest.0), Some(4000 - told));
    }

    #[test]
    fn an_alarm_that_chatters_hides_no_other_and_its_last_state_is_told() {
        let mut alarms = Alarms::new();
        let mut at_ns = SECOND_NS;
        for n in 0..3001_u64 {
            at_ns += 2 * MS_NS;
            alarms.change(0, n % 2 == 0, n, at_ns);
            if n % 500 == 499 {
                let other = (n / 500) as u32 + 1;
                assert!(alarms.change(other, true, n, at_ns), "{n}");
            }
        }
        let belated: Vec<_> =
            (1..=20).flat_map(|n| alarms.belated(at_ns + n * SECOND_NS)).collect();
        assert!(belated.is_empty() || belated == [(0, 3000)], "{belated:?}");
        assert_eq!((alarms.states[0], alarms.untold), (State::Told, 0));
    }

    #[test]
    fn an_alarm_that_stands_is_told_when_there_is_room() {
        let mut alarms = Alarms::new();
        let told = (0..150).filter(|watch| alarms.change(*watch, true, 9, SECOND_NS)).count();
        assert_eq!(told as u32, BURST / PAIR);
        assert_eq!(alarms.belated(SECOND_NS), []);
        assert_eq!(alarms.belated(SECOND_NS + 100 * MS_NS), [(100, 9)]);
        assert!(alarms.change(100, false, 20, SECOND_NS + 100 * MS_NS), "its OFF too");
        assert!(!alarms.change(149, false, 20, SECOND_NS + 100 * MS_NS));
        let rest = alarms.rest(2 * SECOND_NS).map(|rest| rest.0);
        assert_eq!(rest, Some(48 + 2), "48 stand untold, one came and went");
    }
}
