//! The operands that tests use: each step, condition and random change with the names of its
//! operands.
//!
//! `draw::xref` lists the tests of an operand from this list.

use std::collections::HashSet;

use super::condition::Condition;
use super::suite::{Suite, TestOperand, TestStep};
use super::view::ObservedRung;
use rungd_language::source::span::Span;
use rungd_language::source::was;

/// A part of a test file that names operands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TestTouch {
    /// The name of the test file, as the caller wrote it.
    pub file: String,
    /// The line, from 1.
    pub line: u32,
    /// The test; `None`: `always`, or the observer.
    pub test: Option<String>,
    /// Whether it is a rung of the observer.
    pub is_of_observer: bool,
    /// The text of the part.
    pub text: String,
    /// The names in it.
    pub names: Vec<String>,
}

/// The parts of a test file that name operands, in file order.
pub fn touches(suite: &Suite) -> Vec<TestTouch> {
    let mut list = TouchList { suite, all: Vec::new() };
    for condition in suite.always.first().into_iter().flatten() {
        list.add(None, condition.text.clone(), place_of(suite, condition), names(condition));
    }
    list.observer();
    for scenario in &suite.scenarios {
        let test = Some(scenario.name.as_str());
        list.set(test, scenario.span, &scenario.set);
        for step in &scenario.steps {
            let text = suite.text(step.span).to_owned();
            list.add(test, text, step.span, of_step(&step.value));
        }
    }
    for random in &suite.randoms {
        let test = Some(random.name.as_str());
        list.set(test, random.span, &random.set);
        for change in &random.changes {
            let name = change.operand.name.clone();
            list.add(test, format!("{name} changes at random"), random.span, vec![name]);
        }
    }
    list.all
}

struct TouchList<'s> {
    suite: &'s Suite,
    all: Vec<TestTouch>,
}

impl TouchList<'_> {
    fn add(&mut self, test: Option<&str>, text: String, span: Span, names: Vec<String>) {
        if names.is_empty() {
            return;
        }
        let (file, line) = (self.suite.name.clone(), self.suite.line(span));
        let (test, is_of_observer) = (test.map(str::to_owned), false);
        self.all.push(TestTouch { file, line, test, is_of_observer, text, names });
    }

    /// The rungs of the observer.
    fn observer(&mut self) {
        let Some(view) = &self.suite.programs[0].view else { return };
        for ObservedRung { text, place, names } in view.rungs() {
            let before = self.all.len();
            self.add(None, text, place, names);
            self.all[before..].iter_mut().for_each(|touch| touch.is_of_observer = true);
        }
    }

    fn set(&mut self, test: Option<&str>, span: Span, set: &[(TestOperand, i32)]) {
        for (operand, _) in set {
            let text = format!("set = {{ {} = … }}", operand.name);
            self.add(test, text, span, vec![operand.name.clone()]);
        }
    }
}

/// The place of a condition of `always`. Its text is the first match in the file: `always` is a key
/// of the root, so no step comes before it.
fn place_of(suite: &Suite, condition: &Condition) -> Span {
    let start = suite.file.text.find(&condition.text).unwrap_or(0) as u32;
    Span { start, end: start, ..Span::default() }
}

fn of_step(step: &TestStep) -> Vec<String> {
    match step {
        TestStep::Set(operand, _)
        | TestStep::Force(operand, _)
        | TestStep::Unforce(operand)
        | TestStep::Pulse { operand, .. }
        | TestStep::Beat { operand, .. } => vec![operand.name.clone()],
        TestStep::Expect(condition)
        | TestStep::Within(_, condition)
        | TestStep::Hold(_, condition) => names(condition),
        TestStep::Run(_)
        | TestStep::Late(_)
        | TestStep::Stop
        | TestStep::Start
        | TestStep::Restart { .. }
        | TestStep::PowerCut(_)
        | TestStep::Reload(_)
        | TestStep::Lose(_)
        | TestStep::Restore(_)
        | TestStep::Clock(_) => Vec::new(),
    }
}

fn names(condition: &Condition) -> Vec<String> {
    let operands = condition.operands.iter().map(|(name, _)| name.as_str());
    let mut seen = HashSet::new();
    let places = operands.chain(condition.selected());
    let places = places.map(|name| was::place_in(name).unwrap_or(name));
    places.filter(|name| seen.insert(*name)).map(str::to_owned).collect()
}
