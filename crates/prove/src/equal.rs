//! Do two ladders drive the same outputs for every sequence of inputs?
//!
//! Called by `rungd prove --equal`. Both ladders are one model, in one memory, and its only line is
//! that all their outputs are equal. Outputs, alarms and inputs are pairs by the names of their
//! tags; what has no tag is a pair by its address.

use std::collections::HashMap;
use std::time::Instant;

use crate::answer::Way;
use crate::cone::cone;
use crate::decide::DecideLimits;
use crate::events::ModelEvents;
use crate::inputs::{addresses, brought, is_given, of_arrays, range, x_number};
use crate::model::{FreeInput, Path, ProofModel, ProofStart, Run, Target};
use crate::named_input::{InputSetting, NamedInput};
use crate::race::{Decision, OpenQuestion};
use crate::trial::steps;
use rungd_engine::isa::{
    Address, Bit, BitSpace, DeviceBit, DeviceId, Mnemonic, NumberMap, Real, Word,
};
use rungd_engine::{Cell, Layout};
use rungd_lab::rig::RigProgram;
use rungd_lab::testing::{
    self, Condition, Failure, FoundRun, Suite, TestOperand, TestStep, TriedRun, try_run,
};
use rungd_language::lower::judged::{Judges, lower_judged};
use rungd_language::resolve::beside::{Behind, beside};
use rungd_language::resolve::program::{
    Comparison, ConstantForm, Contact, Program, TagMeaning, Value,
};
use rungd_language::resolve::scope::{NamedThing, Scope};
use rungd_language::source::span::Span;

/// Two ladders, and which of their names belong together.
pub struct EqualQuestion<'a> {
    /// The ladder that is known.
    pub old: &'a Suite,
    /// The ladder that should do the same.
    pub new: &'a Suite,
    /// Names of the old ladder that the new one calls differently.
    pub map: &'a [(String, String)],
    /// More bits and words that must be equal, by their names in the old ladder.
    pub also: &'a [String],
    /// Outputs that are not compared.
    pub except: &'a [String],
    /// The limits of the answer.
    pub limits: DecideLimits,
}

/// Whether two ladders are equal.
#[derive(Clone, Debug)]
pub enum EqualAnswer {
    /// They are, for every sequence of inputs: how it was proved, and what was compared.
    Equal(Way, Vec<String>),
    /// They are not.
    Different(Box<LadderDifference>),
    /// Neither: what stood in the way, and what was looked at.
    NotDecided(Vec<String>, Vec<String>),
}

/// Two ladders that are different.
#[derive(Clone, Debug)]
pub struct LadderDifference {
    /// The scan, from 1.
    pub scan: u64,
    /// The outputs that differ: the name, the old and the new value.
    pub outputs: Vec<DifferentOutput>,
    /// The scenario: it passes on the old ladder and fails on the new one.
    pub scenario: String,
    /// Why it fails on the new one.
    pub failure: Option<Box<Failure>>,
}

/// An output that differs.
#[derive(Clone, Debug)]
pub struct DifferentOutput {
    /// Its name in the old ladder.
    pub name: String,
    /// The value that the old ladder gives it.
    pub old: String,
    /// The value that the new ladder gives it.
    pub new: String,
}

/// An output of both ladders.
struct OutputPair {
    name: String,
    old: Address,
    /// In the memory of both.
    new: Address,
    /// In the new ladder by itself.
    alone: Address,
}

/// Decides whether two ladders are equal.
///
/// # Errors
/// The ladders cannot be compared: a sentence with a remedy.
pub fn equal(question: &EqualQuestion) -> Result<EqualAnswer, String> {
    let begun = Instant::now();
    let ladders = LadderPair::of(question)?;
    let both = beside(ladders.old, ladders.new, ladders.inputs()?);
    let pairs = ladders.pairs(question, &both.second)?;
    let same: Vec<Contact> = pairs.iter().map(same).collect();
    let all = match same.as_slice() {
        [one] => one.clone(),
        _ => Contact::All(same, Span::default()),
    };
    let judged = lower_judged(
        &both.program,
        Judges { behind: std::slice::from_ref(&all), ..Judges::default() },
    );
    let free = ladders.free(&judged.code.layout, &both.second);
    let model = ProofModel {
        period: question.old.programs[0].controller.period,
        late_max: 1,
        start: ProofStart::Cold(connected(&both.program, &judged.code.layout)),
        inputs: free.iter().map(|free| free.input).collect(),
        assumed: Vec::new(),
        judged: judged.behind,
        code: judged.code,
        events: ModelEvents::default(),
    };
    let target = Target { bit: model.judged[0], value: false };
    let names = pairs.iter().map(|pair| pair.name.clone()).collect();
    let cone = cone(&model, &[target.bit]);
    Ok(match question.limits.race(begun).decide(&cone, target) {
        Decision::Never(way, _) => EqualAnswer::Equal(way, names),
        Decision::Open(OpenQuestion { covered, causes, .. }) => {
            EqualAnswer::NotDecided(causes, covered)
        }
        Decision::Found(_, path) => {
            let path = cone.widened(&path);
            let found = FoundDifference { question, model: &model, free: &free, path: &path };
            found.difference(&pairs)
        }
    })
}

