//! Does a mistake in the contacts of rungs change anything?
//!
//! Called by `rungd mutate` for the mistakes that no test notices. A probe before each changed leg
//! turns ON in a scan in which the leg is ON without the mistake and OFF with it, or the reverse.
//! While no probe has come, the ladder has done the same with the mistake: the probe evaluates both
//! legs where the ladder does, and nothing else is different. So a mistake is shown to change
//! nothing if no probe can ever come. That is asked from a cold start and with any retained values,
//! for all inputs, and for what the tests write; where the tests do more than that, nothing is
//! shown. The effort is counted, so the answer is the same on every machine.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::cone::cone;
use crate::decide::DecideLimits;
use crate::inputs::range;
use crate::model::Target;
use crate::question::{ModelWithNames, ModelledProgram};
use crate::race::{Decision, Effort};
use crate::survey::contacts::not;
use crate::survey::mishaps::of_contacts;
use crate::survey::probes::{added, set};
use crate::survey::walks::walks;
use rungd_engine::Cell;
use rungd_engine::isa::status::{dst, st};
use rungd_engine::isa::{Address, Bit, BitSpace, DeviceBit, DeviceId, Mnemonic, Word, WordSpace};
use rungd_lab::rig::RigProgram;
use rungd_lab::testing::{
    FreeOperand, Incident, ProofEvent, Reload, RungIndex, Suite, TestOperand, TestStep,
    UnnoticedMutant,
};
use rungd_language::lower::judged::Judges;
use rungd_language::resolve::program::{BlockKind, Branch, Contact, Program, Rung};
use rungd_language::source::span::Span;

/// The end of an answer, which the counted effort does not reach.
const TIME: Duration = Duration::from_secs(60);
/// The memory for states, bytes.
const MEMORY: usize = 1 << 28;
/// The number of operations that walks execute, about. Most mistakes change something, and soon.
const OPERATIONS: u64 = 2_000_000;
/// The maximum number of periods between two scans.
const LATE_MAX: u32 = 100;

/// Whether a mistake is shown to change nothing. `false`: it is not shown.
pub fn changes_nothing(mutant: &UnnoticedMutant, given_up: &Arc<AtomicBool>) -> bool {
    let first = &mutant.suite.programs[0];
    let lowered = RigProgram::new(&first.program, &first.controller);
    let Some(suite) = free_suite(mutant.suite, &lowered) else { return false };
    let Some(probed) = probed(&first.program, mutant) else { return false };
    let judges = Judges { behind: &probed.asked, cleared: &probed.probes, ..Judges::default() };
    let asked = ModelledProgram { program: &probed.program, judges };
    let ModelWithNames { model, unknown, .. } = asked.model(&suite, &lowered);
    if unknown.is_some() {
        return false;
    }
    let target = Target { bit: model.judged[0], value: true };
    let cone = cone(&model, &[target.bit]);
    let is_given_up = || given_up.load(Ordering::Relaxed);
    let seen = walks(&cone.model, OPERATIONS, &is_given_up);
    if is_given_up() || seen.iter().any(Option::is_some) {
        return false;
    }
    let limits = DecideLimits { time: TIME, memory: MEMORY, given_up: Arc::clone(given_up) };
    let race = limits.race(Instant::now());
    matches!(race.decide_by_effort(&cone, target, Effort::MISTAKE), Decision::Never(..))
}

/// A ladder with its probes.
struct ProbedMistake {
    program: Program,
    probes: Vec<Bit>,
    /// The condition that a probe is ON.
    asked: Vec<Contact>,
}

