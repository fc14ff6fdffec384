//! The calendar: seconds since 1970 as a date and a time of day, in UTC.
//!
//! The log and `rungd retain show` write times by it. Local time and time zones are absent.

use std::fmt;

/// A date and a time of day in UTC. Shown as `2026-11-21` and, by [`Utc::time`], `12:26:21`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Utc {
    seconds: u64,
}

impl Utc {
    /// Of the seconds since 1970-01-01 00:00:00.
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
        // Days since 1 March of the year 0, in eras of 400 years: the leap day is a year's last.
        let days = self.seconds / 86_400 + 719_468;
        let (era, in_era) = (days / 146_097, days % 146_097);
        let year = (in_era - in_era / 1460 + in_era / 36_524 - in_era / 146_096) / 365;
        let in_year = in_era - (365 * year + year / 4 - year / 100);
        let march = (5 * in_year + 2) / 153;
        let day = in_year - (153 * march + 2) / 5 + 1;
        let month = if march < 10 { march + 3 } else { march - 9 };
        let year = era * 400 + year + u64::from(month <= 2);
        write!(f, "{year:04}-{month:02}-{day:02}")
    }
}
