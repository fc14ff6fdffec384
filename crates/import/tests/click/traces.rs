//! Random ladders, executed by rungd after an import, and by pyrung: no bit and no number differs
//! after any scan.
//!
//! `traces.txt` has what pyrung did with the first ones. With pip's pyrung, others are made here:
//! `RUNGD_CLICK_LADDERS=500 cargo test -p rungd-import click::traces -- --nocapture` is the long
//! run. `RUNGD_PYRUNG_PYTHON` names the Python that has pyrung, if it is not `python3`.

use std::process::Command;

use rungd_import::click;
use rungd_import::model::Fate;
use rungd_test_support::needs::{usable, works};
use rungd_test_support::setting::setting;

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

/// Compares all programs of a text; gives their number.
fn compare_all(text: &str) -> usize {
    let programs = text.split("program ").filter(|program| !program.is_empty());
    let scans: Vec<usize> = programs.map(compare).collect();
    println!("{} ladders, {} scans: no difference", scans.len(), scans.iter().sum::<usize>());
    scans.len()
}

#[test]
fn kept_ladders_do_what_pyrung_does_in_every_scan() {
    assert!(compare_all(include_str!("traces.txt")) >= 20);
}

#[test]
fn random_ladders_do_what_pyrung_does_in_every_scan() {
    let python = std::env::var_os("RUNGD_PYRUNG_PYTHON").unwrap_or_else(|| "python3".into());
    let mut probe = Command::new(&python);
    probe.args(["-c", "import pyrung.click"]);
    if !usable(works("pip's pyrung", &mut probe)) {
        return;
    }
    let count = setting("RUNGD_CLICK_LADDERS", 10);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/click/traces.py");
    // Behind the numbers of the kept ones.
    let arguments = [script.to_owned(), count.to_string(), "100".to_owned(), "1000".to_owned()];
    let made = Command::new(&python).args(arguments).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert_eq!(compare_all(&String::from_utf8(made.stdout).unwrap()) as u64, count);
}
