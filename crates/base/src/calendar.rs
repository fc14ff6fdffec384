//! The calendar: converts seconds since 1970 to a date and a time of day.
//!
//! The log and `rungd retain show` use it to write times in UTC; ladders use it to read local time.
//! Time zones are absent: `runtime::wall` counts local seconds.

use std::fmt;

const DAY_S: i64 = 86_400;

/// A date and a time of day in UTC. Its text is `2026-11-21`; [`Utc::time`] gives `12:26:21`.
#[derive(Clone, Copy, Debug)]
pub struct Utc {
    seconds: u64,
}

impl Utc {
    /// The time from the seconds since 1970-01-01 00:00:00.
    pub fn of(seconds: u64) -> Utc {
        Utc { seconds }
    }

    /// The time of day: `12:26:21`.
    pub fn time(self) -> String {
        let (hour, minute) = (self.seconds / 3600 % 24, self.seconds / 60 % 60);
        format!("{hour:02}:{minute:02}:{:02}", self.seconds % 60)
    }
}

/// The date: `2026-11-21`.
impl fmt::Display for Utc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (year, month, day) = date((self.seconds / DAY_S as u64) as i64);
        write!(f, "{year:04}-{month:02}-{day:02}")
    }
}

/// A local date and time of day, in the form of the status words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct LocalTime {
    pub year: i32,
    /// 1 to 12.
    pub month: i32,
    /// 1 to 31.
    pub day: i32,
    /// 1 is Monday, 7 is Sunday.
    pub weekday: i32,
    pub hour: i32,
    pub minute: i32,
    pub second: i32,
    /// Days since 1970-01-01.
    pub day_number: i32,
    /// Seconds since midnight.
    pub second_of_day: i32,
}

impl LocalTime {
    /// The default start of a simulation: Monday, 2001-01-01 at 00:00:00, as seconds since 1970.
    pub const SIMULATED_S: i64 = 978_307_200;

    /// The time from the local seconds since 1970-01-01 00:00:00 of the local clock.
    pub fn of(seconds: i64) -> LocalTime {
        let (days, in_day) = (seconds.div_euclid(DAY_S), seconds.rem_euclid(DAY_S) as i32);
        let (year, month, day) = date(days);
        LocalTime {
            year: i32::try_from(year).unwrap_or(if year < 0 { i32::MIN } else { i32::MAX }),
            month: month as i32,
            day: day as i32,
            // 1970-01-01 was a Thursday.
            weekday: ((days + 3).rem_euclid(7) + 1) as i32,
            hour: in_day / 3600,
            minute: in_day / 60 % 60,
            second: in_day % 60,
            day_number: i32::try_from(days).unwrap_or(if days < 0 { i32::MIN } else { i32::MAX }),
            second_of_day: in_day,
        }
    }
}

/// The default start of a simulation.
impl Default for LocalTime {
    fn default() -> LocalTime {
        LocalTime::of(LocalTime::SIMULATED_S)
    }
}

/// Converts the days since 1970-01-01 to year, month and day.
fn date(days: i64) -> (i64, i64, i64) {
    // Days since 1 March of the year 0, in eras of 400 years. So a leap day is the last day of its
    // year.
    let days = days + 719_468;
    let (era, in_era) = (days.div_euclid(146_097), days.rem_euclid(146_097));
    let year = (in_era - in_era / 1460 + in_era / 36_524 - in_era / 146_096) / 365;
    let in_year = in_era - (365 * year + year / 4 - year / 100);
    let march = (5 * in_year + 2) / 153;
    let day = in_year - (153 * march + 2) / 5 + 1;
    let month = if march < 10 { march + 3 } else { march - 9 };
    (era * 400 + year + i64::from(month <= 2), month, day)
}

/// Converts `2026-11-22T06:00:00` to seconds since 1970. `None` for any other form, and for a day
/// that does not exist in the calendar. Years are 1 to 9999.
pub fn parse_seconds(text: &str) -> Option<i64> {
    let shape = "dddd-dd-ddTdd:dd:dd";
    let fits =
        |(byte, form): (u8, u8)| if form == b'd' { byte.is_ascii_digit() } else { byte == form };
    if text.len() != shape.len() || !text.bytes().zip(shape.bytes()).all(fits) {
        return None;
    }
    let number = |from: usize, to: usize| text[from..to].parse::<i64>().ok();
    let (year, month, day) = (number(0, 4)?, number(5, 7)?, number(8, 10)?);
    let (hour, minute, second) = (number(11, 13)?, number(14, 16)?, number(17, 19)?);
    if year == 0 || hour > 23 || minute > 59 || second > 59 {
        return None;
    }
    let days = days(year, month, day);
    let is_a_day = (1..=12).contains(&month) && date(days) == (year, month, day);
    is_a_day.then_some(days * DAY_S + hour * 3600 + minute * 60 + second)
}