/// Field devices are connected.
fn connected(program: &Program, layout: &Layout) -> Vec<(Cell, i32)> {
    let devices = (0..program.sizes.devices).map(DeviceId);
    devices.map(|id| (Cell::Bit(layout.bit(Bit::Device(id, DeviceBit::Ok))), 1)).collect()
}

/// The contact that is ON if both ladders give an output the same value.
fn same(pair: &OutputPair) -> Contact {
    let none = Span::default();
    match (pair.old, pair.new) {
        (Address::Word(old), Address::Word(new)) => {
            Contact::Compare(Value::Word(old), Comparison::Eq, Value::Word(new), none)
        }
        (Address::Bit(old), Address::Bit(new)) => {
            let [old, new] = [old, new].map(|bit| Contact::Bit(bit, none));
            let not = |contact: &Contact| Contact::Not(Box::new(contact.clone()), none);
            let neither = Contact::All(vec![not(&old), not(&new)], none);
            Contact::Any(vec![Contact::All(vec![old, new], none), neither], none)
        }
        _ => unreachable!("a pair is of two bits or of two words"),
    }
}

/// The two ladders.
struct LadderPair<'a> {
    old: &'a Program,
    new: &'a Program,
    question: &'a EqualQuestion<'a>,
    /// The names of the new ladder, by those of the old one.
    map: HashMap<&'a str, &'a str>,
}

