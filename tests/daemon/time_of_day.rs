//! The time of day that a ladder reads: local time, the same as that of `date`, also when the clock
//! jumps.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use super::clocks::library;
use rungd_test_support::needs::not_installed;
use rungd_test_support::running::live::{Live, PATIENCE, folder, run};
use rungd_test_support::running::process::{BLINKS, Plant, Running};

/// A ladder that reads two of the words of the time of day.
const LADDER: &str = "[[program]]\nname = \"Main\"\nrung = [ { when = [\"$Year > 2000\"], \
                      do = [\"OUT Y0\", \"MOVE $Hour to=D0\"] } ]\n";
const CONTROLLER: &str = "scan.period = \"10ms\"\n";
const WORDS: &str = "read --json $Year $Month $Day $Weekday $Hour $Minute $Second";

/// The words in one scan, in the format of `date`.
fn words(live: &Live) -> String {
    let said = live.say(WORDS).json();
    let values = said["values"].as_array().expect("values").iter();
    let values = values.map(|value| value["value"].to_string());
    values.collect::<Vec<_>>().join(" ")
}

fn date(tz: &str, utc: bool) -> String {
    let mut command = Command::new("date");
    command.env("TZ", tz).args(utc.then_some("--utc")).arg("+%Y %-m %-d %u %-H %-M %-S");
    let said = command.output().expect("date").stdout;
    String::from_utf8(said).expect("text").trim().to_owned()
}

/// The minute of the day in an output of `date`.
fn minutes(date: &str) -> i32 {
    let words: Vec<i32> = date.split(' ').map(|word| word.parse().expect("a number")).collect();
    words[4] * 60 + words[5]
}

/// Reads the words until `date` prints the same time before and after; returns them.
fn agree(live: &Live, tz: &str) -> String {
    let deadline = Instant::now() + PATIENCE;
    loop {
        let (before, found, after) = (date(tz, false), words(live), date(tz, false));
        if before == found && found == after {
            return found;
        }
        assert!(Instant::now() < deadline, "{found} is not between {before} and {after}");
        std::thread::sleep(Duration::from_millis(70));
    }
}

fn live(tz: &str) -> Live {
    let folder = folder(LADDER, CONTROLLER);
    let mut command = run(&folder, &[]);
    command.env("TZ", tz);
    Live::of(folder, command)
}

#[test]
fn the_time_of_day_equals_the_output_of_date() {
    for tz in ["Asia/Kathmandu", ":America/St_Johns", "<+0545>-5:45", "NST3:30", ""] {
        let live = live(tz);
        let found = agree(&live, tz);
        assert_eq!(live.say("read --json Y0").json()["values"][0]["value"], true);
        let known = Path::new("/usr/share/zoneinfo/Asia/Kathmandu").exists();
        if tz == "<+0545>-5:45" || (tz == "Asia/Kathmandu" && known) {
            let ahead = (minutes(&found) - minutes(&date("", true))).rem_euclid(1440);
            // A minute may have begun between the two times.
            assert!([345, 344].contains(&ahead), "{ahead} minutes ahead of UTC");
        }
    }
}

#[test]
fn an_unknown_time_zone_is_reported_once_and_means_utc() {
    agree(&live("Nowhere/Land"), "UTC0");
    let plant = Plant::new(BLINKS, CONTROLLER);
    let mut command = plant.command(&[] as &[&str]);
    // Longer than the thread needs to read the zone twice.
    let running = Running::new(command.env("TZ", "Nowhere/Land").args(["--scans", "250"]));
    let lines = running.rest();
    let told: Vec<_> = lines.iter().filter(|line| line["event"] == "time-zone").collect();
    assert_eq!((told.len(), &told[0]["level"]), (1, &"WARN".into()), "{told:?}");
}

#[test]
fn the_time_of_day_follows_a_jump_of_the_wall_clock() {
    let folder = folder(LADDER, CONTROLLER);
    let Some(library) = library(&folder) else { return not_installed("cc") };
    let offset = folder.join("offset");
    let step = |seconds: i64| {
        let file = File::options().create(true).write(true).truncate(false).open(&offset).unwrap();
        file.write_all_at(&seconds.to_ne_bytes(), 0).unwrap();
    };
    step(0);
    let mut command = run(&folder, &[]);
    command.env("TZ", "CET-1CEST,M3.5.0,M10.5.0/3");
    command.env("LD_PRELOAD", library).env("WALL_CLOCK_OFFSET_FILE", &offset);
    let live = Live::of(folder, command);
    let to = |seconds: i64| {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap();
        step(seconds - now.as_secs() as i64);
    };
    let shows = |local: &str| {
        let deadline = Instant::now() + PATIENCE;
        while !words(&live).starts_with(local) {
            assert!(Instant::now() < deadline, "{} is not {local}", words(&live));
            std::thread::sleep(Duration::from_millis(70));
        }
    };
    // 2026-03-29 00:59:55 UTC: summer time begins in 5 s.
    to(1_774_745_995);
    shows("2026 3 29 7 1 59 5");
    shows("2026 3 29 7 3 0 ");
    // 2026-10-25 00:59:55 UTC: summer time ends in 5 s.
    to(1_792_889_995);
    shows("2026 10 25 7 2 59 5");
    shows("2026 10 25 7 2 0 ");
    to(946_684_800);
    shows("2000 1 1 6 1 0 ");
}
