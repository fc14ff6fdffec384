//! The levels that a controller file gives to events (`[log.events]`).
//!
//! Made by `controller::log`; `daemon::log` looks up the level of each line. Pure: this module does
//! not depend on the levels that are written now, and accepts every level for every event.

use std::collections::BTreeMap;

use super::row::{Event, Level};

/// The levels given to events, by number of the event.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EventLevels(BTreeMap<u16, GivenLevel>);

/// The level given to one event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct GivenLevel {
    /// `None`: the lines of this event are left out.
    given: Option<Level>,
    /// The level in the event's row.
    row: Level,
}

impl EventLevels {
    /// Gives a level to an event; `None`: the event's lines are left out.
    pub fn give(&mut self, event: &Event, given: Option<Level>) {
        self.0.insert(event.number, GivenLevel { given, row: event.level });
    }

    /// The level of an event: the given one, or its row's; `None`: the event's lines are left out.
    pub fn level(&self, event: &Event) -> Option<Level> {
        self.0.get(&event.number).map_or(Some(event.level), |found| found.given)
    }

    /// The level of a line that has the level `own` in the code; `None`: the line is left out. If
    /// the line is less urgent than its row (a detail), it does not become more urgent than it is
    /// in the code. If it is more urgent than its row, it does not become less urgent.
    pub fn of_line(&self, event: &Event, own: Level) -> Option<Level> {
        let Some(found) = self.0.get(&event.number) else { return Some(own) };
        let given = found.given?;
        Some(match own.cmp(&found.row) {
            std::cmp::Ordering::Equal => given,
            std::cmp::Ordering::Greater => given.max(own),
            std::cmp::Ordering::Less => given.min(own),
        })
    }

    /// The least urgent level in the code at which a line is written, if the log shows lines from
    /// `level` on.
    pub fn said_from(&self, level: Level) -> Level {
        let raised = self.0.values().filter(|found| found.given.is_some_and(|to| to <= level));
        raised.map(|found| found.row).fold(level, Level::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::{BLOCK_STARTED, MODBUS_READ_REFUSED, MODE_STOP, STAGE_ON};

    fn levels(event: &Event, given: Option<Level>) -> EventLevels {
        let mut levels = EventLevels::default();
        levels.give(event, given);
        levels
    }

    #[test]
    fn an_event_without_a_configured_level_keeps_the_level_of_its_line() {
        let none = EventLevels::default();
        assert_eq!(none.of_line(&STAGE_ON, Level::Debug), Some(Level::Debug));
        assert_eq!(
            (none.level(&STAGE_ON), none.said_from(Level::Warn)),
            (Some(Level::Info), Level::Warn)
        );
    }

    #[test]
    fn a_configured_level_replaces_the_level_of_the_row() {
        let off = levels(&STAGE_ON, None);
        assert_eq!((off.level(&STAGE_ON), off.of_line(&STAGE_ON, Level::Info)), (None, None));
        let debug = levels(&STAGE_ON, Some(Level::Debug));
        assert_eq!(debug.of_line(&STAGE_ON, Level::Info), Some(Level::Debug));
        assert_eq!(debug.of_line(&BLOCK_STARTED, Level::Info), Some(Level::Info));
    }

    #[test]
    fn a_configured_level_applies_to_details_and_never_lowers_louder_lines() {
        let warn = levels(&BLOCK_STARTED, Some(Level::Warn));
        assert_eq!(warn.of_line(&BLOCK_STARTED, Level::Info), Some(Level::Warn));
        assert_eq!(warn.of_line(&BLOCK_STARTED, Level::Debug), Some(Level::Debug));
        let trace = levels(&BLOCK_STARTED, Some(Level::Trace));
        assert_eq!(trace.of_line(&BLOCK_STARTED, Level::Debug), Some(Level::Trace));
        let info = levels(&MODE_STOP, Some(Level::Info));
        assert_eq!(info.of_line(&MODE_STOP, Level::Warn), Some(Level::Warn));
        let error = levels(&MODE_STOP, Some(Level::Error));
        assert_eq!(error.of_line(&MODE_STOP, Level::Warn), Some(Level::Error));
    }

    #[test]
    fn raising_the_level_of_a_detail_enables_its_debug_lines() {
        let raised = levels(&MODBUS_READ_REFUSED, Some(Level::Warn));
        assert_eq!(raised.said_from(Level::Info), Level::Debug);
        assert_eq!(raised.said_from(Level::Error), Level::Error);
        assert_eq!(raised.said_from(Level::Trace), Level::Trace);
    }
}
