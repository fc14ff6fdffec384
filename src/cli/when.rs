//! Times on the command line: `10:02`, `yesterday 23:50`, `-15m`, `scan 81234`.
//!
//! Every command that reads a recording uses this module to parse and print its times. A
//! [`WrittenTime`] is parsed before the recording is open. [`WrittenTime::find`] then returns the
//! moment, from the reader's [`LocalClock`] and the recording's span. A moment may be outside the
//! recording: the command handles that case.

use std::ops::RangeInclusive;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use tz::TimeZone;

use crate::daemon::local_time;
use rungd_base::calendar::{self, LocalTime, Utc};
use rungd_engine::isa::duration;

const NS_PER_S: i64 = 1_000_000_000;
const NS_PER_MS: i64 = 1_000_000;
const DAY_S: i64 = 86_400;
/// The maximum number of days back in the search for a time of day in a recording.
const DAYS_BACK: i64 = 3660;

/// A time as written on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum WrittenTime {
    /// The number of a scan: `scan 81234`. The first scan of a process is 1.
    Scan(u64),
    /// Before the recording's end, ms: `-15m`.
    BeforeEnd(i32),
    /// A time of day; ns since midnight: `10:02:03.5`.
    TimeOfDay(i64),
    /// Days before the reader's present day, and a time of that day: `yesterday 23:50`.
    DaysAgo(i64, i64),
    /// Local ns since 1970-01-01 00:00:00: `2026-11-22T10:02:03`.
    Local(i64),
    /// Ns since 1970 (UTC): `2026-11-22T10:02:03Z`.
    Universal(i64),
}

/// A place in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RecordingPlace {
    /// Ns since 1970 (UTC).
    Time(i64),
    /// The number of a scan. The first scan of a process is 1.
    Scan(u64),
}

/// The reader's time zone and present time.
#[derive(Clone, Debug)]
pub(super) struct LocalClock {
    zone: TimeZone,
    now_ns: i64,
}

impl WrittenTime {
    /// Parses a time. For clap: `#[arg(value_parser = WrittenTime::parse, allow_hyphen_values =
    /// true)]`.
    ///
    /// # Errors
    /// A message with the accepted forms.
    pub fn parse(text: &str) -> Result<WrittenTime, String> {
        parse(text.trim()).ok_or_else(|| {
            format!(
                "`{text}` is not a time: write it as 10:02, 10:02:03.5, yesterday 23:50, \
                 2026-11-22T10:02:03, -15m (before the end) or scan 81234"
            )
        })
    }

    /// The moment in a recording. `span` is the recording's time, in ns since 1970 (UTC). A time of
    /// day without a date means the newest such time in the recording; if the recording does not
    /// contain it, it means the day on which the recording ends.
    pub fn find(&self, clock: &LocalClock, span: RangeInclusive<i64>) -> RecordingPlace {
        let unix_ns = match *self {
            WrittenTime::Scan(number) => return RecordingPlace::Scan(number),
            WrittenTime::BeforeEnd(ms) => span.end().saturating_sub(i64::from(ms) * NS_PER_MS),
            WrittenTime::TimeOfDay(in_day_ns) => clock.newest(in_day_ns, &span),
            WrittenTime::DaysAgo(days, in_day_ns) => clock.day(clock.now_ns, -days, in_day_ns),
            WrittenTime::Local(local_ns) => clock.unix_ns(local_ns),
            WrittenTime::Universal(unix_ns) => unix_ns,
        };
        RecordingPlace::Time(unix_ns)
    }
}

impl LocalClock {
    /// The clock of this process. Its time zone is from `TZ`, else from `/etc/localtime`.
    pub fn here() -> LocalClock {
        let tz = std::env::var("TZ").ok();
        let zone = local_time::read_zone(tz.as_deref(), Path::new("/etc/localtime"));
        let now_ns = match SystemTime::now().duration_since(UNIX_EPOCH) {
            Ok(since) => i64::try_from(since.as_nanos()).unwrap_or(i64::MAX),
            Err(_) => 0,
        };
        LocalClock { zone: zone.unwrap_or_else(|_| TimeZone::utc()), now_ns }
    }

    /// The present time, ns since 1970 (UTC).
    pub fn now_ns(&self) -> i64 {
        self.now_ns
    }

    /// A clock in a zone, stopped at a time in ns since 1970 (UTC).
    #[cfg(test)]
    pub fn at(zone: TimeZone, now_ns: i64) -> LocalClock {
        LocalClock { zone, now_ns }
    }

