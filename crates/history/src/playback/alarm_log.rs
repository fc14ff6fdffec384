//! The alarms that came and went in a replay.
//!
//! A recording may contain several programs; an alarm is the same if its tag is. `rungd replay`
//! prints the list.

use std::collections::HashMap;

use super::programs::PlacedProgram;
use super::replay::PlayedScan;
use rungd_engine::Image;

/// The maximum number of alarm stretches that are listed.
const ALARMS_MAX: usize = 30;

/// An alarm, from the scan in which it goes ON to the scan in which it goes OFF.
#[derive(Debug)]
pub struct AlarmStretch {
    /// Its tag.
    pub tag: String,
    /// Its text.
    pub text: String,
    /// Its first scan.
    pub scan: u64,
    /// The time of that scan, ns since 1970 (UTC).
    pub from_ns: i64,
    /// Whether it was already ON in the first scan of the replay.
    pub before: bool,
    /// The time of the scan in which it goes OFF, ns since 1970 (UTC).
    pub to_ns: Option<i64>,
}

/// The alarms that came and went.
#[derive(Debug, Default)]
pub struct AlarmLog {
    place: Option<usize>,
    /// The states of the present program's alarms, in its order.
    on: Vec<bool>,
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
        let is_first = self.place.is_none();
        if self.place != Some(place) {
            self.place = Some(place);
            self.on = alarms.iter().map(|alarm| self.open.contains_key(&alarm.tag)).collect();
        }
        for (at, alarm) in alarms.iter().enumerate() {
            let on = image.value(alarm.bit) != 0;
            if on == self.on[at] {
                continue;
            }
            self.on[at] = on;
            if !on {
                if let Some(stretch) = self.open.remove(&alarm.tag)
                    && let Some(stretch) = self.stretches.get_mut(stretch)
                {
                    stretch.to_ns = Some(scan.unix_ns);
                }
                continue;
            }
            // A stretch that is not listed gets an index beyond the list.
            self.open.insert(alarm.tag.clone(), self.stretches.len());
            if self.stretches.len() == ALARMS_MAX {
                self.more += 1;
                continue;
            }
            self.stretches.push(AlarmStretch {
                tag: alarm.tag.clone(),
                text: alarm.text.clone(),
                scan: scan.number,
                from_ns: scan.unix_ns,
                before: is_first,
                to_ns: None,
            });
        }
    }
}
