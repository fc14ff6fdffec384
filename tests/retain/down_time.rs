//! `$DownSeconds`, with the real binary: the seconds since the scan of the restored image. The tests
//! change the time in the file instead of waiting.

use std::fs;

use crate::retain::memory::{Plant, file, find, run};
use rungd_engine::isa::{Space, WordSpace};
use rungd_language::lower::lower;
use rungd_language::resolve::range::Range;
use rungd_language::source::span::{FileId, Span};
use rungd_state::retain::format::{ImageStamp, put_slot, read_slot};
use rungd_state::retain::keeper::ScanImage;
use rungd_state::retain::{Keeper, RetainPlan};
use rungd_test_support::run::load;

/// D0 is `$DownSeconds` of this process, D1 that of the process before.
const LADDER: &str = "[[program]]\nname = \"Main\"\nrung = [\n\
    { when = [\"$FirstScan\"], do = [\"MOVE D0 to=D1\", \"MOVE $DownSeconds to=D0\"] },\n]\n";
const KEEPS: &str = "scan.period = \"2ms\"\n[retain]\nranges = [\"D0..D1\"]\n\
    file = \"memory\"\ncold-start = \"run\"\n";

/// Changes the stamp of every image in the file.
fn restamp(plant: &Plant, change: impl Fn(&mut ImageStamp)) {
    let mut bytes = fs::read(file(plant)).unwrap();
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let (slot_bytes, slots) = (number(20), number(24));
    let id = u64::from_le_bytes(bytes[32..40].try_into().unwrap());
    for slot in 0..slots {
        let at = 8192 + slot * slot_bytes;
        let Ok((mut stamp, content)) = read_slot(&bytes[at..at + slot_bytes], id) else { continue };
        change(&mut stamp);
        let mut image = Vec::new();
        put_slot(&mut image, id, &stamp, content);
        bytes[at..at + image.len()].copy_from_slice(&image);
    }
    fs::write(file(plant), bytes).unwrap();
}

/// D0 and D1, as `rungd retain show` prints them.
fn shown(plant: &Plant) -> [i64; 2] {
    let rungd = std::process::Command::new(env!("CARGO_BIN_EXE_rungd"))
        .args(["retain", "show", file(plant).to_str().unwrap()])
        .output()
        .unwrap();
    let text = String::from_utf8(rungd.stdout).unwrap();
    let value = |name: &str| {
        let line = text.lines().find(|line| line.trim_start().starts_with(name));
        // Elements that are 0 have no line.
        line.map_or(0, |line| line.split_whitespace().nth(1).unwrap().parse().unwrap())
    };
    ["D0", "D1"].map(value)
}

#[test]
fn the_seconds_since_the_restored_scan_are_counted() {
    let plant = Plant::new(LADDER, KEEPS);
    run(&plant, "2");
    assert_eq!(shown(&plant), [0, 0], "nothing was restored");
    let week_s = 7 * 86_400;
    restamp(&plant, |stamp| stamp.scanned_ms -= week_s * 1000);
    let lines = run(&plant, "2");
    assert_eq!(find(&lines, "restored: image")["restored"], 2);
    let [down, before] = shown(&plant);
    assert!((week_s as i64..week_s as i64 + 3600).contains(&down), "{down}");
    assert_eq!(before, 0);
}

#[test]
fn no_seconds_are_counted_without_a_time_in_the_image_or_if_the_clock_went_back() {
    let plant = Plant::new(LADDER, KEEPS);
    run(&plant, "2");
    restamp(&plant, |stamp| stamp.scanned_ms = 0);
    let lines = run(&plant, "2");
    assert_eq!(find(&lines, "restored: image")["restored"], 2, "an image of rungd 0.2");
    assert_eq!(shown(&plant)[0], 0);
    restamp(&plant, |stamp| stamp.scanned_ms += 86_400_000);
    run(&plant, "2");
    assert_eq!(shown(&plant)[0], 0);
    restamp(&plant, |stamp| stamp.scanned_ms = 1);
    run(&plant, "2");
    let [down, _] = shown(&plant);
    assert!(down > 1_700_000_000, "{down}");
}

/// Saves the same content at two times; returns whether the second is written.
fn is_written_again(ladder: &str, name: &str, age_ms: u64) -> bool {
    let program = load(ladder).unwrap();
    let (code, symbols) = lower(&program);
    let span = Span { file: FileId(0), start: 0, end: 0 };
    let space = Space::Word(WordSpace::D);
    let (of_tag, of_record) = (false, false);
    let words = Range { space, first: 0, last: 9, span, of_tag, of_record };
    let plan = RetainPlan::new(&[words], &program, &symbols);
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_file(&path);
    let (mut keeper, _) = Keeper::open(&path, plan, 7).unwrap();
    let (bits, words) = (vec![0; code.bit_count as usize], vec![5; code.word_count as usize]);
    let at = |scanned_ms| ScanImage {
        scan: scanned_ms,
        bits: &bits,
        words: &words,
        is_final: false,
        now_ms: scanned_ms,
        scanned_ms,
    };
    assert!(keeper.save(at(1_000_000)).unwrap().is_some());
    let again = keeper.save(at(1_000_000 + age_ms)).unwrap();
    fs::remove_file(&path).unwrap();
    again.is_some()
}

#[test]
fn an_unchanged_image_is_written_once_a_minute_only_for_a_ladder_that_names_the_seconds() {
    assert!(is_written_again(LADDER, "down-named", 60_000));
    assert!(!is_written_again(LADDER, "down-young", 59_999));
    let without = LADDER.replace("$DownSeconds", "$Second");
    assert!(!is_written_again(&without, "down-unnamed", 3_600_000));
}
