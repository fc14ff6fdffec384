//! `rungd alarms --since` as a user runs it: the history of alarms of a recording, as a page and as
//! CSV.

use crate::cli::replay::{Line, Place, shown};
use rungd_history::record::Recent;

const LADDER: &str = r#"[tags]
eye  = { at = "X0", alarm = "The eye chatters", group = "Belt" }
jam  = { at = "X1", alarm = "Say \"jam\", twice", priority = "high", delay = "100ms" }
calm = { at = "X2", alarm = "Never" }
late = { at = "X3", alarm = "Late", priority = "low" }
[[program]]
name = "Main"
rung = [ { when = ["eye | jam | calm | late"], do = ["OUT Y0"] } ]
"#;

/// A minute: the eye is ON five times for a scan, with 5 s between; a jam of 3 s, and one that is
/// too short; `late` stands from the first scan to 10 s, and from 50 s to the end.
fn minute() -> Line {
    let mut line = Line::new(LADDER);
    for scan in 0..6_000 {
        let eye = scan % 500 == 20 && scan < 2_500;
        let jam = (1_000..1_300).contains(&scan) || (2_000..2_009).contains(&scan);
        let late = !(1_000..5_000).contains(&scan);
        let inputs = [("X0", eye), ("X1", jam), ("X3", late)];
        line.scan(&inputs.map(|(input, on)| (input, i32::from(on))));
    }
    line
}

/// What a command prints; it succeeds, and prints nothing else.
fn printed(place: &Place, arguments: &[&str]) -> String {
    let output = place.rungd(&[&["alarms"], arguments].concat());
    let [out, err] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert_eq!((output.status.code(), err.as_str()), (Some(0), ""), "{out}");
    out
}

fn place(test: &str) -> Place {
    let place = Place::new(&format!("history-{test}"));
    place.write("plant.rungd-log", &minute().bytes());
    place
}

#[test]
fn the_most_frequent_the_longest_and_the_chattering_alarms_are_shown() {
    let place = place("page");
    shown(
        &printed(&place, &["--since", "-24h", "--recording", "plant.rungd-log"]),
        "2026-11-22 10:00:00.000 to 10:00:59.990: 6,000 scans\n\
         most frequent\n\
         \x20      5 times  eye: The eye chatters (medium, Belt), 50ms in all\n\
         \x20      1 time   late: Late (low), 19.9s in all, stands\n\
         \x20      1 time   jam: Say \"jam\", twice (high), 2.9s in all\n\
         longest\n\
         \x20          10s  late: Late (low), from before 2026-11-22 10:00:00.000 (scan 1)\n\
         \x20         9.9s  late: Late (low), from 2026-11-22 10:00:50.000 (scan 5001), stands\n\
         \x20         2.9s  jam: Say \"jam\", twice (high), from \
         2026-11-22 10:00:10.100 (scan 1001)\n\
         \x20         10ms  eye: The eye chatters (medium, Belt), from \
         2026-11-22 10:00:00.200 (scan 21)\n\
         \x20         10ms  eye: The eye chatters (medium, Belt), from \
         2026-11-22 10:00:05.200 (scan 521)\n\
         \x20         10ms  eye: The eye chatters (medium, Belt), from \
         2026-11-22 10:00:10.200 (scan 1021)\n\
         \x20         10ms  eye: The eye chatters (medium, Belt), from \
         2026-11-22 10:00:15.200 (scan 1521)\n\
         \x20         10ms  eye: The eye chatters (medium, Belt), from \
         2026-11-22 10:00:20.200 (scan 2021)\n\
         chattering: three times or more within a minute\n\
         \x20      1 time   eye: The eye chatters (medium, Belt)\n",
    );
}

#[test]
fn each_time_of_each_alarm_is_a_line_of_csv() {
    let place = place("csv");
    let csv = printed(&place, &["--since", "-24h", "--recording", "plant.rungd-log", "--csv"]);
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 9, "{csv}");
    assert_eq!(lines[0], "alarm,text,priority,group,scan,from,to,seconds,begin,end");
    assert_eq!(
        lines[1],
        "\"late\",\"Late\",low,\"\",1,2026-11-22T10:00:00.000Z,2026-11-22T10:00:10.000Z,10.000,\
         before,gone"
    );
    assert!(lines.iter().any(|line| line.starts_with("\"jam\",\"Say \"\"jam\"\", twice\",high,")));
    assert!(lines[8].ends_with(",9.990,rose,stands"), "{csv}");
}

