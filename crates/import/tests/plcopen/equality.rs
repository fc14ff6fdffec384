//! Random ladders, executed by rungd after an import and by the tests' interpreter: no bit and no
//! word differs after any scan.
//!
//! `RUNGD_PLCOPEN_PROGRAMS=1000 RUNGD_PLCOPEN_SCANS=10000 cargo test --release -p rungd-import
//! plcopen::equality` is the long run; `RUNGD_PLCOPEN_SEED` gives other ladders.

use rungd_base::random::SplitMix64;
use rungd_engine::isa::Real;
use rungd_import::model::{Fate, ForeignProject};
use rungd_import::plcopen;
use rungd_test_support::setting::setting;

use super::chart_generator::chart_project;
use super::counter::is_complete;
use super::generator::{RandomProject, project};
use super::interpreter::Machine;
use super::values::Value;
use crate::numbers::below;
use crate::plant;

/// Changes of variables before a scan.
fn changes(random: &mut SplitMix64) -> Vec<(String, Value)> {
    let mut changes = Vec::new();
    for at in 0..4 {
        if below(random, 4) == 0 {
            changes.push((format!("bit{at}"), Value::Bool(below(random, 2) == 1)));
        }
    }
    for at in 0..3 {
        if below(random, 10) == 0 {
            let wide = below(random, 0x10000) as i64 - 0x8000;
            let near = below(random, 12) as i64 - 3;
            let value = if below(random, 3) == 0 { wide } else { near };
            changes.push((format!("num{at}"), Value::Whole(value)));
        }
    }
    for at in 0..2 {
        if below(random, 10) == 0 {
            let value = below(random, 1 << 32) as u32 as i32;
            changes.push((format!("dbl{at}"), Value::Whole(value.into())));
            changes.push((format!("uns{at}"), Value::Whole(below(random, 0x10000) as i64)));
            changes.push((format!("span{at}"), Value::Whole(below(random, 90) as i64 - 5)));
            let real = (below(random, 2000) as f64 - 1000.0) / 8.0;
            changes.push((format!("rea{at}"), Value::Real(real)));
        }
    }
    changes
}

fn cell(value: Value) -> i32 {
    match value {
        Value::Bool(is_on) => i32::from(is_on),
        Value::Whole(value) => value as i32,
        Value::Real(value) => Real::finite(value as f32).unwrap().cell(),
    }
}

#[test]
fn random_ladders_do_the_same_in_every_scan() {
    compare(project);
}

#[test]
fn random_charts_do_the_same_in_every_scan() {
    compare(chart_project);
}

/// A chart of which two conditions need a rung of one name, which their subroutine had twice.
#[test]
fn rungs_that_conditions_need_have_names_of_their_own() {
    compare_one(chart_project, 183, 30);
}

fn compare(make: fn(&mut SplitMix64) -> RandomProject) {
    let programs = setting("RUNGD_PLCOPEN_PROGRAMS", 12);
    let scans = setting("RUNGD_PLCOPEN_SCANS", 60);
    let (mut rungs, mut exact) = (0, 0);
    for program in 0..programs {
        let counted = compare_one(make, program, scans);
        rungs += counted.rungs;
        exact += counted.exact;
    }
    println!(
        "{programs} programs, {rungs} networks, {exact} exact, {scans} scans each: no difference"
    );
}

struct CountedRungs {
    rungs: usize,
    exact: usize,
}

fn compare_one(
    make: fn(&mut SplitMix64) -> RandomProject,
    program: u64,
    scans: u64,
) -> CountedRungs {
    let seed = setting("RUNGD_PLCOPEN_SEED", 1);
    let mut random = SplitMix64(seed * 1_000_003 + program);
    let made = make(&mut random);
    let imported = plcopen::read(&made.xml).unwrap();
    let rungs = &imported.outcome.rungs;
    for rung in rungs {
        let is_kept = !matches!(rung.fate, Fate::Todo(_));
        assert!(is_kept, "program {program}: {} {:?}\n{}", rung.text, rung.fate, made.xml);
    }
    let exact = rungs.iter().filter(|rung| rung.fate == Fate::Exact).count();
    is_complete(&made.xml);
    let mut trial = Trial { program, made: &made, project: &imported, random: &mut random };
    trial.compare(scans);
    CountedRungs { rungs: rungs.len(), exact }
}

struct Trial<'t> {
    program: u64,
    made: &'t RandomProject,
    project: &'t ForeignProject,
    random: &'t mut SplitMix64,
}

impl Trial<'_> {
    fn compare(&mut self, scans: u64) {
        let mut plc = plant::started(self.project);
        let mut machine = Machine::new(&self.made.xml);
        let mut now_ms = 0;
        for scan in 0..scans {
            let changes = changes(self.random);
            for (name, value) in &changes {
                machine.set(name, *value);
            }
            let here: Vec<(String, i32)> =
                changes.iter().map(|(name, value)| (name.clone(), cell(*value))).collect();
            plant::scan(&mut plc, now_ms, &here);
            machine.scan(now_ms as i64);
            now_ms += below(self.random, 40);
            for place in &self.made.watched {
                let wanted = i64::from(cell(machine.value(&place.name)));
                let found = match place.kind {
                    "REAL" => i64::from(plc.value(&place.name) as i32),
                    _ => plc.value(&place.name),
                };
                assert_eq!(
                    found,
                    wanted,
                    "program {}: {} in scan {scan}\n{}\n{}",
                    self.program,
                    place.name,
                    self.made.xml.replace("><", ">\n<"),
                    plant::texts(self.project)
                );
            }
        }
    }
}
