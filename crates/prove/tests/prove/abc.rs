//! ABC's property-directed reachability agrees with exploring and deducing about random programs:
//! another program reads the AIGER file of each question.
//!
//! `RUNGD_PROVE_ABC` (12) is the number of programs, `RUNGD_PROVE_SEED` (1) the first seed. What ABC
//! does not decide in its time is counted. Its exit code says nothing: its words are read.

use super::aiger_file::written;
use super::drawn::{Drawn, drawn};
use rungd_prove::deduce::Patience;
use rungd_prove::encode::encode;
use rungd_prove::explore::{ExploreLimits, Explored, explore};
use rungd_prove::gates::Gates;
use rungd_prove::model::Target;
use rungd_prove::race::{Decision, by_deducing};
use rungd_test_support::abc::{AbcAnswer, is_installed, judge as judged_by_abc};
use rungd_test_support::folder::TestFolder;
use rungd_test_support::setting::setting;
use std::fs;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

#[derive(Debug, Default)]
struct Tally {
    never: u32,
    found: u32,
    open: u32,
}

/// What rungd says: whether the target can be reached; nothing if neither way decides.
fn reached(drawn: &Drawn, target: Target) -> Option<bool> {
    let limits = ExploreLimits {
        memory: 1_000_000,
        combinations: 64,
        threads: 1,
        deadline: None,
        stop: &|| false,
        states: Some(2_000),
        depth: None,
        scans: None,
    };
    match explore(&drawn.model, target, &limits) {
        Explored::All { .. } => return Some(false),
        Explored::Found(_) => return Some(true),
        Explored::Stopped { .. } => {}
    }
    let patience = Patience::new(Duration::from_millis(500), &Arc::new(AtomicBool::new(false)));
    match by_deducing(&drawn.model, target, &patience) {
        Decision::Never(..) => Some(false),
        Decision::Found(..) => Some(true),
        Decision::Open(_) => None,
    }
}

/// A question about random gates.
struct Question<'d> {
    drawn: &'d Drawn,
    gates: &'d Gates,
    target: Target,
}

fn judge(folder: &TestFolder, question: Question, tally: &mut Tally) {
    let Question { drawn, gates, target } = question;
    let Some(is_reached) = reached(drawn, target) else {
        tally.open += 1;
        return;
    };
    let at = drawn.model.judged.iter().position(|bit| *bit == target.bit).expect("a judged bit");
    let gates = gates.reduced(&[at]);
    // What a cut computes is any value in the file: then more can be reached there.
    if is_reached || gates.open_cuts().is_empty() {
        let path = folder.path().join("question.aig");
        let bad = gates.judged[at].inverted_if(!target.value);
        fs::write(&path, written(&gates, &[bad]).binary()).expect("a file");
        let Some(answer) = judged_by_abc(&path, 10) else {
            tally.open += 1;
            return;
        };
        let is_found = answer != AbcAnswer::Proved;
        assert_eq!(is_found, is_reached, "{target:?}\n{}", drawn.text);
        tally.never += u32::from(!is_reached);
        tally.found += u32::from(is_reached);
    }
}

#[test]
fn abc_agrees_about_random_programs() {
    if !is_installed() {
        return;
    }
    let folder = TestFolder::new("abc");
    let (first, count) = (setting("RUNGD_PROVE_SEED", 1), setting("RUNGD_PROVE_ABC", 12));
    let mut tally = Tally::default();
    for seed in first..first + count {
        let drawn = drawn(seed);
        let gates = encode(&drawn.model);
        for bit in &drawn.model.judged {
            let target = Target { bit: *bit, value: seed % 2 == 0 };
            judge(&folder, Question { drawn: &drawn, gates: &gates, target }, &mut tally);
        }
    }
    println!("{count} programs: {tally:?}");
    assert!(tally.never > 0 && tally.found > 0, "{tally:?}");
}
