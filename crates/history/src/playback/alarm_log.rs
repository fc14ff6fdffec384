//! The alarms that came and went in a replay.
//!
//! `rungd replay` prints the list.

use std::collections::HashMap;

use super::alarm_follower::{AlarmFollower, PlacedAlarms};
use super::followed_alarm::{FollowedAlarm, FollowedSource};
use super::programs::PlacedProgram;
use super::replay::PlayedScan;
use rungd_engine::Image;
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
    /// The alarms of the present program, and its place.
    known: Option<(usize, Vec<FollowedAlarm>)>,
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
        let PlacedProgram { place, program } = program;
        let known = self.known.take().filter(|(known, _)| *known == place);
        let (_, alarms) =
            known.unwrap_or_else(|| (place, FollowedAlarm::of_bits(&program.symbols)));
        let is_on = |alarm: &FollowedAlarm| match alarm.source {
            FollowedSource::Bit(bit) => image.value(bit) != 0,
            FollowedSource::Line(_) => false,
        };
        let changes = self.follower.look(PlacedAlarms { place, alarms: &alarms }, scan, is_on);
        changes.iter().for_each(|change| self.changed(&alarms[change.number], change));
        self.known = Some((place, alarms));
    }

    fn changed(&mut self, alarm: &FollowedAlarm, change: &AlarmChange) {
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