/// Puts a probe before each changed leg; `None`: a leg has an effect that no probe sees.
fn probed(program: &Program, mutant: &UnnoticedMutant) -> Option<ProbedMistake> {
    let mut probed = program.clone();
    let mut next = program.sizes.c;
    let mut probes = Vec::new();
    for index in &mutant.rungs {
        if probed.blocks[index.block].kind == BlockKind::LastScan {
            return None;
        }
        let mistaken = index.rung_in(mutant.mutated);
        for contacts in legs(index.rung_in(program)).chain(legs(mistaken)) {
            // A division by zero also turns a status bit ON, whatever the power.
            if !of_contacts(contacts).is_empty() {
                return None;
            }
        }
        let mut probe = || {
            let bit = Bit::Space(BitSpace::C, next);
            next += 1;
            probes.push(bit);
            bit
        };
        put_probes(*index, &mut probed, mistaken, &mut probe);
    }
    probed.sizes.c = next;
    let bits: Vec<Contact> = probes.iter().map(|bit| Contact::Bit(*bit, Span::default())).collect();
    let asked = match bits.as_slice() {
        [one] => one.clone(),
        _ => Contact::Any(bits, Span::default()),
    };
    Some(ProbedMistake { program: probed, probes, asked: vec![asked] })
}

/// The contacts of a rung, by leg and branch.
fn legs(rung: &Rung) -> impl Iterator<Item = &[Contact]> {
    let of_branches = rung.branches.iter().map(|branch| branch.contacts.as_slice());
    rung.legs.iter().map(|leg| leg.contacts.as_slice()).chain(of_branches)
}

/// Puts the probes of a rung into a program: rungs before it, and branches before its own.
fn put_probes(
    index: RungIndex,
    program: &mut Program,
    mistaken: &Rung,
    probe: &mut impl FnMut() -> Bit,
) {
    let rung = index.rung_of(program);
    let mut before = Vec::new();
    for (leg, other) in rung.legs.iter().zip(&mistaken.legs) {
        before.push(added(vec![differ(&leg.contacts, &other.contacts)], set(probe())));
    }
    let mut branches = Vec::new();
    for (branch, other) in std::mem::take(&mut rung.branches).into_iter().zip(&mistaken.branches) {
        let contacts = vec![differ(&branch.contacts, &other.contacts)];
        branches.push(Branch { contacts, body: vec![set(probe())] });
        branches.push(branch);
    }
    rung.branches = branches;
    let rungs = index.rungs(program);
    rungs.splice(index.rung..index.rung, before);
}

/// The contact that is ON where two legs have different powers.
fn differ(a: &[Contact], b: &[Contact]) -> Contact {
    let none = Span::default();
    let [a, b] = [a, b].map(|contacts| Contact::All(contacts.to_vec(), none));
    let one = Contact::All(vec![a.clone(), not(b.clone())], none);
    let other = Contact::All(vec![not(a), b], none);
    Contact::Any(vec![one, other], none)
}

/// The test file with everything free that its tests may change; `None`: they do what no proof is
/// about.
fn free_suite(suite: &Suite, lowered: &RigProgram) -> Option<Suite> {
    let mut free = suite.clone();
    free.programs.truncate(1);
    free.always = vec![Vec::new()];
    (free.scenarios, free.randoms) = (Vec::new(), Vec::new());
    let first = &mut free.programs[0];
    first.view = None;
    let is_shift =
        |program: &Program| program.instructions().any(|(_, one)| one.mnemonic == Mnemonic::Sr);
    if !first.controller.retain.is_empty() && is_shift(&first.program) {
        return None;
    }
    let mut writable = unmodelled(&first.program, lowered);
    writable.extend(written(suite, lowered)?);
    let proof = &mut free.proof;
    (proof.inputs, proof.assume, proof.any) = (None, Vec::new(), Vec::new());
    proof.can = Vec::new();
    (proof.events, proof.writable) = (vec![ProofEvent::Writes], writable);
    (proof.late_max, proof.from_retained) = (late_max(suite)?, true);
    Some(free)
}

