//! The coverage of test files, as text and as JSON.
//!
//! Each scenario is played with a tape, which `observe` executes again. Random tests count only
//! where the caller asks for them: they reach a rung by chance, not because an author thought of
//! it.

use std::cell::RefCell;
use std::fmt::Write as _;
use std::rc::Rc;
use std::sync::Arc;

use serde_json::{Value, json};

use super::judge::Judge;
use super::lowered_suite::LoweredSuite;
use super::player::{Spectator, play};
use super::random_run;
use super::suite::Suite;
use crate::rig::{Rig, RigProgram, TapeListener};
use rungd_engine::EngineState;
use rungd_history::observe::{CoverageRun, LadderCoverage, PartCoverage, SeenStates, Subject};
use rungd_runtime::TapeEntry;

/// The coverage of test files.
#[derive(Debug, Default)]
pub struct Coverage {
    files: Vec<(String, LadderCoverage)>,
}

/// Collects the coverage of one program. The programs of reloads are not observed.
struct CoverageListener {
    program: Arc<RigProgram>,
    run: Rc<RefCell<CoverageRun>>,
}

impl TapeListener for CoverageListener {
    fn hear(&mut self, program: &Arc<RigProgram>, entry: TapeEntry, state: Option<&EngineState>) {
        if !Arc::ptr_eq(program, &self.program) {
            return;
        }
        let mut run = self.run.borrow_mut();
        match (entry, state) {
            (TapeEntry::State { .. }, Some(state)) => run.resume(state),
            (TapeEntry::Call(call), _) => run.call(call),
            (
                TapeEntry::State { .. }
                | TapeEntry::Origin(_)
                | TapeEntry::Number(_)
                | TapeEntry::Mode(_)
                | TapeEntry::Swap { .. }
                | TapeEntry::Lost { .. },
                _,
            ) => {}
        }
    }
}

/// Passes the tape to the listener when a scenario begins.
struct CoverageSeat(Option<Box<dyn TapeListener>>);

impl Spectator for CoverageSeat {
    fn scanned(&mut self, _: &Rig, _: &Judge, _: u64) {}

    fn takes_place(&mut self, rig: &mut Rig) {
        if let Some(listener) = self.0.take() {
            rig.listen(listener);
        }
    }
}

/// The tests that count.
#[derive(Clone, Copy, Debug)]
pub struct CoverageOptions<'a> {
    /// Only tests whose names contain this text.
    pub filter: Option<&'a str>,
    /// The runs of random tests, too.
    pub with_random: bool,
}

impl Coverage {
    /// Plays the tests of a suite that count, and adds their coverage.
    pub fn add(&mut self, suite: &Suite, programs: &[Arc<RigProgram>], options: CoverageOptions) {
        let stage = LoweredSuite { suite, programs, given_up: None };
        let program = &suite.programs[0];
        let subject = Subject::new(Arc::clone(&program.program), program.files.clone());
        let run = Rc::new(RefCell::new(CoverageRun::new(subject)));
        let wanted = |name: &str| options.filter.is_none_or(|text| name.contains(text));
        let listener = || -> Box<dyn TapeListener> {
            Box::new(CoverageListener { program: Arc::clone(&programs[0]), run: Rc::clone(&run) })
        };
        for scenario in suite.scenarios.iter().filter(|scenario| wanted(&scenario.name)) {
            play(stage, scenario, true, &mut CoverageSeat(Some(listener())));
        }
        let counts = |name: &str| options.with_random && wanted(name);
        for test in suite.randoms.iter().filter(|random_test| counts(&random_test.name)) {
            (0..test.runs).for_each(|run| random_run::heard(stage, test, run, listener()));
        }
        self.files.push((suite.name.clone(), run.borrow().coverage()));
    }

    /// The coverage for people: the counts, and the parts that were not seen both ways.
    pub fn text(&self) -> String {
        self.files.iter().map(|(name, coverage)| file_text(name, coverage)).collect()
    }

