//! Limits the log lines of alarms that change all the time, and counts the lines left out.
//!
//! Called by the log writer before each line (the limits of other events are in their rows). Each
//! alarm has an allowance of its own, and all alarms share a common one, so an alarm that chatters
//! does not hide the others. The ON and the OFF of an alarm are logged together or not at all. An
//! alarm that is ON without a line is logged as soon as the allowance permits, or at the end. So
//! the log never shows a past alarm as still ON, and never hides an alarm that stays ON.

use rungd_base::duration_text::duration_text;
use rungd_runtime::events::LineLimit;
use rungd_runtime::events::limit::{Budget, WithheldCount, WithheldLines};
use rungd_runtime::say::say;

/// The alarms: which of them are ON, and whether the log has a line about it.
pub(super) struct AlarmLines {
    common: Budget,
    withheld: WithheldCount,
    /// By number of the watch.
    states: Vec<WatchState>,
    /// By number of the watch: the remaining allowance of each alarm.
    budgets: Vec<Budget>,
    /// The number of states that are [`WatchState::Untold`].
    untold: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum WatchState {
    Off,
    /// ON, and the log has the line.
    Told,
    /// ON since this scan; the allowance did not permit a line.
    Untold {
        scan: u64,
    },
}

/// The lines of an ON and its OFF.
const PAIR: u32 = 2;

impl AlarmLines {
    pub fn new() -> AlarmLines {
        let (states, budgets) = (Vec::new(), Vec::new());
        let (common, withheld) = (Budget::new(LineLimit::PLANT), WithheldCount::default());
        AlarmLines { common, withheld, states, budgets, untold: 0 }
    }

    /// Whether to log the change of an alarm.
    pub fn change(&mut self, watch: u32, on: bool, scan: u64, now_ns: u64) -> bool {
        let at = watch as usize;
        if at >= self.states.len() {
            self.states.resize(at + 1, WatchState::Off);
            self.budgets.resize(at + 1, Budget::new(LineLimit::ALARM));
        }
        let (common, own) = (&mut self.common, &mut self.budgets[at]);
        let was = self.states[at];
        self.untold -= usize::from(matches!(was, WatchState::Untold { .. }));
        let (is, told) = match (was, on) {
            (_, true) if draw_pair(common, own, now_ns) => (WatchState::Told, true),
            (_, true) => (WatchState::Untold { scan }, false),
            (WatchState::Told, false) => (WatchState::Off, true),
            (WatchState::Untold { .. }, false) => {
                self.withheld.add(PAIR.into(), now_ns);
                (WatchState::Off, false)
            }
            // The ON was lost before it reached the log.
            (WatchState::Off, false) => {
                let told = self.common.draw(now_ns, 1);
                self.withheld.add(u64::from(!told), now_ns);
                (WatchState::Off, told)
            }
        };
        self.untold += usize::from(matches!(is, WatchState::Untold { .. }));
        self.states[at] = is;
        told
    }

    /// The alarms that are ON without a line and that the allowance permits now, each with the scan
    /// in which it went ON.
    pub fn belated(&mut self, now_ns: u64) -> Vec<(u32, u64)> {
        let mut belated = Vec::new();
        if self.untold == 0 {
            return belated;
        }
        for (watch, state) in self.states.iter_mut().enumerate() {
            let WatchState::Untold { scan } = *state else { continue };
            if !draw_pair(&mut self.common, &mut self.budgets[watch], now_ns) {
                continue;
            }
            *state = WatchState::Told;
            self.untold -= 1;
            belated.push((watch as u32, scan));
        }
        belated
    }

    /// The numbers of lines that were left out, if a line about them is due.
    pub fn due(&mut self, now_ns: u64) -> Option<WithheldLines> {
        self.withheld.due(now_ns)
    }

    /// The same at the end, at any time. Before this call, log each alarm that is ON without a
    /// line: [`AlarmLines::standing`] lists them.
    pub fn rest(&mut self, now_ns: u64) -> Option<WithheldLines> {
        self.withheld.rest(now_ns)
    }

    /// The alarms that are ON without a line at the end, each with the scan in which it went ON.
    /// This is the last chance to log them.
    pub fn standing(&mut self) -> Vec<(u32, u64)> {
        let mut standing = Vec::new();
        for (watch, state) in self.states.iter_mut().enumerate() {
            if let WatchState::Untold { scan } = *state {
                *state = WatchState::Told;
                standing.push((watch as u32, scan));
            }
        }
        self.untold = 0;
        standing
    }
}

/// Takes two lines from both budgets, or from neither.
fn draw_pair(common: &mut Budget, own: &mut Budget, now_ns: u64) -> bool {
    own.has(now_ns, PAIR) && common.draw(now_ns, PAIR) && own.draw(now_ns, PAIR)
}

/// Logs the number of alarm lines that the allowance withheld.
pub(super) fn tell_withheld(told: Option<WithheldLines>) {
    if let Some(WithheldLines { lines, lasted_ns }) = told {
        let (withheld, over) = ("alarm-on", duration_text(lasted_ns));
        say!(
            LINES_WITHHELD,
            withheld,
            lines,
            "alarms come too often: {lines} lines of the last {over} were left out"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: u64 = 1_000_000_000;
    const MS_NS: u64 = 1_000_000;

    #[test]
    fn an_alarm_is_logged_with_its_on_and_off_lines_or_not_at_all() {
        let mut alarms = AlarmLines::new();
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
        assert_eq!(alarms.rest(8 * SECOND_NS).map(|rest| rest.lines), Some(4000 - told));
    }

    #[test]
    fn a_chattering_alarm_does_not_hide_others_and_its_last_state_is_logged() {
        let mut alarms = AlarmLines::new();
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
        assert_eq!((alarms.states[0], alarms.untold), (WatchState::Told, 0));
    }

    #[test]
    fn an_active_alarm_is_logged_once_the_limit_permits() {
        let mut alarms = AlarmLines::new();
        let told = (0..150).filter(|watch| alarms.change(*watch, true, 9, SECOND_NS)).count();
        assert_eq!(told as u32, LineLimit::PLANT.burst / PAIR);
        assert_eq!(alarms.belated(SECOND_NS), []);
        assert_eq!(alarms.belated(SECOND_NS + 100 * MS_NS), [(100, 9)]);
        assert!(alarms.change(100, false, 20, SECOND_NS + 100 * MS_NS), "its OFF too");
        assert!(!alarms.change(149, false, 20, SECOND_NS + 100 * MS_NS));
        let standing: Vec<_> = (101..149).map(|watch| (watch, 9)).collect();
        assert_eq!(alarms.standing(), standing);
        assert_eq!(alarms.standing(), [], "told once");
        let rest = alarms.rest(2 * SECOND_NS).map(|rest| rest.lines);
        assert_eq!(rest, Some(2), "one came and went");
    }
}