impl<'a> LadderPair<'a> {
    fn of(question: &'a EqualQuestion<'a>) -> Result<LadderPair<'a>, String> {
        let program = |suite: &'a Suite| -> &'a Program { &suite.programs[0].program };
        let (old, new) = (program(question.old), program(question.new));
        let map = question.map.iter().map(|(old, new)| (old.as_str(), new.as_str())).collect();
        let has = |program: &Program, wanted: fn(&Address) -> bool| {
            program.operands.iter().any(|operand| wanted(&operand.address))
        };
        let is_sensaphone = |address: &Address| {
            matches!(address.structure(), Some(rungd_engine::isa::Structure::Sensaphone(_)))
        };
        if has(old, is_sensaphone) && has(new, is_sensaphone) {
            return Err("both ladders have Sensaphone counters: their 64 counters cannot stand \
                        side by side; compare ladders of which one has CTU and CTD"
                .to_owned());
        }
        let stops = |program: &Program| {
            program.instructions().any(|(_, one)| one.mnemonic == Mnemonic::Stop)
        };
        if stops(old) || stops(new) {
            return Err("a ladder with STOP ends both: take STOP away for the comparison".into());
        }
        Ok(LadderPair { old, new, question, map })
    }

    fn new_name<'n>(&self, old: &'n str) -> &'n str
    where
        'a: 'n,
    {
        self.map.get(old).copied().unwrap_or(old)
    }

    /// The input of the old ladder for each one of the new ladder that is the same input.
    fn inputs(&self) -> Result<NumberMap<Address, Address>, String> {
        let old_names: HashMap<&str, &str> =
            self.map.iter().map(|(old, new)| (*new, *old)).collect();
        let (old, mut pairs) = (Scope::of(self.old), NumberMap::default());
        let in_arrays: Vec<Address> = of_arrays(self.new).collect();
        for address in inputs_of(self.question.new) {
            if in_arrays.contains(&address) {
                let name = self.new.names.name(address);
                return Err(format!(
                    "NEW has the input {name} in an array: copy it out of the array for the \
                     comparison"
                ));
            }
            let paired = match self.new.names.tag(address) {
                None => Some(address),
                Some(name) => named(&old, old_names.get(name).copied().unwrap_or(name)),
            };
            match paired {
                Some(paired) if self.are_alike(paired, address) => {
                    pairs.insert(address, paired);
                }
                Some(paired) if self.new.names.tag(address).is_some() => {
                    let name = self.old.names.name(paired);
                    return Err(format!("`{name}` is an input of one ladder alone"));
                }
                Some(_) | None => {}
            }
        }
        Ok(pairs)
    }

    /// Whether an address of the old ladder is an input of the type of one of the new ladder.
    fn are_alike(&self, old: Address, new: Address) -> bool {
        let is_of_type = match (old, new) {
            (Address::Bit(_), Address::Bit(_)) => true,
            (Address::Word(old), Address::Word(new)) => {
                (old.is_real(), old.range()) == (new.is_real(), new.range())
            }
            _ => false,
        };
        is_of_type && (is_given(&old) || brought(self.question.old).any(|input| input == old))
    }

    /// The outputs that are compared.
    fn pairs(&self, question: &EqualQuestion, behind: &Behind) -> Result<Vec<OutputPair>, String> {
        let (old_scope, new_scope) = (Scope::of(self.old), Scope::of(self.new));
        let mut outputs = driven_by(question.old);
        for name in question.also {
            let address = named(&old_scope, name);
            outputs.push(address.ok_or(format!("OLD has no bit or word `{name}`"))?);
        }
        let mut pairs: Vec<OutputPair> = Vec::new();
        for old in outputs {
            let name = self.old.names.name(old);
            let is_known = pairs.iter().any(|pair| pair.old == old);
            if is_known || question.except.contains(&name) {
                continue;
            }
            let wanted = self.new_name(&name);
            let alone = named(&new_scope, wanted).ok_or_else(|| {
                format!(
                    "NEW has no `{wanted}`: `--map {name}=NAME` names what it is there, `--except \
                     {name}` leaves it out"
                )
            })?;
            if matches!(old, Address::Bit(_)) != matches!(alone, Address::Bit(_)) {
                return Err(format!("`{name}` is a bit in one ladder and a word in the other"));
            }
            pairs.push(OutputPair { name, old, new: behind.address(alone), alone });
        }
        let known = |address: &Address| pairs.iter().any(|pair| pair.alone == *address);
        let left = driven_by(question.new).into_iter().find(|address| !known(address));
        if let Some(address) = left {
            let name = self.new.names.name(address);
            if !question.except.contains(&name) {
                return Err(format!(
                    "OLD has no `{name}`: `--map NAME={name}` names what it is there, `--except \
                     {name}` leaves it out"
                ));
            }
        }
        if pairs.is_empty() {
            return Err("there is no output to compare: `--also NAME` names a bit or word".into());
        }
        Ok(pairs)
    }

    /// What may change before each scan: every input of both ladders, the time of day, and the
    /// times of scans.
    fn free(&self, cells: &Layout, behind: &Behind) -> Vec<SharedInput> {
        let mut all: Vec<SharedInput> = Vec::new();
        let layouts = [&self.question.old, &self.question.new].map(|suite| {
            RigProgram::new(&suite.programs[0].program, &suite.programs[0].controller)
        });
        for (side, suite) in [self.question.old, self.question.new].into_iter().enumerate() {
            let (program, moved) =
                (&suite.programs[0].program, suite.programs[0].controller.simulated());
            for address in inputs_of(suite) {
                let place = if side == 0 { address } else { behind.address(address) };
                let Some(cell) = cells.cell(place) else { continue };
                let at = match all.iter().position(|known| known.input.cell == cell) {
                    Some(at) => at,
                    None => {
                        let Some((low, high)) = range(address) else { continue };
                        let input = FreeInput { cell, low, high, cold: None };
                        all.push(SharedInput { input, named: [None, None] });
                        all.len() - 1
                    }
                };
                let own = layouts[side].symbols.layout.cell(address);
                let name = program.names.name(address);
                let input = x_number(address);
                all[at].named[side] = own.map(|cell| {
                    let operand = TestOperand { name: name.clone(), cell, input, device: None };
                    let setting = match moved.contains_key(&address) {
                        true => InputSetting::Force(operand),
                        false => InputSetting::Set(operand),
                    };
                    NamedInput { name, setting, is_written: false }
                });
            }
        }
        all
    }
}