    /// The coverage as JSON: the same, with all states that were seen.
    pub fn json(&self) -> Value {
        let ways = |seen: SeenStates| json!({ "on": seen.on, "off": seen.off });
        let named =
            |(name, seen): &(String, SeenStates)| json!({ "name": name, "seen": ways(*seen) });
        let leg =
            |(name, seen): &(&'static str, SeenStates)| json!({ "leg": name, "seen": ways(*seen) });
        let part = |part: &PartCoverage| {
            let contacts: Vec<Value> = part
                .contacts
                .iter()
                .map(|contact| {
                    let (text, line) = (&contact.place.text, contact.place.line);
                    json!({ "text": text, "line": line, "seen": ways(contact.seen) })
                })
                .collect();
            json!({
                "block": part.rung.element.name,
                "rung": part.rung.name,
                "number": part.rung.number,
                "branch": part.rung.branch,
                "file": part.place.file,
                "line": part.place.line,
                "legs": part.legs.iter().map(leg).collect::<Vec<_>>(),
                "contacts": contacts,
            })
        };
        let file = |(name, coverage): &(String, LadderCoverage)| {
            json!({
                "file": name,
                "rungs": coverage.parts.iter().map(part).collect::<Vec<_>>(),
                "stages": coverage.stages.iter().map(named).collect::<Vec<_>>(),
                "alarms": coverage.alarms.iter().map(named).collect::<Vec<_>>(),
            })
        };
        Value::Array(self.files.iter().map(file).collect())
    }
}

fn file_text(name: &str, coverage: &LadderCoverage) -> String {
    let legs = || coverage.parts.iter().flat_map(|part| part.legs.iter().map(|(_, seen)| *seen));
    let contacts =
        || coverage.parts.iter().flat_map(|part| part.contacts.iter().map(|contact| contact.seen));
    let mut text = format!("coverage of {name}:\n");
    let mut count = |what: &str, seen: Vec<SeenStates>| {
        let whole = seen.iter().filter(|seen| seen.is_whole()).count();
        let _ = match seen.len() {
            0 => Ok(()),
            all => writeln!(text, "  {what:<28} {whole} of {all}"),
        };
    };
    count("legs, power ON and OFF", legs().collect());
    count("contacts, ON and OFF", contacts().collect());
    count("Stages, entered and left", coverage.stages.iter().map(|(_, seen)| *seen).collect());
    count("alarms, raised and gone", coverage.alarms.iter().map(|(_, seen)| *seen).collect());
    for part in &coverage.parts {
        let (rung, place) = (part.rung.text(), &part.place);
        let missing = missing(part);
        if !missing.is_empty() {
            let (file, line) = (&place.file, place.line);
            let _ = writeln!(text, "  {file}:{line}: {rung}: {}", missing.join(", "));
        }
    }
    for (name, seen) in coverage.stages.iter().filter(|(_, seen)| !seen.is_whole()) {
        let what = if seen.on { "never left" } else { "never entered" };
        let _ = writeln!(text, "  Stage {name}: {what}");
    }
    for (name, seen) in coverage.alarms.iter().filter(|(_, seen)| !seen.is_whole()) {
        let what = if seen.on { "never gone" } else { "never raised" };
        let _ = writeln!(text, "  alarm {name}: {what}");
    }
    text
}

/// The states of a part that were not seen.
fn missing(part: &PartCoverage) -> Vec<String> {
    let state = |seen: SeenStates| match (seen.on, seen.off) {
        (true, true) => None,
        (false, false) => Some("never executed"),
        (false, true) => Some("never ON"),
        (true, false) => Some("never OFF"),
    };
    if part.legs.iter().any(|(_, seen)| !seen.on && !seen.off) {
        return vec!["never executed".to_owned()];
    }
    let has_contacts = !part.contacts.is_empty();
    let legs = part.legs.iter().filter(|_| has_contacts);
    let legs = legs.filter_map(|(leg, seen)| Some(format!("leg {leg} {}", state(*seen)?)));
    let contacts = part.contacts.iter();
    let contacts = contacts
        .filter_map(|contact| Some(format!("`{}` {}", contact.place.text, state(contact.seen)?)));
    legs.chain(contacts).collect()
}