/// What changes outside of the ladder, and no model computes: the health of field devices, times of
/// scans, forces, and the last scan.
fn unmodelled(program: &Program, lowered: &RigProgram) -> Vec<FreeOperand> {
    let devices = (0..program.devices.len() as u32).map(DeviceId);
    let health =
        devices.flat_map(|id| [DeviceBit::Ok, DeviceBit::Stale].map(|bit| Bit::Device(id, bit)));
    let status = [st::LAST_SCAN, st::FORCES_ACTIVE].map(|n| Bit::Space(BitSpace::St, n));
    let times = dst::SCAN_TIME_US..=dst::LAST_SCAN_TIME_US;
    let words = times.chain([dst::DOWN_SECONDS]).map(|n| Word::Space(WordSpace::Dst, n));
    let all = health.chain(status).map(Address::Bit).chain(words.map(Address::Word));
    all.filter_map(|address| free_operand(address, lowered)).collect()
}

/// An operand that has any value before each scan.
fn free_operand(address: Address, lowered: &RigProgram) -> Option<FreeOperand> {
    let cell = lowered.symbols.layout.cell(address)?;
    let (low, high) = range(address)?;
    if matches!(cell, Cell::WordBit(_)) {
        return None;
    }
    let name = lowered.symbols.names.name(address);
    Some(FreeOperand { operand: TestOperand { name, cell, input: None, device: None }, low, high })
}

/// What the tests write beside inputs; `None`: they force, stop or reload, or write a part of a
/// structure or of a word.
fn written(suite: &Suite, lowered: &RigProgram) -> Option<Vec<FreeOperand>> {
    let mut operands: Vec<&TestOperand> = Vec::new();
    for scenario in &suite.scenarios {
        operands.extend(scenario.set.iter().map(|(operand, _)| operand));
        for step in &scenario.steps {
            operands.extend(of_step(&step.value)?);
        }
    }
    for random in &suite.randoms {
        if random.incidents.iter().any(|one| matches!(one.incident, Incident::Stop)) {
            return None;
        }
        operands.extend(random.set.iter().map(|(operand, _)| operand));
        operands.extend(random.changes.iter().map(|change| &change.operand));
    }
    // An input is free anyway; a plant's own memory is no part of the ladder.
    operands.retain(|operand| operand.input.is_none() && operand.device.is_none());
    let mut all = Vec::new();
    for operand in operands {
        let address = lowered.symbols.layout.address(operand.cell)?;
        let is_plain = match address {
            Address::Bit(bit) => matches!(bit, Bit::Space(..) | Bit::Device(..)),
            Address::Word(word) => matches!(word, Word::Space(..)),
            Address::Structure(_) => false,
        };
        all.push(is_plain.then(|| free_operand(address, lowered)).flatten()?);
    }
    Some(all)
}

/// What a step writes; `None`: it does what no proof is about.
fn of_step(step: &TestStep) -> Option<Option<&TestOperand>> {
    match step {
        TestStep::Set(operand, _)
        | TestStep::Pulse { operand, .. }
        | TestStep::Beat { operand, .. } => Some(Some(operand)),
        TestStep::Force(operand, _) => operand.input.is_some().then_some(None),
        TestStep::Stop | TestStep::Start | TestStep::Reload(Reload::To(_)) => None,
        TestStep::Unforce(_)
        | TestStep::Run(_)
        | TestStep::Late(_)
        | TestStep::Expect(_)
        | TestStep::Within(..)
        | TestStep::Hold(..)
        | TestStep::Restart { .. }
        | TestStep::PowerCut(_)
        | TestStep::Reload(Reload::Refused(_))
        | TestStep::Lose(_)
        | TestStep::Restore(_)
        | TestStep::Clock(_) => Some(None),
    }
}

/// The maximum number of periods from one scan to the next; `None`: too many.
fn late_max(suite: &Suite) -> Option<u32> {
    let steps = suite.scenarios.iter().flat_map(|scenario| &scenario.steps);
    let late = steps.filter_map(|step| {
        let TestStep::Late(periods) = step.value else { return None };
        Some(periods.saturating_add(1))
    });
    late.max().map_or(Some(1), |most| (most <= LATE_MAX).then_some(most))
}
