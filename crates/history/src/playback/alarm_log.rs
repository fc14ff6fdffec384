//! The alarms that came and went in a replay.
//!
//! `rungd replay` prints the list.

use std::collections::HashMap;

use super::alarm_follower::AlarmFollower;
use super::programs::PlacedProgram;
use super::replay::PlayedScan;
use rungd_engine::Image;
use rungd_language::lower::Alarm;
use rungd_runtime::AlarmChange;

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
    follower: AlarmFollower,
    /// The first scan of the replay.
    first: Option<u64>,
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
        self.first.get_or_insert(scan.number);
        let changes = self.follower.look(program, scan, image);
        let alarms = &program.program.symbols.alarms;
        changes.iter().for_each(|change| self.changed(&alarms[change.number], change));
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
