//! The time of day of a simulation: a calendar that advances second by second.

/// Year, month, day, hour, minute, second.
pub type Clock = [i64; 6];

/// The default time at which a simulation begins.
pub const BEGIN: Clock = [2001, 1, 1, 0, 0, 0];

/// The time in the form of the command line.
pub fn text([year, month, day, hour, minute, second]: Clock) -> String {
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}")
}

/// The values of `$Year $Month $Day $Weekday $Hour $Minute $Second`, of `$DownSeconds`, which is 0
/// in a simulation, and of `$DayNumber $SecondOfDay`, `ms` milliseconds after `begin`.
pub fn words(begin: Clock, ms: i64) -> [i64; 10] {
    let mut clock = begin;
    for _ in 0..ms / 1000 {
        clock = next(clock);
    }
    let [year, month, day, hour, minute, second] = clock;
    let seconds = (hour * 60 + minute) * 60 + second;
    let days = day_number(year, month, day);
    [year, month, day, weekday(year, month, day), hour, minute, second, 0, days, seconds]
}

fn is_leap(year: i64) -> bool {
    year % 400 == 0 || (year % 4 == 0 && year % 100 != 0)
}

fn month_days(year: i64, month: i64) -> i64 {
    match month {
        2 if is_leap(year) => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

fn next([year, month, day, hour, minute, second]: Clock) -> Clock {
    let last_day = month_days(year, month);
    if second < 59 {
        [year, month, day, hour, minute, second + 1]
    } else if minute < 59 {
        [year, month, day, hour, minute + 1, 0]
    } else if hour < 23 {
        [year, month, day, hour + 1, 0, 0]
    } else if day < last_day {
        [year, month, day + 1, 0, 0, 0]
    } else if month < 12 {
        [year, month + 1, 1, 0, 0, 0]
    } else {
        [year + 1, 1, 1, 0, 0, 0]
    }
}

/// Days from 1970-01-01 on, year by year and month by month.
fn day_number(year: i64, month: i64, day: i64) -> i64 {
    let of_year = |year| if is_leap(year) { 366 } else { 365 };
    let before = match year {
        1970.. => (1970..year).map(of_year).sum::<i64>(),
        _ => -(year..1970).map(of_year).sum::<i64>(),
    };
    before + (1..month).map(|month| month_days(year, month)).sum::<i64>() + day - 1
}

/// The day of the week, with 1 for Monday, by Sakamoto's table.
fn weekday(year: i64, month: i64, day: i64) -> i64 {
    const TABLE: [i64; 12] = [0, 3, 2, 5, 0, 3, 5, 1, 4, 6, 2, 4];
    let year = if month < 3 { year - 1 } else { year };
    let shift = TABLE[month as usize - 1];
    match (year + year / 4 - year / 100 + year / 400 + shift + day) % 7 {
        0 => 7,
        weekday => weekday,
    }
}
