//! The names of the files of segments, made of the controller and the start time of the file:
//! `bottling-20261122T210500Z-123456.rungd-log`.
//!
//! `store` recognizes its own files by their names, and touches no other files.

use rungd_base::calendar::{Utc, parse_seconds};

/// The extension of the files of segments.
pub const EXTENSION: &str = "rungd-log";

const US_NS: i64 = 1000;

/// The name of a file with this start time, ns since 1970 (UTC).
pub(super) fn file_name(controller: &str, unix_ns: i64) -> String {
    let unix_us = unix_ns.max(0) / US_NS;
    let utc = Utc::of((unix_us / 1_000_000) as u64);
    let (date, time) = (utc.to_string().replace('-', ""), utc.time().replace(':', ""));
    format!("{controller}-{date}T{time}Z-{:06}.{EXTENSION}", unix_us % 1_000_000)
}

/// The start time of a file of this controller, ns since 1970 (UTC); `None`: it is not a file of
/// this controller.
pub(super) fn begun_ns(controller: &str, name: &str) -> Option<i64> {
    let rest = name.strip_prefix(controller)?.strip_prefix('-')?;
    let rest = rest.strip_suffix(EXTENSION)?.strip_suffix('.')?;
    let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let (date, rest) = rest.split_once('T')?;
    let (time, us) = rest.split_once("Z-")?;
    let lengths = [date.len(), time.len(), us.len()];
    if lengths != [8, 6, 6] || ![date, time, us].into_iter().all(is_digits) {
        return None;
    }
    let (year, month, day) = (&date[..4], &date[4..6], &date[6..]);
    let (hour, minute, second) = (&time[..2], &time[2..4], &time[4..]);
    let seconds = parse_seconds(&format!("{year}-{month}-{day}T{hour}:{minute}:{second}"))?;
    let us: i64 = us.parse().ok()?;
    seconds.checked_mul(1_000_000)?.checked_add(us)?.checked_mul(US_NS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_name_contains_the_controller_and_the_start_time() {
        let begun = 1_795_381_500_123_456_000;
        let name = file_name("bottling", begun);
        assert_eq!(name, "bottling-20261122T210500Z-123456.rungd-log");
        assert_eq!(begun_ns("bottling", &name), Some(begun));
        for (controller, name) in [
            ("bott", &name[..]),
            ("bottling", "bottling-2-20261122T210500Z-123456.rungd-log"),
            ("bottling", "bottling-20261122T210500Z-123456.rungd-log.old"),
            ("bottling", "bottling-20261322T210500Z-123456.rungd-log"),
            ("bottling", "bottling-2026112²T21050Z-123456.rungd-log"),
            ("bottling", "bottling-20261122T210500Z-12345.rungd-log"),
            ("bottling", "bottling.rungd-log"),
            ("", &name[..]),
        ] {
            assert_eq!(begun_ns(controller, name), None, "{controller} {name}");
        }
        assert_eq!(file_name("a", -5), "a-19700101T000000Z-000000.rungd-log");
    }
}