#[test]
fn other_programs_get_the_figures_as_json() {
    let place = place("json");
    let json = printed(&place, &["--since", "-24h", "--recording", "plant.rungd-log", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json["scans"], &json["gaps"]), (&6_000.into(), &0.into()));
    assert_eq!(json["from"], "2026-11-22T10:00:00.000Z");
    let alarms = json["alarms"].as_array().unwrap();
    let eye = alarms.iter().find(|alarm| alarm["tag"] == "eye").unwrap();
    assert_eq!(
        (&eye["rises"], &eye["chatters"], &eye["group"]),
        (&5.into(), &1.into(), &"Belt".into())
    );
    assert_eq!((&eye["seconds"], &eye["longest_seconds"]), (&0.05.into(), &0.01.into()));
    assert_eq!(alarms.len(), 3, "`calm` neither rose nor stood");
}

#[test]
fn alarms_of_one_scan_are_in_the_order_of_execution() {
    let ladder = r#"[tags]
after = { at = "C0", alarm = "The consequence" }
cause = { at = "C1", alarm = "The cause" }
[[program]]
name = "Main"
rung = [
  { when = ["X0"], do = ["OUT cause"] },
  { when = ["cause"], do = ["OUT after"] },
]
"#;
    let place = Place::new("history-order");
    let mut line = Line::new(ladder);
    for scan in 0..30 {
        line.scan(&[("X0", i32::from(scan % 10 == 5))]);
    }
    place.write("plant.rungd-log", &line.bytes());
    let csv = printed(&place, &["--since", "-24h", "--recording", "plant.rungd-log", "--csv"]);
    let tags: Vec<&str> = csv.lines().skip(1).map(|line| &line[..7]).collect();
    assert_eq!(tags, ["\"cause\"", "\"after\""].repeat(3));
}

#[test]
fn an_alarm_ends_with_a_gap_of_the_recording_and_stands_before_behind_it() {
    let place = Place::new("history-gap");
    let mut line = Line::new(LADDER);
    for scan in 0..1_000 {
        line.scan(&[("X3", i32::from(scan >= 100))]);
    }
    line.bytes();
    line.blocks.remove(5);
    let mut recent = Recent::new(1 << 26);
    line.blocks.iter().for_each(|block| recent.put(block));
    place.write("plant.rungd-log", &recent.write());
    let csv = printed(&place, &["--since", "-24h", "--recording", "plant.rungd-log", "--csv"]);
    let ends: Vec<&str> =
        csv.lines().skip(1).map(|line| line.rsplit_once("0,").unwrap().1).collect();
    assert_eq!(ends, ["rose,gap", "before,stands"], "{csv}");
}

#[test]
fn an_alarm_that_a_reload_removes_ends_with_the_reload() {
    let place = Place::new("history-removed");
    let mut line = Line::new(LADDER);
    for _ in 0..500 {
        line.scan(&[("X3", 1)]);
    }
    let without = LADDER.replace(", alarm = \"Late\", priority = \"low\"", "");
    line.reload(LADDER, &without, 1);
    for _ in 0..500 {
        line.scan(&[("X3", 1)]);
    }
    place.write("plant.rungd-log", &line.bytes());
    let csv = printed(&place, &["--since", "-24h", "--recording", "plant.rungd-log", "--csv"]);
    let spans: Vec<&str> = csv.lines().skip(1).collect();
    assert_eq!(
        spans,
        ["\"late\",\"Late\",low,\"\",1,2026-11-22T10:00:00.000Z,2026-11-22T10:00:05.000Z,5.000,\
          before,removed"]
    );
}

#[test]
fn an_alarm_with_a_delay_that_stands_when_the_window_begins_stood_before() {
    let place = Place::new("history-lead");
    let mut line = Line::new(&LADDER.replace("100ms", "3s"));
    for scan in 0..2_000 {
        line.scan(&[("X1", i32::from((200..1_500).contains(&scan)))]);
    }
    place.write("plant.rungd-log", &line.bytes());
    // The bit is ON from 2 s on, so the alarm rises at 5 s.
    for (since, rest) in [
        ("10:00:04", "201,2026-11-22T10:00:05.000Z,2026-11-22T10:00:15.000Z,10.000,rose,gone"),
        ("10:00:06", "601,2026-11-22T10:00:06.000Z,2026-11-22T10:00:15.000Z,9.000,before,gone"),
    ] {
        let since = format!("2026-11-22T{since}");
        let csv = printed(&place, &["--since", &since, "--recording", "plant.rungd-log", "--csv"]);
        let spans: Vec<&str> = csv.lines().skip(1).collect();
        assert!(spans.len() == 1 && spans[0].ends_with(rest), "{since}: {spans:?}");
    }
}

