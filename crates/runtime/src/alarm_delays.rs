//! Delays of alarms: from the changes of alarms' bits to the changes of the alarms.
//!
//! Called by the log's observer, which gets the changes of bits from the scan thread, and by the
//! replay of a recording. The scan thread does nothing of this. Only the times of scans count: an
//! alarm with a delay rises if its bit has been ON for the delay, from the time of the scan that
//! turned it ON to that of the scan that turns it OFF. So a result depends on nothing but the
//! changes, whenever somebody looks.

use std::collections::BTreeSet;

/// The delays of an alarm; without delays it follows its bit at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AlarmDelay {
    /// How long the bit is ON before the alarm rises.
    pub on_ns: u64,
    /// How long the bit is OFF before the alarm goes away.
    pub off_ns: u64,
}

impl AlarmDelay {
    /// Delays in ms.
    pub fn of_ms(on_ms: u32, off_ms: u32) -> AlarmDelay {
        let [on_ns, off_ns] = [on_ms, off_ms].map(|ms| u64::from(ms) * 1_000_000);
        AlarmDelay { on_ns, off_ns }
    }
}

/// A scan, and its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanTime {
    /// Its number.
    pub scan: u64,
    /// ns of one clock: CLOCK_MONOTONIC, or that of a recording.
    pub at_ns: u64,
}

/// A change of an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AlarmChange {
    /// The number of the alarm.
    pub number: usize,
    /// Whether it goes ON.
    pub on: bool,
    /// The scan that changes the bit.
    pub scan: u64,
    /// The time of that scan; for an alarm with a delay, plus the delay.
    pub at_ns: u64,
    /// How long it had the state before.
    pub lasted_ns: u64,
}

/// An alarm, and its bit.
#[derive(Clone, Copy, Debug, Default)]
struct DelayedAlarm {
    delay: AlarmDelay,
    /// The state of the bit, and the scan that changed it last.
    bit: bool,
    bit_scan: u64,
    bit_ns: u64,
    /// The state of the alarm, and since when it has it.
    alarm: bool,
    alarm_ns: u64,
}

impl DelayedAlarm {
    /// When the alarm follows its bit; `None` if both have the same state.
    fn due_ns(&self) -> Option<u64> {
        let delay_ns = if self.bit { self.delay.on_ns } else { self.delay.off_ns };
        (self.bit != self.alarm).then(|| self.bit_ns.saturating_add(delay_ns))
    }

    fn follow(&mut self, number: usize, at_ns: u64) -> AlarmChange {
        let lasted_ns = at_ns.saturating_sub(self.alarm_ns);
        (self.alarm, self.alarm_ns) = (self.bit, at_ns);
        AlarmChange { number, on: self.bit, scan: self.bit_scan, at_ns, lasted_ns }
    }
}

/// The alarms of a program, by number.
#[derive(Clone, Debug, Default)]
pub struct AlarmDelays {
    alarms: Vec<DelayedAlarm>,
    /// The alarms that do not follow their bits yet: when they will, in order.
    waiting: BTreeSet<(u64, usize)>,
}

impl AlarmDelays {
    /// Alarms whose bits are OFF.
    pub fn new(delays: impl IntoIterator<Item = AlarmDelay>) -> AlarmDelays {
        let alarm = |delay| DelayedAlarm { delay, ..DelayedAlarm::default() };
        AlarmDelays { alarms: delays.into_iter().map(alarm).collect(), waiting: BTreeSet::new() }
    }

    /// The alarms of a next program. `before`: the number that each had in this one, if it was in
    /// it. An alarm that waits goes on to wait, with its new delay.
    pub fn carried(
        &self,
        next: impl IntoIterator<Item = (AlarmDelay, Option<usize>)>,
    ) -> AlarmDelays {
        let alarm = |(delay, before): (AlarmDelay, Option<usize>)| {
            let before = before.and_then(|number| self.alarms.get(number)).copied();
            DelayedAlarm { delay, ..before.unwrap_or_default() }
        };
        let alarms: Vec<DelayedAlarm> = next.into_iter().map(alarm).collect();
        let due = alarms.iter().enumerate().map(|(number, alarm)| (alarm.due_ns(), number));
        let waiting = due.filter_map(|(due_ns, number)| Some((due_ns?, number))).collect();
        AlarmDelays { alarms, waiting }
    }

    /// Whether the alarm has a delay.
    pub fn is_delayed(&self, number: usize) -> bool {
        self.alarms.get(number).is_some_and(|alarm| alarm.delay != AlarmDelay::default())
    }

    /// Takes a change of a bit; returns the changes of alarms up to its time, in their order.
    pub fn bit(&mut self, number: usize, on: bool, time: ScanTime) -> Vec<AlarmChange> {
        let ScanTime { scan, at_ns } = time;
        let mut changes = self.due(at_ns);
        let Some(alarm) = self.alarms.get_mut(number).filter(|alarm| alarm.bit != on) else {
            return changes;
        };
        if let Some(due_ns) = alarm.due_ns() {
            self.waiting.remove(&(due_ns, number));
        }
        (alarm.bit, alarm.bit_scan, alarm.bit_ns) = (on, scan, at_ns);
        match alarm.due_ns() {
            Some(due_ns) if due_ns <= at_ns => changes.push(alarm.follow(number, at_ns)),
            Some(due_ns) => {
                self.waiting.insert((due_ns, number));
            }
            None => {}
        }
        changes
    }