    /// Date and time of day in local time, to the millisecond: `2026-11-22 10:02:03.500`.
    pub fn text(&self, unix_ns: i64) -> String {
        let LocalTime { year, month, day, .. } =
            LocalTime::of(self.local_ns(unix_ns).div_euclid(NS_PER_S));
        format!("{year:04}-{month:02}-{day:02} {}", self.time_text(unix_ns))
    }

    /// The end of a span that begins at a time: with its date unless it is on the same day.
    pub fn end_text(&self, begin_ns: i64, end_ns: i64) -> String {
        let day = |unix_ns: i64| self.local_ns(unix_ns).div_euclid(NS_PER_S * DAY_S);
        if day(begin_ns) == day(end_ns) { self.time_text(end_ns) } else { self.text(end_ns) }
    }

    /// The time of day in local time, to the millisecond: `10:02:03.500`.
    pub fn time_text(&self, unix_ns: i64) -> String {
        let local_ns = self.local_ns(unix_ns);
        let in_day_s = local_ns.div_euclid(NS_PER_S).rem_euclid(DAY_S);
        let ms = local_ns.rem_euclid(NS_PER_S) / NS_PER_MS;
        format!("{}.{ms:03}", Utc::of(in_day_s.unsigned_abs()).time())
    }

    fn local_ns(&self, unix_ns: i64) -> i64 {
        unix_ns.saturating_add(self.offset_ns(unix_ns))
    }

    /// Local time minus UTC.
    fn offset_ns(&self, unix_ns: i64) -> i64 {
        i64::from(local_time::offset_s(&self.zone, unix_ns.div_euclid(NS_PER_S))) * NS_PER_S
    }

    /// The UTC time of a local time. A local time that occurs twice means the first one. If clocks
    /// skip the local time, the offset before the change applies.
    fn unix_ns(&self, local_ns: i64) -> i64 {
        let offset_of = |by_ns: i64| self.offset_ns(local_ns.saturating_add(by_ns));
        let (before, after) = (offset_of(-DAY_S * NS_PER_S), offset_of(DAY_S * NS_PER_S));
        let times = [before, after].map(|offset| local_ns.saturating_sub(offset));
        let real = times.into_iter().find(|time| self.local_ns(*time) == local_ns);
        real.unwrap_or(times[0])
    }

    /// The UTC time of a time of day, `days` days after the local day of `of_ns`.
    fn day(&self, of_ns: i64, days: i64, in_day_ns: i64) -> i64 {
        let day = self.local_ns(of_ns).div_euclid(DAY_S * NS_PER_S).saturating_add(days);
        self.unix_ns(day.saturating_mul(DAY_S * NS_PER_S).saturating_add(in_day_ns))
    }

    /// The newest time in a span at which local clocks show a time of day.
    fn newest(&self, in_day_ns: i64, span: &RangeInclusive<i64>) -> i64 {
        let on = |days_back: i64| self.day(*span.end(), -days_back, in_day_ns);
        let times = (0..DAYS_BACK).map(on);
        let found = times.take_while(|time| time >= span.start()).find(|time| span.contains(time));
        found.unwrap_or_else(|| on(0))
    }
}

/// A time in UTC with milliseconds, in ISO 8601: `2026-11-22T10:02:03.500Z`.
pub(super) fn universal(unix_ns: i64) -> String {
    let ms = unix_ns.max(0).unsigned_abs() / 1_000_000;
    let utc = Utc::of(ms / 1000);
    format!("{utc}T{}.{:03}Z", utc.time(), ms % 1000)
}

fn parse(text: &str) -> Option<WrittenTime> {
    if let Some(number) = text.strip_prefix("scan") {
        return digits(number.trim()).map(WrittenTime::Scan);
    }
    if let Some(before) = text.strip_prefix('-') {
        return duration::parse(before).ok().map(WrittenTime::BeforeEnd);
    }
    for (word, days) in [("today", 0), ("yesterday", 1)] {
        if let Some(time) = text.strip_prefix(word) {
            return Some(WrittenTime::DaysAgo(days, parse_time(time.strip_prefix(' ')?.trim())?));
        }
    }
    if let Some(in_day_ns) = parse_time(text) {
        return Some(WrittenTime::TimeOfDay(in_day_ns));
    }
    let (date, time) = text.split_once(['T', ' '])?;
    let midnight_ns =
        calendar::parse_seconds(&format!("{date}T00:00:00"))?.checked_mul(NS_PER_S)?;
    let at = |time: &str| midnight_ns.checked_add(parse_time(time)?);
    match time.strip_suffix('Z') {
        Some(time) => at(time).map(WrittenTime::Universal),
        None => at(time).map(WrittenTime::Local),
    }
}

