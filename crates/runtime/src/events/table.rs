//! The table of all rows, and the functions that find a row.

use super::row::Event;
use super::{controller, device, memory, plant, record, reload, world};

const TABLES: [&[(&str, Event)]; 7] = [
    controller::EVENTS,
    plant::EVENTS,
    world::EVENTS,
    memory::EVENTS,
    reload::EVENTS,
    device::EVENTS,
    record::EVENTS,
];

/// All rows, by code.
pub fn all() -> impl Iterator<Item = &'static Event> {
    TABLES.into_iter().flatten().map(|(_, event)| event)
}

/// The row with this name.
pub fn named(name: &str) -> Option<&'static Event> {
    all().find(|event| event.name == name)
}

/// The row with this code, in upper or lower case: `RUNGD-0301`.
pub fn coded(code: &str) -> Option<&'static Event> {
    let (head, digits) = code.split_at_checked("RUNGD-".len())?;
    let is_code = head.eq_ignore_ascii_case("RUNGD-")
        && digits.len() == 4
        && digits.bytes().all(|byte| byte.is_ascii_digit());
    let number = digits.parse().ok().filter(|_: &u16| is_code)?;
    all().find(|event| event.number == number)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::events::{GROUPS, Level, Silence};

    #[test]
    fn event_codes_rise_and_names_and_ids_are_unique() {
        let numbers: Vec<u16> = all().map(|event| event.number).collect();
        assert!(numbers.is_sorted_by(|a, b| a < b), "{numbers:?}");
        let count = numbers.len();
        assert_eq!(all().map(|event| event.name).collect::<HashSet<_>>().len(), count);
        assert_eq!(all().map(|event| event.id).collect::<HashSet<_>>().len(), count);
    }

    #[test]
    fn every_constant_is_named_after_its_event() {
        for (constant, event) in TABLES.into_iter().flatten() {
            assert_eq!(constant.to_ascii_lowercase().replace('_', "-"), event.name);
        }
    }

    #[test]
    fn every_event_has_an_id_a_meaning_and_a_remedy() {
        for event in all() {
            let name = event.name;
            let hex = |c: char| c.is_ascii_digit() || ('a'..='f').contains(&c);
            assert!(event.id.len() == 32 && event.id.chars().all(hex), "{name}: {}", event.id);
            for text in [event.meaning, event.remedy] {
                assert!(text.ends_with('.') && !text.contains(['\n', '@']), "{name}: {text}");
            }
            let is_in_group = GROUPS.iter().any(|(hundred, _)| *hundred == event.number / 100);
            assert!(is_in_group, "{name}: {} is in no group", event.number);
        }
    }

    #[test]
    fn errors_cannot_be_silenced_and_all_such_events_show_at_level_info() {
        for event in all() {
            let (name, is_kept) = (event.name, event.silence == Silence::Never);
            assert!(is_kept || event.level > Level::Error, "{name} is an error");
            assert!(!is_kept || event.level <= Level::Info, "{name} is a detail");
        }
    }

    #[test]
    fn an_event_is_found_by_name_and_by_code() {
        assert_eq!(named("alarm-on").map(|event| event.number), Some(301));
        assert_eq!(coded("rungd-0301").map(|event| event.name), Some("alarm-on"));
        assert!(named("alarm").is_none() && coded("RUNGD-9999").is_none());
        let wrong =
            ["", "0301", "RUNGD-301", "RUNGD-00301", "RUNGD-+301", "rungdü301", "RUNGD-030x"];
        assert!(wrong.iter().all(|code| coded(code).is_none()));
    }
}
