//! The weekly schedule over years, compared with the calendar.

use rungd_base::calendar::LocalTime;

use super::{Bench, bench};

const BEGIN: [i32; 8] = [730, 730, 2200, 730, 0, 2100, 900, 2300];
const END: [i32; 8] = [1800, 1800, 600, 1800, 2400, 400, 900, 130];
const HOLIDAYS: [i32; 5] = [1225, 20280229, 0, 501, 20270103];
const DAY_S: i64 = 86_400;

fn week() -> Bench {
    let list = |numbers: &[i32]| {
        let list: Vec<String> = numbers.iter().map(ToString::to_string).collect();
        list.join(", ")
    };
    let array = |name: &str, numbers: &[i32]| {
        let (count, list) = (numbers.len(), list(numbers));
        format!("{name} = {{ type = \"int\", count = {count}, initial = [{list}] }}\n")
    };
    let tags = array("from", &BEGIN) + &array("until", &END) + &array("days", &HOLIDAYS);
    let uses = "{ use = \"Week\", name = \"w\", with = { begin = \"from\", end = \"until\", \
                holidays = \"days\", size = 5 } },";
    bench("week", &tags, uses)
}

/// The element of a day in the arrays.
fn element(day: LocalTime) -> usize {
    let yearly = day.month * 100 + day.day;
    if HOLIDAYS.contains(&yearly) || HOLIDAYS.contains(&(day.year * 10_000 + yearly)) {
        return 7;
    }
    usize::try_from(day.weekday - 1).expect("a day of the week")
}

fn is_on(seconds: i64) -> bool {
    let (today, before) = (LocalTime::of(seconds), LocalTime::of(seconds - DAY_S));
    let (day, night) = (element(today), element(before));
    let now = today.hour * 100 + today.minute;
    let is_night = |element: usize| END[element] < BEGIN[element];
    let today = now >= BEGIN[day] && (now < END[day] || is_night(day));
    today || (is_night(night) && now < END[night])
}

/// Four years and two leap days, each 37 minutes.
#[test]
fn the_schedule_follows_the_calendar_for_four_years() {
    let mut week = week();
    let begin = 1_798_671_600;
    let mut date = 0;
    for seconds in (begin..begin + 4 * 366 * DAY_S).step_by(37 * 60) {
        let time = LocalTime::of(seconds);
        week.plc.local = time;
        let scans = if time.day == date { 1 } else { 5 };
        date = time.day;
        for _ in 0..scans {
            week.scan();
        }
        assert_eq!(week.on("w.on"), is_on(seconds), "{time:?}");
        assert!(week.on("w.known"));
    }
}

/// A schedule without a gap stays ON while the dates of the new day are compared.
#[test]
fn a_schedule_without_a_gap_stays_on_at_midnight() {
    let mut week = week();
    for day in 0..7 {
        week.set(&format!("from[{day}]"), 0).set(&format!("until[{day}]"), 2400);
    }
    let begin = 1_805_000_000;
    for seconds in (begin..begin + 60 * DAY_S).step_by(3_600) {
        week.plc.local = LocalTime::of(seconds);
        let was = week.on("w.on");
        week.scan();
        let holiday = element(LocalTime::of(seconds)) == 7;
        assert!(holiday || !was || week.on("w.on"), "{:?}", week.plc.local);
        week.run(100);
    }
}
