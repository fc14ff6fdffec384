//! The alarms that came and went in a replay.
//!
//! A recording may contain several programs; an alarm is the same if its tag is. `rungd replay`
//! prints the list.

use std::collections::HashMap;

use super::programs::PlacedProgram;
use super::replay::PlayedScan;
use rungd_engine::Image;
use rungd_language::lower::Alarm;
use rungd_language::resolve::alarm_terms::AlarmTerms;
use rungd_runtime::{AlarmChange, AlarmDelay, AlarmDelays, ScanTime};

/// The maximum number of alarm stretches that are listed.
const ALARMS_MAX: usize = 30;

/// An alarm, from the scan in which it goes ON to the scan in which it goes OFF.
#[derive(Debug)]
pub struct AlarmStretch {
    /// Its tag.
    pub tag: String,
    /// Its text.
    pub text: String,
    /// The scan that turns its bit ON.
    pub scan: u64,
    /// When it goes ON: the time of that scan, and its delay; ns since 1970 (UTC).
    pub from_ns: i64,
    /// Whether it was already ON in the first scan of the replay.
    pub before: bool,
    /// When it goes OFF: the time of its scan, and its `off-delay`; ns since 1970 (UTC).
    pub to_ns: Option<i64>,
}

/// The alarms that came and went.
#[derive(Debug, Default)]
pub struct AlarmLog {
    place: Option<usize>,
    /// The first scan of the replay.
    first: Option<u64>,
    /// The tags of the present program's alarms, in its order, and the states of their bits.
    bits: Vec<(String, bool)>,
    /// The alarms, which follow their bits after their delays.
    delays: AlarmDelays,
    /// The stretches of the alarms that are ON, by tag.
    open: HashMap<String, usize>,
    /// The stretches that are listed.
    pub stretches: Vec<AlarmStretch>,
    /// The number of stretches that are not listed.
    pub more: u64,
}

impl AlarmLog {
    /// Adds the changes of alarms at the end of a scan.
    pub fn look(&mut self, program: PlacedProgram<'_>, scan: &PlayedScan, image: &Image) {
        let PlacedProgram { place, program } = program;
        let alarms = &program.symbols.alarms;
        self.first.get_or_insert(scan.number);
        if self.place != Some(place) {
            self.place = Some(place);
            self.begin(alarms);
        }
        let at_ns = scan.unix_ns.max(0).unsigned_abs();
        let mut changes = self.delays.due(at_ns);
        for (number, alarm) in alarms.iter().enumerate() {
            let on = image.value(alarm.bit) != 0;
            if on != self.bits[number].1 {
                self.bits[number].1 = on;
                let time = ScanTime { scan: scan.number, at_ns };
                changes.extend(self.delays.bit(number, on, time));
            }
        }
        changes.iter().for_each(|change| self.changed(&alarms[change.number], change));
    }

    /// Goes on with the alarms of a program. An alarm is the same if its tag is.
    fn begin(&mut self, alarms: &[Alarm]) {
        let before: HashMap<&str, (usize, bool)> = (0..)
            .zip(&self.bits)
            .map(|(number, (tag, on))| (tag.as_str(), (number, *on)))
            .collect();
        let known = |alarm: &Alarm| before.get(alarm.tag.as_str()).copied();
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

    fn changed(&mut self, alarm: &Alarm, change: &AlarmChange) {
        let unix_ns = i64::try_from(change.at_ns).unwrap_or(i64::MAX);
        if !change.on {
            if let Some(stretch) = self.open.remove(&alarm.tag)
                && let Some(stretch) = self.stretches.get_mut(stretch)
            {
                stretch.to_ns = Some(unix_ns);
            }
            return;
        }
        // A stretch that is not listed gets an index beyond the list.
        self.open.insert(alarm.tag.clone(), self.stretches.len());
        if self.stretches.len() == ALARMS_MAX {
            self.more += 1;
            return;
        }
        self.stretches.push(AlarmStretch {
            tag: alarm.tag.clone(),
            text: alarm.text.clone(),
            scan: change.scan,
            from_ns: unix_ns,
            before: self.first == Some(change.scan),
            to_ns: None,
        });
    }
}
