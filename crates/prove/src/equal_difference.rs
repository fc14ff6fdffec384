//! A run after which two ladders differ, tried in tests of both.
//!
//! `equal` calls it. No answer tells a run that does not pass in a test of the old ladder and fail
//! in the same one of the new ladder.

use crate::equal_answer::{
    DifferentOutput, EqualAnswer, EqualQuestion, LadderDifference, OutputPair, SharedInput,
};
use crate::model::{Path, ProofModel, Run};
use crate::named_input::NamedInput;
use crate::stretched::{AddedScan, TestBrings, stretched};
use crate::trial::steps;
use rungd_engine::isa::{Address, Real, Word};
use rungd_engine::{Cell, Layout};
use rungd_lab::rig::RigProgram;
use rungd_lab::testing::{self, Condition, FoundRun, Suite, TestStep, TriedRun, try_run};
use rungd_language::resolve::program::{Comparison, ConstantForm, Contact, Value};
use rungd_language::source::span::Span;
use rungd_language::source::wording::counted;

/// A path after which the ladders differ.
pub(crate) struct FoundDifference<'a> {
    pub question: &'a EqualQuestion<'a>,
    pub model: &'a ProofModel,
    /// The inputs of the model.
    pub free: &'a [SharedInput],
    pub path: &'a Path,
}

impl FoundDifference<'_> {
    /// The answer: what differs, if it does so in tests of both ladders; if not, with what a test
    /// brings later.
    pub fn difference(&self, pairs: &[OutputPair]) -> EqualAnswer {
        let EqualQuestion { old, new, .. } = *self.question;
        let interval_ms = |suite: &Suite| suite.programs[0].controller.retention.interval_ms;
        let brings = TestBrings {
            model: self.model,
            interval_ms: interval_ms(old).max(interval_ms(new)),
            devices: Vec::new(),
        };
        let longer = AddedScan::BOTH.map(|added| stretched(&brings, self.path, added));
        let mut paths = [self.path].into_iter().chain(&longer);
        let found = paths.find_map(|path| self.confirmed(path, pairs));
        found.map_or_else(
            || {
                let cause = "the run that was found is not different in a test".to_owned();
                let scans = counted(self.path.scans.len() as u64, "scan");
                EqualAnswer::NotDecided(vec![cause], vec![scans])
            },
            |difference| EqualAnswer::Different(Box::new(difference)),
        )
    }

    /// The difference at the end of a path, if it passes in a test of the old ladder alone.
    fn confirmed(&self, path: &Path, pairs: &[OutputPair]) -> Option<LadderDifference> {
        let differ = self.differing(path, pairs);
        let run = |side: usize, suite: &Suite| {
            let programs = testing::programs(suite);
            let name = format!("differs: {}", text_of(&differ, |(pair, ..)| pair.name.clone()));
            let mut steps = self.steps(path, side);
            for (pair, old, _) in &differ {
                let address = if side == 0 { pair.old } else { pair.alone };
                steps.push(TestStep::Expect(expected(&programs[0], address, *old)));
            }
            try_run(suite, &programs, FoundRun { name, set: Vec::new(), steps })
        };
        let (old, new) = (run(0, self.question.old), run(1, self.question.new));
        let TriedRun { text, is_confirmed, .. } = old;
        if !is_confirmed || new.is_confirmed {
            return None;
        }
        let layout = &self.model.code.layout;
        let outputs = differ.iter().map(|(pair, old, new)| DifferentOutput {
            name: pair.name.clone(),
            old: value_text(layout, pair.old, *old),
            new: value_text(layout, pair.new, *new),
        });
        Some(LadderDifference {
            scan: path.scans.len() as u64,
            outputs: outputs.collect(),
            scenario: text,
            failure: new.failure,
        })
    }

    /// The outputs that differ at the end, with both values.
    fn differing<'p>(
        &self,
        path: &Path,
        pairs: &'p [OutputPair],
    ) -> Vec<(&'p OutputPair, i32, i32)> {
        let mut run = Run::new(self.model);
        path.scans.iter().for_each(|scan| drop(run.scan(scan)));
        let image = run.engine.image();
        let value = |address| {
            let cell: Option<Cell> = self.model.code.layout.cell(address);
            cell.map_or(0, |cell| image.value(cell))
        };
        let values = pairs.iter().map(|pair| (pair, value(pair.old), value(pair.new)));
        values.filter(|(_, old, new)| old != new).collect()
    }

    fn steps(&self, path: &Path, side: usize) -> Vec<TestStep> {
        let inputs: Vec<Option<&NamedInput>> =
            self.free.iter().map(|shared| shared.named[side].as_ref()).collect();
        steps(self.model, &inputs, path)
    }
}

fn text_of<T>(all: &[T], text: impl Fn(&T) -> String) -> String {
    all.iter().map(text).collect::<Vec<_>>().join(", ")
}

/// `pump`, `!pump`, `level == 3`.
fn expected(program: &RigProgram, address: Address, value: i32) -> Condition {
    let (name, none) = (program.symbols.names.name(address), Span::default());
    let (contact, text) = match address {
        Address::Bit(bit) if value != 0 => (Contact::Bit(bit, none), name),
        Address::Bit(bit) => {
            (Contact::Not(Box::new(Contact::Bit(bit, none)), none), format!("!{name}"))
        }
        Address::Word(word) => {
            let text = value_text(&program.symbols.layout, address, value);
            let constant = constant(word, value);
            let compare = Contact::Compare(Value::Word(word), Comparison::Eq, constant, none);
            (compare, format!("{name} == {text}"))
        }
        Address::Structure(_) => unreachable!("an output is a bit or a word"),
    };
    Condition::of(contact, &text, &program.symbols.layout)
}

fn constant(word: Word, value: i32) -> Value {
    match word.is_real() {
        true => Value::Real(Real::of_cell(value)),
        false => Value::Const(value, ConstantForm::Integer),
    }
}

fn value_text(layout: &Layout, address: Address, value: i32) -> String {
    match (address, layout.cell(address)) {
        (Address::Bit(_), _) => if value != 0 { "ON" } else { "OFF" }.to_owned(),
        (_, Some(cell)) => layout.text(cell, value),
        (_, None) => value.to_string(),
    }
}
