//! Follows the alarms of a recording, scan by scan: from the states of their bits to the changes
//! of the alarms.
//!
//! Used by `alarm_log` and `alarm_history`. A recording may contain several programs; an alarm is
//! the same if its name is.

use std::collections::HashMap;

use super::followed_alarm::FollowedAlarm;
use super::replay::PlayedScan;
use rungd_language::resolve::alarm_terms::AlarmTerms;
use rungd_runtime::{AlarmChange, AlarmDelay, AlarmDelays, ScanTime};

/// The alarms of the present program.
#[derive(Debug, Default)]
pub(super) struct AlarmFollower {
    place: Option<usize>,
    /// The names of the present program's alarms, in its order, and the states of their bits.
    bits: Vec<(String, bool)>,
    /// The alarms, which follow their bits after their delays.
    delays: AlarmDelays,
}

/// The alarms of a program of the recording.
#[derive(Clone, Copy)]
pub(super) struct PlacedAlarms<'a> {
    /// The index of the program among all.
    pub place: usize,
    pub alarms: &'a [FollowedAlarm],
}

impl AlarmFollower {
    /// The changes of alarms up to the end of a scan, in their order. The number of each is that of
    /// an alarm of the program.
    pub fn look(
        &mut self,
        program: PlacedAlarms<'_>,
        scan: &PlayedScan,
        is_on: impl Fn(&FollowedAlarm) -> bool,
    ) -> Vec<AlarmChange> {
        let PlacedAlarms { place, alarms } = program;
        if self.place != Some(place) {
            self.place = Some(place);
            self.begin(alarms);
        }
        let at_ns = scan.unix_ns.max(0).unsigned_abs();
        let mut changes = self.delays.due(at_ns);
        for (number, alarm) in alarms.iter().enumerate() {
            let on = is_on(alarm);
            if on != self.bits[number].1 {
                self.bits[number].1 = on;
                let time = ScanTime { scan: scan.number, at_ns };
                changes.extend(self.delays.bit(number, on, time));
            }
        }
        changes
    }

    /// Goes on with the alarms of a program.
    fn begin(&mut self, alarms: &[FollowedAlarm]) {
        let before: HashMap<&str, (usize, bool)> = (0..)
            .zip(&self.bits)
            .map(|(number, (tag, on))| (tag.as_str(), (number, *on)))
            .collect();
        let known = |alarm: &FollowedAlarm| before.get(alarm.tag.as_str()).copied();
        let next = alarms.iter().map(|alarm| {
            let AlarmTerms { delay_ms, off_delay_ms, .. } = alarm.terms;
            let number = known(alarm).map(|(number, _)| number);
            (AlarmDelay::of_ms(delay_ms, off_delay_ms), number)
        });
        let delays = self.delays.carried(next);
        let bits =
            alarms.iter().map(|alarm| (alarm.tag.clone(), known(alarm).is_some_and(|(_, on)| on)));
        let bits = bits.collect();
        (self.delays, self.bits) = (delays, bits);
    }
}
