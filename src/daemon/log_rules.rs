//! The rules of the log: which lines are written, at which level, and with which time.
//!
//! The rules have two sources. The command line, the environment and `rungd log-level` set the
//! least urgent level that is written. `[log]` of the controller file gives levels to events, and
//! chooses the time. `log` applies these rules to each line. Pure: only `log` changes them.

use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use rungd_config::controller::log::{LogSettings, LogTime};
use rungd_runtime::events::{Event, EventLevels, Level};
use rungd_runtime::wall::UtcOffset;

/// The rules of a log.
#[derive(Debug)]
pub(super) struct LogRules {
    /// The least urgent level that is written.
    pub level: Level,
    levels: EventLevels,
    time: LogTime,
    /// Local time minus UTC; until it is known, times are UTC.
    pub zone: Option<Arc<UtcOffset>>,
}

impl LogRules {
    /// The rules before a controller file is read.
    pub fn new(level: Level) -> LogRules {
        LogRules { level, levels: EventLevels::default(), time: LogTime::Utc, zone: None }
    }

    /// Takes over the settings of a controller file.
    pub fn take_over(&mut self, settings: &LogSettings) {
        (self.levels, self.time) = (settings.levels.clone(), settings.time);
    }

    /// The least urgent level in the code at which a line can still be written.
    pub fn said_from(&self) -> Level {
        self.levels.said_from(self.level)
    }

    /// The level of a line that has the level `own` in the code; `None`: it is not written.
    pub fn level_of(&self, event: Option<&Event>, own: Level) -> Option<Level> {
        let level = match event {
            Some(event) => self.levels.of_line(event, own)?,
            None => own,
        };
        (level <= self.level).then_some(level)
    }

    /// Whether events have limits: at levels debug and trace all lines are written.
    pub fn is_limited(&self) -> bool {
        self.level < Level::Debug
    }

    /// Local time minus UTC at a time, in seconds; `None` if lines show UTC.
    pub fn offset_s(&self, now: SystemTime) -> Option<i64> {
        self.local_offset_s(now).filter(|_| self.time == LogTime::Local)
    }

    /// Local time minus UTC at a time, in seconds; `None` if it is not known.
    pub fn local_offset_s(&self, now: SystemTime) -> Option<i64> {
        let zone = self.zone.as_ref()?;
        let since = now.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
        let now_s = i64::try_from(since.as_secs()).unwrap_or(i64::MAX);
        Some(zone.local_s(now_s).saturating_sub(now_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_runtime::events::{MODBUS_READ_REFUSED, STAGE_ON, TAG_ON};
    use rungd_runtime::wall::OffsetChange;

    fn rules(level: Level, given: &[(&Event, Option<Level>)], time: LogTime) -> LogRules {
        let mut settings = LogSettings { time, ..LogSettings::default() };
        given.iter().for_each(|(event, level)| settings.levels.give(event, *level));
        let mut rules = LogRules::new(level);
        rules.take_over(&settings);
        rules
    }

    #[test]
    fn the_file_sets_event_levels_and_the_operator_sets_the_threshold() {
        let given = [
            (&STAGE_ON, None),
            (&TAG_ON, Some(Level::Debug)),
            (&MODBUS_READ_REFUSED, Some(Level::Info)),
        ];
        let written = |level: Level| {
            let rules = rules(level, &given, LogTime::Utc);
            let is = |event: &Event| rules.level_of(Some(event), event.level).is_some();
            (is(&STAGE_ON), is(&TAG_ON), is(&MODBUS_READ_REFUSED))
        };
        assert_eq!(written(Level::Warn), (false, false, false));
        assert_eq!(written(Level::Info), (false, false, true));
        assert_eq!(written(Level::Debug), (false, true, true));
        assert_eq!(written(Level::Trace), (false, true, true), "off is off at every level");
        assert_eq!(rules(Level::Info, &given, LogTime::Utc).said_from(), Level::Debug);
        assert_eq!(LogRules::new(Level::Warn).level_of(None, Level::Warn), Some(Level::Warn));
    }

    #[test]
    fn local_time_is_used_once_the_zone_is_known_and_follows_summer_time() {
        let mut rules = rules(Level::Info, &[], LogTime::Local);
        let at = |seconds: u64| UNIX_EPOCH + Duration::from_secs(seconds);
        // 2026-03-29 01:00:00 UTC.
        let spring_s = 1_774_746_000;
        assert_eq!(rules.offset_s(at(spring_s)), None);
        let zone = Arc::new(UtcOffset::default());
        zone.set(3600, Some(OffsetChange { at_s: spring_s as i64, offset_s: 7200 }));
        rules.zone = Some(zone);
        assert_eq!(rules.offset_s(at(spring_s - 1)), Some(3600));
        assert_eq!(rules.offset_s(at(spring_s)), Some(7200));
        rules.time = LogTime::Utc;
        assert_eq!(rules.offset_s(at(spring_s)), None);
    }
}