/// An input of both ladders, or of one.
struct SharedInput {
    input: FreeInput,
    /// How a test of the old ladder sets it, and one of the new ladder.
    named: [Option<NamedInput>; 2],
}

/// The inputs of a ladder.
fn inputs_of(suite: &Suite) -> Vec<Address> {
    let named = addresses(&suite.programs[0].program).filter(is_given);
    let mut all: Vec<Address> = named.chain(brought(suite)).collect();
    all.sort_unstable();
    all.dedup();
    all
}

fn named(scope: &Scope, name: &str) -> Option<Address> {
    match scope.look_up(name).map(|found| found.thing) {
        Ok(NamedThing::Address(address @ (Address::Bit(_) | Address::Word(_)))) => Some(address),
        Ok(_) | Err(_) => None,
    }
}

/// What a ladder drives: its Y, what goes to field devices, and its alarms.
pub(crate) fn driven_by(suite: &Suite) -> Vec<Address> {
    let first = &suite.programs[0];
    let is_y = |address: &Address| matches!(address, Address::Bit(Bit::Space(BitSpace::Y, _)));
    let devices = first.controller.devices.iter();
    let driven = devices.flat_map(|device| device.outputs.iter().map(|output| output.address));
    let alarms = first.program.tags.iter().filter(|tag| tag.alarm.is_some());
    let alarms = alarms.filter_map(|tag| match tag.meaning {
        TagMeaning::Address(address) => Some(address),
        TagMeaning::Constant(..) | TagMeaning::Real(_) | TagMeaning::Array(_) => None,
    });
    let mut all: Vec<Address> =
        addresses(&first.program).filter(is_y).chain(driven).chain(alarms).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// A path after which the ladders differ.
struct FoundDifference<'a> {
    question: &'a EqualQuestion<'a>,
    model: &'a ProofModel,
    free: &'a [SharedInput],
    path: &'a Path,
}

impl FoundDifference<'_> {
    fn difference(&self, pairs: &[OutputPair]) -> EqualAnswer {
        let scan = self.path.scans.len() as u64;
        let differ = self.differing(pairs);
        let run = |side: usize, suite: &Suite| {
            let programs = testing::programs(suite);
            let name = format!("differs: {}", text_of(&differ, |(pair, ..)| pair.name.clone()));
            let mut steps = self.steps(side);
            for (pair, old, _) in &differ {
                let address = if side == 0 { pair.old } else { pair.alone };
                steps.push(TestStep::Expect(expected(&programs[0], address, *old)));
            }
            try_run(suite, &programs, FoundRun { name, set: Vec::new(), steps })
        };
        let (old, new) = (run(0, self.question.old), run(1, self.question.new));
        let TriedRun { text, is_confirmed, .. } = old;
        if !is_confirmed || new.is_confirmed {
            let cause = "the run that was found is not different in a test".to_owned();
            return EqualAnswer::NotDecided(vec![cause], vec![format!("{scan} scans")]);
        }
        let layout = &self.model.code.layout;
        let outputs = differ.iter().map(|(pair, old, new)| DifferentOutput {
            name: pair.name.clone(),
            old: value_text(layout, pair.old, *old),
            new: value_text(layout, pair.new, *new),
        });
        EqualAnswer::Different(Box::new(LadderDifference {
            scan,
            outputs: outputs.collect(),
            scenario: text,
            failure: new.failure,
        }))
    }

    /// The outputs that differ at the end, with both values.
    fn differing<'p>(&self, pairs: &'p [OutputPair]) -> Vec<(&'p OutputPair, i32, i32)> {
        let mut run = Run::new(self.model);
        self.path.scans.iter().for_each(|scan| drop(run.scan(scan)));
        let image = run.engine.image();
        let value = |address| {
            let cell: Option<Cell> = self.model.code.layout.cell(address);
            cell.map_or(0, |cell| image.value(cell))
        };
        let values = pairs.iter().map(|pair| (pair, value(pair.old), value(pair.new)));
        values.filter(|(_, old, new)| old != new).collect()
    }

    fn steps(&self, side: usize) -> Vec<TestStep> {
        let inputs: Vec<Option<&NamedInput>> =
            self.free.iter().map(|shared| shared.named[side].as_ref()).collect();
        steps(self.model, &inputs, self.path)
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
