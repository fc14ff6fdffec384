//! `rungd record info` and `export` as a user runs them. Also every command for recordings on
//! recordings that no rungd has written, with right checksums.

use std::process::Output;

use crate::cli::replay::{Place, conveyor, shown};
use rungd_history::record::{BlockHead, Recent};
use serde_json::Value;

#[track_caller]
fn said(output: &Output, code: i32) -> String {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "{out}{err}");
    out
}

#[test]
fn info_describes_a_recording() {
    let place = Place::new("info");
    shown(
        &said(&place.rungd(&["record", "info", "plant.rungd-log"]), 0),
        "controller  plant.toml\nprogram      (start, rungd …): plant.toml main.toml\nrecorded    \
         2026-11-22 10:00:00.000 to 2026-11-22 10:00:19.990\nscans       2,000, from 1 to 2000; \
         one every 10.000 ms (median)\nstored as   … sections with … base images\nsize        … \
         bytes; … MB a day at this rate\nbegins      with the start of RUN: every hash can be \
         computed from there\nchanges     2026-11-22 10:00:00.000 RUN\ngaps        none\n",
    );
    let json = said(&place.rungd(&["record", "info", "plant.rungd-log", "--json"]), 0);
    let json: Value = serde_json::from_str(&json).unwrap();
    let bytes = std::fs::metadata(place.0.join("plant.rungd-log")).unwrap().len();
    assert_eq!((json["scans"].as_u64(), json["bytes"].as_u64()), (Some(2_000), Some(bytes)));
    assert_eq!((&json["begins_run"], &json["period_ns"]), (&true.into(), &10_000_000.into()));
}

/// A span of days would look like one of seconds.
#[test]
fn a_span_that_ends_on_another_day_shows_the_date_of_its_end() {
    let place = Place::new("days");
    let list = || said(&place.rungd(&["record", "list", "plant.rungd-log"]), 0);
    shown(&list(), "2026-11-22 10:00:00.000 to 10:00:19.990  scans 1 to 2000  plant.toml  (start)");
    let mut line = conveyor();
    line.bytes();
    let two_days_ns = 2 * 86_400 * 1_000_000_000;
    line.blocks.last_mut().unwrap().head.end_ns += two_days_ns;
    place.write("plant.rungd-log", &line.bytes());
    shown(
        &list(),
        "2026-11-22 10:00:00.000 to 2026-11-24 10:00:19.990  scans 1 to 2000  plant.toml  \
         (start)",
    );
    let info = said(&place.rungd(&["record", "info", "plant.rungd-log"]), 0);
    assert!(info.contains(" to 2026-11-24 10:00:19.990"), "{info}");
}

#[test]
fn info_shows_gaps_and_the_start_of_a_partial_recording() {
    let place = Place::new("info_gap");
    let mut line = conveyor();
    line.bytes();
    line.blocks.drain(4..6);
    line.blocks.remove(0);
    place.write("plant.rungd-log", &line.bytes());
    let text = said(&place.rungd(&["record", "info", "plant.rungd-log"]), 0);
    assert!(text.contains("begins      within RUN or STOP: with a recorded image"), "{text}");
    shown(
        text.lines().last().unwrap(),
        "gaps        2026-11-22 10:00:… after 2.010 s: a gap: nothing was recorded here",
    );
}

#[test]
fn export_writes_the_same_files_as_replay() {
    let place = Place::new("export");
    let part = ["--watch", "jam,D0", "--from", "scan 1199", "--to", "scan 1203"];
    let with = |words: &[&str]| place.rungd(&[words, &part].concat());
    for (name, other) in [("a.csv", "b.csv"), ("a.vcd", "b.vcd"), ("a.svg", "b.svg")] {
        said(&with(&["record", "export", "plant.rungd-log", "-o", name]), 0);
        said(&with(&["replay", "plant.rungd-log", "--trace", other]), 0);
        assert!(place.read(name) == place.read(other) && !place.read(name).is_empty());
    }
    let csv = said(&with(&["record", "export", "plant.rungd-log", "-o", "-"]), 0);
    assert_eq!(csv.lines().nth(3), Some("1201,20,1,0"), "{csv}");
    let refused = with(&["record", "export", "plant.rungd-log", "-o", "a.txt"]);
    said(&refused, 2);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("-o a.txt: the ending must be"));
}

/// Times, numbers and states at the limits of their types.
#[test]
fn no_command_panics_on_foreign_recordings() {
    let place = Place::new("hostile");
    let mut whole = conveyor();
    whole.bytes();
    let numbers = [0, 1 << 62, u64::MAX / 2, u64::MAX];
    for (at, number) in numbers.into_iter().enumerate() {
        let changed = |change: &dyn Fn(&mut BlockHead)| {
            let mut blocks = whole.blocks.clone();
            change(&mut blocks[1 + at].head);
            change(&mut blocks[0].head);
            let mut recent = Recent::new(1 << 26);
            blocks.iter().for_each(|block| recent.put(block));
            recent.write()
        };
        for bytes in [
            changed(&|head| head.number = number),
            changed(&|head| head.sequence = number),
            changed(&|head| head.begin_ns = number as i64),
            changed(&|head| head.end_ns = number as i64),
            changed(&|head| head.scans = number as u32),
        ] {
            place.write("plant.rungd-log", &bytes);
            place.remove("cut.rungd-log");
            for words in [
                &["record", "list"][..],
                &["record", "info"],
                &["record", "verify"],
                &["record", "cut", "--from", "10:00:05", "-o", "cut.rungd-log"],
                &["record", "export", "--watch", "jam", "-o", "jam.svg"],
                &["replay", "--watch", "jam"],
                &["why", "jam", "--recording"],
            ] {
                let output = place.rungd(&[words, &["plant.rungd-log"]].concat());
                let err = String::from_utf8_lossy(&output.stderr).into_owned();
                let is_ended = output.status.code().is_some_and(|code| code != 101);
                assert!(is_ended, "{words:?} {number}: {err}");
                assert!(!err.contains("panicked"), "{words:?} {number}: {err}");
            }
        }
    }
}

/// The output path could be that of the recording itself, or of a ladder.
#[test]
fn an_existing_file_is_not_overwritten() {
    let place = Place::new("overwritten");
    let ladder = place.read("new.toml");
    for (word, there) in [("cut", "plant.rungd-log"), ("test", "new.toml")] {
        let output = place.rungd(&["record", word, "plant.rungd-log", "-o", there]);
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && err.contains("is there already"), "{err}");
    }
    assert_eq!(place.read("new.toml"), ladder);
    assert!(place.rungd(&["record", "verify", "plant.rungd-log"]).status.success());
}

#[test]
fn a_time_after_the_end_and_an_empty_recording_are_refused() {
    let place = Place::new("refused");
    let late = "2099-01-01T00:00:00";
    place.write("empty.rungd-log", b"");
    place.write("other.rungd-log", b"root:x:0:0:root:/root:/bin/bash");
    for words in [
        &["why", "jam", "--recording", "plant.rungd-log", "--at", late][..],
        &["record", "cut", "plant.rungd-log", "--from", late, "-o", "cut.rungd-log"],
        &["record", "test", "plant.rungd-log", "--from", late, "-o", "cut.test.toml"],
        &["record", "verify", "empty.rungd-log"],
        &["record", "verify", "other.rungd-log"],
        &["record", "list", "other.rungd-log"],
    ] {
        let output = place.rungd(words);
        assert!(!output.status.success(), "{words:?}: {output:?}");
    }
}