#[test]
fn a_line_of_watch_that_does_not_hold_is_in_the_history_after_its_delay() {
    let place = Place::new("history-watch");
    let keys = "[[watch]]\nname = \"dry\"\nalways = \"!eye | calm\"\ndelay = \"100ms\"\n\
                group = \"Belt\"\n[[watch]]\nname = \"rises\"\nalways = \"!rise(calm)\"\n";
    let mut line = Line::with_keys(keys, LADDER);
    for scan in 0..1_000 {
        let eye = (100..105).contains(&scan) || (200..300).contains(&scan);
        line.scan(&[("X0", i32::from(eye)), ("X2", i32::from(scan >= 900))]);
    }
    place.write("plant.rungd-log", &line.bytes());
    let csv = printed(&place, &["--since", "-24h", "--recording", "plant.rungd-log", "--csv"]);
    let of = |name: &str| -> Vec<&str> {
        csv.lines().filter(|line| line.starts_with(&format!("\"{name}\","))).collect()
    };
    assert_eq!(
        of("dry"),
        ["\"dry\",\"it does not hold: !eye | calm\",medium,\"Belt\",201,\
          2026-11-22T10:00:02.100Z,2026-11-22T10:00:03.000Z,0.900,rose,gone"]
    );
    let rises = of("rises");
    assert!(rises.len() == 1 && rises[0].contains(",0.010,rose,gone"), "{rises:?}");
}

/// A day at 10 scans a second, in which 50 alarms rise 200 times each.
fn day() -> Line {
    let of_each = |form: &dyn Fn(usize) -> String| (0..50).map(form).collect::<String>();
    let tags = of_each(&|n| format!("a{n} = {{ at = \"C{n}\", alarm = \"Alarm {n}\" }}\n"));
    let rungs = of_each(&|n| format!("  {{ when = [\"X{n}\"], do = [\"OUT C{n}\"] }},\n"));
    let program = format!("[[program]]\nname = \"Main\"\nrung = [\n{rungs}]\n");
    let mut line = Line::new(&format!("[tags]\n{tags}{program}"));
    line.period_ns = 100_000_000;
    let inputs: Vec<String> = (0..50).map(|number| format!("X{number}")).collect();
    for scan in 0..864_000 {
        let on = |number: usize| (0..50).contains(&(scan % 4_320 - 100 * (number as i32 % 20)));
        let written = |number: usize| (inputs[number].as_str(), i32::from(on(number)));
        let writes: Vec<_> = (0..50).filter(|_| scan % 50 == 0).map(written).collect();
        line.scan(&writes);
    }
    line
}

#[test]
#[ignore = "minutes: `cargo test --test commands cli::alarm_history -- --ignored --nocapture`"]
fn ten_thousand_alarms_of_a_day_are_counted() {
    let place = Place::new("history-day");
    place.write("plant.rungd-log", &day().bytes());
    let begun = std::time::Instant::now();
    let csv = printed(&place, &["--since", "-24h", "--recording", "plant.rungd-log", "--csv"]);
    println!("{} ms", begun.elapsed().as_millis());
    assert_eq!(csv.lines().count(), 1 + 10_000);
}

#[test]
fn a_part_of_the_recording_and_a_group_can_be_chosen() {
    let place = place("part");
    let part = ["--since", "10:00:20", "--until", "10:00:30", "--recording", "plant.rungd-log"];
    let said = printed(&place, &part);
    assert!(said.starts_with("2026-11-22 10:00:20.000 to 10:00:30.000: 1,001 scans\n"), "{said}");
    assert!(said.contains("1 time   eye"), "{said}");
    let group = ["--since", "-24h", "--group", "Belt", "--recording", ".", "--csv"];
    let csv = printed(&place, &group);
    assert!(csv.lines().skip(1).all(|line| line.starts_with("\"eye\",")), "{csv}");
    assert_eq!(csv.lines().count(), 6);
    let none = ["--since", "-24h", "--group", "None", "--recording", "plant.rungd-log"];
    assert!(printed(&place, &none).ends_with("no alarm rose, and none stood\n"));
}

#[test]
fn a_damaged_or_missing_recording_and_wrong_options_are_refused() {
    let place = place("wrong");
    place.write("bad.rungd-log", &[7; 5000]);
    for arguments in [
        &["--since", "-24h", "--recording", "none"][..],
        &["--since", "-24h", "--recording", "bad.rungd-log"],
        &["--since", "soon", "--recording", "plant.rungd-log"],
        &["--since", "2027-01-01T00:00:00Z", "--recording", "plant.rungd-log"],
        &["--csv"],
        &["--until", "10:00:00"],
        &["--recording", "plant.rungd-log"],
    ] {
        let output = place.rungd(&[&["alarms"], arguments].concat());
        assert_ne!(output.status.code(), Some(0), "{arguments:?}");
        assert!(!output.stderr.is_empty() && output.stdout.is_empty(), "{arguments:?}");
    }
}