    /// The changes of alarms up to the time of a scan, in the order of their times; those of one
    /// time in the order of their numbers.
    pub fn due(&mut self, now_ns: u64) -> Vec<AlarmChange> {
        let mut changes = Vec::new();
        while let Some((due_ns, number)) = self.waiting.first().copied() {
            if due_ns > now_ns {
                break;
            }
            self.waiting.pop_first();
            changes.push(self.alarms[number].follow(number, due_ns));
        }
        changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(scan: u64, at_ns: u64) -> ScanTime {
        ScanTime { scan, at_ns }
    }

    /// Changes as text: `0+5` is alarm 0, ON at 5.
    fn text(changes: &[AlarmChange]) -> String {
        let one = |change: &AlarmChange| {
            format!("{}{}{}", change.number, if change.on { '+' } else { '-' }, change.at_ns)
        };
        changes.iter().map(one).collect::<Vec<_>>().join(" ")
    }

    fn delays(all: &[(u64, u64)]) -> AlarmDelays {
        AlarmDelays::new(
            all.iter().map(|(on_ns, off_ns)| AlarmDelay { on_ns: *on_ns, off_ns: *off_ns }),
        )
    }

    #[test]
    fn an_alarm_without_a_delay_follows_its_bit_at_once() {
        let mut alarms = delays(&[(0, 0)]);
        assert_eq!(text(&alarms.bit(0, true, at(1, 10))), "0+10");
        assert_eq!(text(&alarms.bit(0, true, at(2, 11))), "");
        let gone = alarms.bit(0, false, at(3, 25));
        assert_eq!((text(&gone).as_str(), gone[0].lasted_ns), ("0-25", 15));
        assert!(!alarms.is_delayed(0) && !alarms.is_delayed(9));
    }

    #[test]
    fn an_alarm_rises_once_its_bit_has_been_on_for_the_delay() {
        let mut alarms = delays(&[(20, 0)]);
        assert_eq!(text(&alarms.bit(0, true, at(7, 100))), "");
        assert_eq!(text(&alarms.bit(0, false, at(8, 119))), "", "too short");
        assert_eq!(text(&alarms.due(500)), "");
        alarms.bit(0, true, at(9, 600));
        assert_eq!(text(&alarms.due(619)), "");
        let risen = alarms.due(640);
        assert_eq!((text(&risen).as_str(), risen[0].scan), ("0+620", 9), "its time, not ours");
        assert_eq!(text(&alarms.bit(0, false, at(10, 650))), "0-650");
    }

    #[test]
    fn a_bit_that_was_on_for_the_delay_is_an_alarm_although_nobody_looked_meanwhile() {
        let mut alarms = delays(&[(20, 0)]);
        alarms.bit(0, true, at(1, 100));
        assert_eq!(text(&alarms.bit(0, false, at(2, 120))), "0+120 0-120");
    }

    #[test]
    fn a_bit_that_comes_back_within_the_off_delay_is_the_same_alarm() {
        let mut alarms = delays(&[(0, 30)]);
        assert_eq!(text(&alarms.bit(0, true, at(1, 10))), "0+10");
        for (on, at_ns) in [(false, 20), (true, 40), (false, 60), (true, 89)] {
            assert_eq!(text(&alarms.bit(0, on, at(2, at_ns))), "");
        }
        assert_eq!(text(&alarms.bit(0, false, at(3, 100))), "");
        let gone = alarms.due(200);
        assert_eq!((text(&gone).as_str(), gone[0].lasted_ns), ("0-130", 120));
    }

    #[test]
    fn alarms_that_become_due_are_told_in_the_order_of_their_times_then_of_execution() {
        let mut alarms = delays(&[(50, 0), (20, 0), (50, 0), (0, 0)]);
        for number in [2, 0, 1] {
            alarms.bit(number, true, at(1, 100));
        }
        assert_eq!(text(&alarms.bit(3, true, at(2, 300))), "1+120 0+150 2+150 3+300");
    }

    #[test]
    fn a_waiting_alarm_waits_on_over_a_reload_with_its_new_delay() {
        let mut alarms = delays(&[(50, 0), (50, 0)]);
        alarms.bit(0, true, at(1, 100));
        alarms.bit(1, true, at(1, 100));
        let delay = |on_ns| AlarmDelay { on_ns, off_ns: 0 };
        let next = [(delay(10), None), (delay(80), Some(0)), (delay(5), Some(7))];
        let mut next = alarms.carried(next);
        assert_eq!(text(&next.due(1000)), "1+180");
    }

    #[test]
    fn a_thousand_alarms_of_one_scan_and_ten_thousand_of_a_day_are_in_order_and_forgotten() {
        let mut alarms = AlarmDelays::new((0..1000).map(|_| AlarmDelay::of_ms(2, 1)));
        for day in 0..10_u64 {
            let at_ns = day * 1_000_000_000;
            for number in (0..1000).rev() {
                assert!(alarms.bit(number, true, at(day, at_ns)).is_empty());
            }
            let risen = alarms.due(at_ns + 2_000_000);
            assert!(risen.iter().map(|change| change.number).eq(0..1000));
            for number in 0..1000 {
                alarms.bit(number, false, at(day, at_ns + 3_000_000));
            }
            assert_eq!(alarms.waiting.len(), 1000);
            assert_eq!(alarms.due(at_ns + 4_000_000).len(), 1000);
        }
        assert!(alarms.waiting.is_empty());
    }
}