/// The ns since midnight for `10:02`, `10:02:03` or `10:02:03.5`.
fn parse_time(text: &str) -> Option<i64> {
    let mut parts = text.split(':');
    let (hour, minute) = (two_digits(parts.next()?)?, two_digits(parts.next()?)?);
    let (second, fraction) = match parts.next().map(|part| part.split_once('.').ok_or(part)) {
        None => (0, ""),
        Some(Err(second)) => (two_digits(second)?, ""),
        Some(Ok((second, fraction))) => (two_digits(second)?, Some(fraction).filter(is_fraction)?),
    };
    if parts.next().is_some() || hour > 23 || minute > 59 || second > 59 {
        return None;
    }
    let fraction_ns: i64 = format!("{fraction:0<9}").parse().ok()?;
    Some((hour * 3600 + minute * 60 + second) * NS_PER_S + fraction_ns)
}

fn is_fraction(text: &&str) -> bool {
    (1..=9).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// Parses one or two digits: `7:30` is a time too.
fn two_digits(text: &str) -> Option<i64> {
    let fits = text.len() <= 2 && text.bytes().all(|byte| byte.is_ascii_digit());
    text.parse().ok().filter(|_| fits)
}

fn digits(text: &str) -> Option<u64> {
    text.parse().ok().filter(|_| text.bytes().all(|byte| byte.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A clock in Central Europe, which does not depend on the files of the machine.
    fn berlin(now: &str) -> LocalClock {
        let rule = "CET-1CEST,M3.5.0,M10.5.0/3";
        let zone = local_time::read_zone(Some(rule), Path::new("")).unwrap();
        let utc = LocalClock::at(TimeZone::utc(), 0);
        LocalClock::at(zone, found(now, &utc, 0..=0))
    }

    fn found(text: &str, clock: &LocalClock, span: RangeInclusive<i64>) -> i64 {
        match WrittenTime::parse(text).unwrap().find(clock, span) {
            RecordingPlace::Time(unix_ns) => unix_ns,
            RecordingPlace::Scan(number) => panic!("scan {number}"),
        }
    }

    /// The local time that a text means in a recording from one UTC time to another.
    fn meant(text: &str, [from, to]: [&str; 2]) -> String {
        let clock = berlin("2026-11-22T15:00:00Z");
        let span = found(from, &clock, 0..=0)..=found(to, &clock, 0..=0);
        clock.text(found(text, &clock, span))
    }

    #[test]
    fn a_universal_time_has_milliseconds() {
        assert_eq!(universal(1_764_461_523_042_000_000), "2025-11-30T00:12:03.042Z");
    }

    const NIGHT: [&str; 2] = ["2026-11-20T20:00:00Z", "2026-11-22T10:30:00Z"];

    #[test]
    fn a_time_of_day_means_the_latest_such_time_in_the_recording() {
        assert_eq!(meant("10:02", NIGHT), "2026-11-22 10:02:00.000");
        assert_eq!(meant("11:30", NIGHT), "2026-11-22 11:30:00.000");
        assert_eq!(meant("11:31", NIGHT), "2026-11-21 11:31:00.000");
        assert_eq!(meant("7:00:03.25", NIGHT), "2026-11-22 07:00:03.250");
        let short = ["2026-11-22T10:00:00Z", "2026-11-22T10:30:00Z"];
        assert_eq!(meant("13:00", short), "2026-11-22 13:00:00.000");
        assert_eq!(meant("09:00", short), "2026-11-22 09:00:00.000");
    }

    #[test]
    fn a_day_counts_from_today_and_a_duration_from_the_end_of_the_recording() {
        assert_eq!(meant("yesterday 23:50", NIGHT), "2026-11-21 23:50:00.000");
        assert_eq!(meant("today 08:00", NIGHT), "2026-11-22 08:00:00.000");
        assert_eq!(meant("-15m", NIGHT), "2026-11-22 11:15:00.000");
        assert_eq!(meant("-1h30s500ms", NIGHT), "2026-11-22 10:29:29.500");
    }

    #[test]
    fn a_date_is_local_unless_it_ends_in_z() {
        assert_eq!(meant("2026-11-22T10:02:03", NIGHT), "2026-11-22 10:02:03.000");
        assert_eq!(meant("2026-11-22 10:02", NIGHT), "2026-11-22 10:02:00.000");
        assert_eq!(meant("2026-11-22T10:02:03.5Z", NIGHT), "2026-11-22 11:02:03.500");
        assert_eq!(meant("2026-07-01T10:02:03Z", NIGHT), "2026-07-01 12:02:03.000");
    }

    #[test]
    fn clock_changes_of_the_time_zone_are_followed() {
        // 2026-03-29 02:30 does not exist, 2026-10-25 02:30 exists twice.
        assert_eq!(meant("2026-03-29T02:30:00", NIGHT), "2026-03-29 03:30:00.000");
        let clock = berlin("2026-11-22T15:00:00Z");
        let first = found("2026-10-25T02:30:00", &clock, 0..=0);
        assert_eq!(first, found("2026-10-25T00:30:00Z", &clock, 0..=0));
        assert_eq!(clock.text(first), "2026-10-25 02:30:00.000");
        assert_eq!(clock.text(first + 3600 * NS_PER_S), "2026-10-25 02:30:00.000");
        assert_eq!(clock.time_text(first + 7200 * NS_PER_S), "03:30:00.000");
    }

    #[test]
    fn the_end_of_a_span_shows_its_date_if_it_is_on_another_local_day() {
        let clock = berlin("2026-11-22T15:00:00Z");
        let end = |(begin, end): (&str, &str)| {
            clock.end_text(found(begin, &clock, 0..=0), found(end, &clock, 0..=0))
        };
        let on = |time: &str| format!("2026-11-22T{time}Z");
        // Midnight of the reader is 23:00 UTC.
        assert_eq!(end((&on("22:00:00"), &on("22:59:59.999"))), "23:59:59.999");
        assert_eq!(end((&on("22:59:59.999"), &on("23:00:00"))), "2026-11-23 00:00:00.000");
        assert_eq!(end((&on("23:00:00"), "2026-11-23T22:59:59Z")), "23:59:59.000");
        // The same time of a later day, and a clock that was set back.
        assert_eq!(end((&on("10:00:00"), "2026-11-24T10:00:00Z")), "2026-11-24 11:00:00.000");
        assert_eq!(end((&on("10:00:00"), "2026-11-21T10:00:00Z")), "2026-11-21 11:00:00.000");
    }

    #[test]
    fn a_scan_is_selected_by_its_number() {
        assert_eq!(WrittenTime::parse("scan 81234"), Ok(WrittenTime::Scan(81_234)));
        assert_eq!(WrittenTime::parse(" scan81234 "), Ok(WrittenTime::Scan(81_234)));
        let clock = berlin("2026-11-22T15:00:00Z");
        assert_eq!(WrittenTime::Scan(7).find(&clock, 0..=0), RecordingPlace::Scan(7));
    }

    #[test]
    fn an_invalid_time_is_refused_with_the_accepted_forms() {
        for wrong in [
            "",
            "10",
            "10:",
            "24:00",
            "10:60",
            "10:02:60",
            "10:02:03.",
            "10:02:03.1234567890",
            "10:02:03:04",
            "+1:02",
            "yesterday",
            "yesterday23:50",
            "tomorrow 10:00",
            "2026-11-31T10:02:03",
            "2026-11-22",
            "2026-11-22T",
            "-",
            "-15",
            "-15m5h",
            "scan",
            "scan -1",
            "scan +1",
            "scan 99999999999999999999999",
            "1é:02",
        ] {
            let error = WrittenTime::parse(wrong).unwrap_err();
            assert!(error.starts_with(&format!("`{wrong}` is not a time: write")), "{error}");
        }
    }

    #[test]
    fn no_number_in_a_time_causes_a_panic() {
        let clock = berlin("2026-11-22T15:00:00Z");
        for end in [i64::MIN, 0, i64::MAX] {
            for text in ["10:02", "-500h", "yesterday 00:00", "9999-12-31T23:59:59"] {
                if let Ok(when) = WrittenTime::parse(text) {
                    let _ = when.find(&clock, i64::MIN..=end);
                }
            }
            let _ = clock.text(end);
        }
    }
}
