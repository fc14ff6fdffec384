//! Random rungs, executed by rungd after an import and by the tests' interpreter: no bit and no
//! word differs after any scan.
//!
//! `RUNGD_RLL_TEXTS=1000 RUNGD_RLL_SCANS=10000 cargo test --release -p rungd-import equality` is
//! the long run; `RUNGD_RLL_SEED` gives other texts.

use rungd_base::random::SplitMix64;
use rungd_engine::isa::Real;
use rungd_import::l5x;
use rungd_import::model::Fate;
use rungd_test_support::setting::setting;

use super::file;
use super::generator::{BITS, Routines, WORDS, routines};
use super::interpreter::Machine;
use super::values::{Value, Width, width};
use crate::numbers::below;
use crate::plant;

/// A place in both memories.
struct Watched {
    logix: String,
    here: String,
}

fn watched(routines: &Routines) -> Vec<Watched> {
    let mut all = Vec::new();
    let mut add = |logix: String, here: String| all.push(Watched { logix, here });
    for text in &routines.tags {
        let (name, kind) = text.split_once(": ").unwrap();
        let fields: &[&str] = match kind {
            "TIMER" => &["EN", "TT", "DN", "ACC", "PRE"],
            "COUNTER" => &["CU", "CD", "DN", "OV", "UN", "ACC", "PRE"],
            "CONTROL" => &["EN", "EU", "DN", "EM", "UL", "POS"],
            _ => &[],
        };
        for field in fields {
            add(format!("{name}.{field}"), format!("{name}.{}", field.to_lowercase()));
        }
        match kind.split_once('[') {
            Some(_) if name == "shift" => {
                for at in 0..routines.shifted {
                    let bit = format!("shift[{}].{}", at / 32, at % 32);
                    add(bit.clone(), bit);
                }
            }
            Some((_, size)) => {
                let size: usize = size.trim_end_matches(']').parse().unwrap();
                for at in 0..size {
                    add(format!("{name}[{at}]"), format!("{name}[{at}]"));
                }
            }
            None if fields.is_empty() => add(name.to_owned(), name.to_owned()),
            None => {}
        }
    }
    all
}

/// The changes before a scan: inputs and a few numbers.
fn changes(random: &mut SplitMix64, is_first: bool) -> Vec<(String, i32)> {
    let mut changes = Vec::new();
    for at in 0..BITS / 2 {
        if below(random, 4) == 0 {
            changes.push((format!("bit{at}"), below(random, 2) as i32));
        }
    }
    for at in 0..WORDS {
        if below(random, 12) == 0 {
            changes.push((format!("num{at}"), below(random, 40) as i32 - 10));
            changes.push((format!("shrt{at}"), below(random, 0x10000) as i32 - 0x8000));
            changes.push((format!("tiny{at}"), below(random, 0x100) as i32 - 0x80));
        }
    }
    for at in 0..2 {
        if is_first || below(random, 40) == 0 {
            changes.push((format!("tmr{at}.PRE"), below(random, 90) as i32));
            changes.push((format!("cnt{at}.PRE"), below(random, 6) as i32));
        }
        if below(random, 60) == 0 {
            let far = [2_147_483_646, -2_147_483_647][below(random, 2) as usize];
            changes.push((format!("cnt{at}.ACC"), far));
        }
    }
    changes
}

/// Whether both memories know the place: a place that no rung names is in none.
fn known(plc: &rungd_test_support::plc::Plc, name: &str) -> bool {
    // A bit of a word is known where its word is.
    let word = name.split_once("].").map_or(name.to_owned(), |(word, _)| format!("{word}]"));
    rungd_test_support::run::cell(&plc.program, &plc.symbols, &word).is_ok()
}

#[test]
fn random_rungs_do_the_same_in_every_scan() {
    let (texts, scans) = (setting("RUNGD_RLL_TEXTS", 60), setting("RUNGD_RLL_SCANS", 60));
    let seed = setting("RUNGD_RLL_SEED", 1);
    let mut exact = 0;
    let mut rungs = 0;
    for text in 0..texts {
        let mut random = SplitMix64(seed * 1_000_003 + text);
        let made = routines(&mut random);
        let project = l5x::read(&file(&made.tags, &made.main, &made.sub)).unwrap();
        for rung in &project.outcome.rungs {
            let is_kept = !matches!(rung.fate, Fate::Todo(_));
            assert!(is_kept, "text {text}: {} {:?}", rung.text, rung.fate);
            exact += usize::from(rung.fate == Fate::Exact);
            rungs += 1;
        }
        compare(&made, &project, &mut random, scans);
    }
    println!("{texts} texts, {rungs} rungs, {exact} exact, {scans} scans each: no difference");
}

fn compare(
    made: &Routines,
    project: &rungd_import::model::ForeignProject,
    random: &mut SplitMix64,
    scans: u64,
) {
    let mut plc = plant::started(project);
    let mut machine = Machine::new(&made.main, &made.sub);
    let places: Vec<Watched> =
        watched(made).into_iter().filter(|place| known(&plc, &place.here)).collect();
    let mut now_ms = 0;
    for scan in 0..scans {
        // Nothing writes from outside before the prescan is over.
        let changes = if scan == 0 { Vec::new() } else { changes(random, scan == 1) };
        let mut here = Vec::new();
        for (name, value) in changes {
            let own = match name.split_once('.') {
                Some((tag, field)) => format!("{tag}.{}", field.to_lowercase()),
                None => name.clone(),
            };
            if !known(&plc, &own) {
                continue;
            }
            match width(&name) {
                Width::Bit => machine.values.set_bit(&name, value != 0),
                Width::Signed(_) | Width::Real => {
                    machine.values.store(&name, Value::Whole(value.into()));
                }
            }
            here.push((own, value));
        }
        plant::scan(&mut plc, now_ms, &here);
        machine.scan(now_ms);
        now_ms += below(random, 40);
        for place in &places {
            let wanted = match width(&place.logix) {
                Width::Bit => i64::from(machine.values.bit(&place.logix)),
                Width::Signed(_) | Width::Real => match machine.values.value(&place.logix) {
                    Value::Whole(value) => value,
                    Value::Real(value) => i64::from(value.to_bits() as i32),
                },
            };
            let found = match width(&place.logix) {
                Width::Real => {
                    let real = Real::of_cell(plc.value(&place.here) as i32).number();
                    i64::from(real.to_bits() as i32)
                }
                Width::Bit | Width::Signed(_) => plc.value(&place.here),
            };
            assert_eq!(
                found,
                wanted,
                "{} in scan {scan}\n{}\n--\n{}\n{}",
                place.logix,
                made.main.join("\n"),
                made.sub.join("\n"),
                plant::texts(project)
            );
        }
    }
}
