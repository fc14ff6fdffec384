//! Random ladders, executed by rungd after an import, and by pyrung: no bit and no number differs
//! after any scan.
//!
//! `traces.txt` has what pyrung did. 500 others:
//! `python3 crates/import/tests/click/traces.py 500 100 > /tmp/traces.txt` (needs pip's pyrung),
//! then
//! `RUNGD_CLICK_TRACES=/tmp/traces.txt cargo test -p rungd-import click::traces -- --nocapture`.

use rungd_import::click;
use rungd_import::model::Fate;

use crate::plant;

/// A value of an address.
struct AddressValue {
    /// The tag of the address.
    tag: String,
    value: i64,
}

/// The values of a text: `X001=1 DS2=-5`.
fn values(text: &str) -> Vec<AddressValue> {
    let value = |word: &str| {
        let (address, value) = word.split_once('=').unwrap();
        let digits = address.find(|c: char| c.is_ascii_digit()).unwrap();
        let (bank, number) = address.split_at(digits);
        let number: u32 = number.parse().unwrap();
        let tag = format!("{}_{number}", bank.to_lowercase());
        AddressValue { tag, value: value.parse().unwrap() }
    };
    text.split_whitespace().map(value).collect()
}

/// Compares the scans of a program; gives their number.
fn compare(program: &str) -> usize {
    let (ladder, scans) = program.split_once("\nscans\n").unwrap();
    let (number, ladder) = ladder.split_once('\n').unwrap();
    let project = click::read(ladder).unwrap();
    for rung in &project.outcome.rungs {
        assert_eq!(rung.fate, Fate::Exact, "program {number}: {}", rung.text);
    }
    let mut plc = plant::started(&project);
    for (scan, line) in scans.lines().enumerate() {
        let (changes, wanted) = line.split_once('|').unwrap();
        let changes = values(changes).into_iter().map(|one| (one.tag, one.value as i32));
        plant::scan(&mut plc, 10 * scan as u64, &changes.collect::<Vec<_>>());
        for AddressValue { tag, value } in values(wanted) {
            let found = plc.value(&tag);
            let text = || format!("{ladder}\n{scans}\n{}", plant::texts(&project));
            assert_eq!(found, value, "program {number}: {tag} in scan {scan}\n{}", text());
        }
    }
    scans.lines().count()
}

#[test]
fn random_ladders_do_what_pyrung_does_in_every_scan() {
    let text = match std::env::var("RUNGD_CLICK_TRACES") {
        Ok(path) => std::fs::read_to_string(path).unwrap(),
        Err(_) => include_str!("traces.txt").to_owned(),
    };
    let programs: Vec<&str> =
        text.split("program ").filter(|program| !program.is_empty()).collect();
    let scans: usize = programs.iter().map(|program| compare(program)).sum();
    println!("{} ladders, {scans} scans: no difference", programs.len());
    assert!(programs.len() >= 20);
}