/// Converts a date to days since 1970-01-01: the inverse of `date`.
fn days(year: i64, month: i64, day: i64) -> i64 {
    let year = year - i64::from(month <= 2);
    let in_era = year.rem_euclid(400);
    let march = (month + 9) % 12;
    let in_year = (153 * march + 2) / 5 + day - 1;
    year.div_euclid(400) * 146_097 + in_era * 365 + in_era / 4 - in_era / 100 + in_year - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(seconds: i64) -> String {
        let LocalTime { year, month, day, weekday, hour, minute, second, .. } =
            LocalTime::of(seconds);
        format!("{year}-{month}-{day} ({weekday}) {hour}:{minute}:{second}")
    }

    #[test]
    fn known_timestamps_give_their_calendar_dates() {
        // Values from `date --utc --date=@N '+%Y-%-m-%-d (%u) %-H:%-M:%-S'`.
        assert_eq!(shown(0), "1970-1-1 (4) 0:0:0");
        assert_eq!(shown(-1), "1969-12-31 (3) 23:59:59");
        assert_eq!(shown(951_782_399), "2000-2-28 (1) 23:59:59");
        assert_eq!(shown(951_782_400), "2000-2-29 (2) 0:0:0");
        assert_eq!(shown(978_307_200), "2001-1-1 (1) 0:0:0");
        assert_eq!(shown(4_107_542_399), "2100-2-28 (7) 23:59:59");
        assert_eq!(shown(4_107_542_400), "2100-3-1 (1) 0:0:0");
        assert_eq!(LocalTime::of(i64::MAX).year, i32::MAX);
        assert_eq!(LocalTime::of(i64::MIN).year, i32::MIN);
        let numbered = |seconds| {
            let LocalTime { day_number, second_of_day, .. } = LocalTime::of(seconds);
            (day_number, second_of_day)
        };
        assert_eq!(numbered(-1), (-1, 86_399));
        assert_eq!(numbered(978_307_200), (11_323, 0));
        assert_eq!(numbered(i64::MAX).0, i32::MAX);
        assert_eq!(numbered(i64::MIN).0, i32::MIN);
    }

    /// Every day of 400 years and one on each side of 1970, counted by hand.
    #[test]
    fn every_day_follows_the_day_before() {
        let (mut year, mut month, mut day) = (1600, 1, 1);
        for days_since in days(1600, 1, 1)..days(2402, 1, 1) {
            assert_eq!(date(days_since), (year, month, day));
            assert_eq!(days(year, month, day), days_since);
            let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
            let last = match month {
                2 => 28 + i64::from(leap),
                4 | 6 | 9 | 11 => 30,
                _ => 31,
            };
            (month, day) = if day < last { (month, day + 1) } else { (month + 1, 1) };
            (year, month) = if month > 12 { (year + 1, 1) } else { (year, month) };
        }
    }

    #[test]
    fn only_a_complete_valid_time_is_parsed() {
        assert_eq!(parse_seconds("2001-01-01T00:00:00"), Some(LocalTime::SIMULATED_S));
        assert_eq!(parse_seconds("1969-12-31T23:59:59"), Some(-1));
        assert_eq!(parse_seconds("2024-02-29T06:00:00"), Some(1_709_186_400));
        for wrong in [
            "",
            "2026-11-22",
            "2026-11-22 06:00:00",
            "2026-11-22T06:00",
            "2026-11-22T06:00:00Z",
            "2026-11-22T24:00:00",
            "2026-11-22T06:60:00",
            "2026-11-22T06:00:60",
            "2023-02-29T06:00:00",
            "2026-13-01T06:00:00",
            "2026-00-01T06:00:00",
            "2026-11-00T06:00:00",
            "0000-01-01T00:00:00",
            "+026-11-22T06:00:00",
            "2026-11-22T06:00:0é",
        ] {
            assert_eq!(parse_seconds(wrong), None, "{wrong}");
        }
    }
}
