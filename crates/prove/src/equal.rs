//! Do two ladders drive the same outputs for every sequence of inputs?
//!
//! Called by `rungd prove --equal`. Both ladders are one model, in one memory, and its only line is
//! that all their outputs are equal. Outputs, alarms and inputs are pairs by the names of their
//! tags; what has no tag is a pair by its address.

use std::collections::HashMap;
use std::time::Instant;

use crate::asked_events::{DOWN_SECONDS, EventQuestion, has_older_images, retains};
use crate::cone::cone;
pub use crate::equal_answer::{DifferentOutput, EqualAnswer, EqualQuestion, LadderDifference};
use crate::equal_answer::{OutputPair, SharedInput};
use crate::equal_difference::FoundDifference;
use crate::events::ModelEvents;
use crate::inputs::{addresses, brought, is_given, of_arrays, range, x_number};
use crate::model::{FreeInput, ProofModel, ProofStart, Target};
use crate::named_input::{InputSetting, NamedInput};
use crate::race::{Decision, OpenQuestion};
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{Address, Bit, BitSpace, DeviceBit, DeviceId, Mnemonic, NumberMap};
use rungd_engine::{Cell, EngineProgram, Layout};
use rungd_lab::rig::RigProgram;
use rungd_lab::testing::{ProofEvent, Suite, TestOperand};
use rungd_language::lower::judged::{JudgeBlocks, Judges, lower_judged};
use rungd_language::resolve::beside::{Behind, ProgramsBeside, beside};
use rungd_language::resolve::program::{Comparison, Contact, Program, TagMeaning, Value};
use rungd_language::resolve::scope::{NamedThing, Scope};
use rungd_language::source::span::Span;

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
    let mut free = ladders.free(&judged.code.layout, &both.second);
    let mut code = judged.code;
    let events = ladders.events(&both, judged.judges, &mut code);
    free.extend(events.down.map(SharedInput::down));
    let model = ProofModel {
        stage_starts: Vec::new(),
        period: question.old.programs[0].controller.period,
        late_max: 1,
        start: ProofStart::Cold(connected(&both.program, &code.layout)),
        inputs: free.iter().map(|free| free.input).collect(),
        assumed: Vec::new(),
        judged: judged.behind,
        code,
        events,
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

/// Refuses ladders of which one is scanned, or kept in an image, more often than the other one: the
/// model has one time for both.
fn have_same_times(question: &EqualQuestion) -> Result<(), String> {
    let [old, new] = [question.old, question.new].map(|suite| &suite.programs[0].controller);
    if old.period != new.period {
        let [old, new] = [old.period, new.period].map(ScanPeriod::words);
        return Err(format!(
            "the period of OLD is {old} and that of NEW {new}: compare them with the same period; \
             `--period` is that of a ladder without a controller file"
        ));
    }
    let [old, new] = [old, new].map(|controller| controller.retention.interval_ms);
    let has_images = [question.old, question.new].into_iter().all(retains);
    if old != new && has_images && question.events.contains(&ProofEvent::PowerCut) {
        return Err(format!(
            "the `interval` of `[retain]` is {old} ms in OLD and {new} ms in NEW: compare them \
             with the same one, or without power cuts"
        ));
    }
    Ok(())
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
        have_same_times(question)?;
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
        let begins = |event: &ProofEvent| *event != ProofEvent::Stop;
        if question.events.iter().any(begins) && retains(question.old) != retains(question.new) {
            return Err("one ladder retains something and the other one nothing: its processes \
                        begin otherwise; compare them without power cuts and restarts, or let both \
                        retain something"
                .to_owned());
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

    /// What may happen to both controllers. What each retains is its own.
    fn events(
        &self,
        both: &ProgramsBeside,
        judges: JudgeBlocks,
        code: &mut EngineProgram,
    ) -> ModelEvents {
        let EqualQuestion { old, new, events, .. } = *self.question;
        let of_new = new.programs[0].controller.retain.iter();
        let mut retain = old.programs[0].controller.retain.clone();
        retain.extend(of_new.map(|range| both.second.range(range)));
        let asked = EventQuestion {
            asked: events,
            retain: &retain,
            has_older_images: has_older_images(old) || has_older_images(new),
            reads_down_seconds: addresses(&both.program).any(|address| address == DOWN_SECONDS),
            observer: None,
            program: &both.program,
            judges,
            remembered: &[],
        };
        asked.events(code)
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
