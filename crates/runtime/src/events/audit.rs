//! The events of the audit trail: what people have changed, by whom, and what the trail itself
//! needs to be read: starts and ends of the process, and lines that were lost.
//!
//! The daemon's log chains their lines, and `rungd audit` prints them.

use super::Event;
use super::{controller as process, memory, plant, reload, world as operator};

/// The events of the audit trail.
const AUDITED: [&Event; 22] = [
    &process::PROCESS_START,
    &process::PROCESS_END,
    &plant::LINES_WITHHELD,
    &plant::LOG_DROPPED,
    &plant::LOG_CHAIN,
    &operator::OPERATOR_WRITE,
    &operator::OPERATOR_FORCE,
    &operator::OPERATOR_UNFORCE,
    &operator::OPERATOR_MODE,
    &operator::OPERATOR_LOG_LEVEL,
    &operator::OPERATOR_REFUSED,
    &operator::OPERATOR_ACK,
    &operator::OPERATOR_SHELVE,
    &operator::OPERATOR_UNSHELVE,
    &memory::RETAIN_SAVED,
    &reload::RELOAD_DONE,
    &reload::RELOAD_SAME,
    &reload::RELOAD_DIFFERENCE,
    &reload::RELOAD_WARNING,
    &reload::RELOAD_RESTART,
    &reload::RELOAD_REFUSED,
    &reload::ROLLED_BACK,
];

/// The events of the audit trail.
pub fn audited() -> impl Iterator<Item = &'static Event> {
    AUDITED.into_iter()
}

/// Whether a line of an event belongs to the audit trail.
pub fn is_audited(event: &Event) -> bool {
    AUDITED.iter().any(|audited| audited.number == event.number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::Silence;

    #[test]
    fn no_event_of_the_trail_can_be_switched_off() {
        for event in audited() {
            assert_eq!(event.silence, Silence::Never, "{}", event.name);
        }
    }
}
