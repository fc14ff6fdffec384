//! A ladder with probes: bits that are ON at the end of a scan in which something has happened.
//!
//! Called by `drafts`. What a rung's power was, or whether a divisor was 0, is known only within a
//! scan. So rungs and instructions are added to a copy of the ladder, each right beside the place
//! that it watches, and sets a bit that no ladder can name. All probes are OFF at the start of a
//! scan. They read what the ladder reads at that place and write nothing else, so the ladder does
//! what it does without them. No controller executes the result.

use rungd_engine::isa::status::st;
use rungd_engine::isa::{Bit, BitSpace, LegName, Mnemonic, OperandRole, Structure};
use rungd_language::resolve::formula::Formula;
use rungd_language::resolve::instruction::{
    Calculation, OperandList, OperandValue, ResolvedOperand,
};
use rungd_language::resolve::program::{
    Branch, ComputedContact, Contact, Instruction, Leg, Program, Rung,
};
use rungd_language::source::span::Span;

use super::contacts::parts;
use super::mishaps::{MishapCondition, RungMishap, TagRanges, of_contacts, of_instruction};

/// What a probe of a rung watches.
#[derive(Clone, Debug)]
pub(super) enum WatchedPlace {
    /// The power of the rung, or of one of its legs or branches: what it is called.
    Power(Option<String>),
    /// Where a part of the contacts matters. The number of the probe of the power around it.
    Part(Contact, usize),
    /// A mishap in an instruction; `None`: in contacts.
    Mishap(RungMishap, Option<Instruction>),
    /// A structure that is Done behind its owner.
    Done(Structure),
}

/// A probe of a rung.
#[derive(Clone, Debug)]
pub(super) struct Probe {
    /// What it watches.
    pub watched: WatchedPlace,
    /// Its bit.
    pub bit: Bit,
    /// Where that stands.
    pub span: Span,
}

/// Makes probes for a ladder.
pub(super) struct Prober {
    ranges: TagRanges,
    /// The number of the next bit.
    next: u32,
    /// All bits so far.
    pub bits: Vec<Bit>,
}

impl Prober {
    pub fn of(program: &Program) -> Prober {
        Prober { ranges: TagRanges::of(program), next: program.sizes.c, bits: Vec::new() }
    }

    /// A bit behind the memory of the ladder.
    pub fn bit(&mut self) -> Bit {
        let bit = Bit::Space(BitSpace::C, self.next);
        self.next += 1;
        self.bits.push(bit);
        bit
    }

    /// The number of C with all bits.
    pub fn size(&self) -> u32 {
        self.next
    }

    /// A rung at the start of a Stage, which shows that it executes.
    pub fn executes(&mut self) -> (Rung, Bit) {
        let bit = self.bit();
        (added(vec![always()], set(bit)), bit)
    }

    /// A rung with its probes: rungs before it, itself, and rungs behind it.
    pub fn rung(&mut self, rung: &Rung) -> ProbedRung {
        let mut probed = ProbedRung {
            before: Vec::new(),
            rung: rung.clone(),
            behind: Vec::new(),
            probes: Vec::new(),
        };
        match rung.legs.as_slice() {
            [Leg { name: LegName::When, contacts }] => self.when(contacts, &mut probed),
            legs => legs.iter().for_each(|leg| self.leg(leg, &mut probed)),
        }
        for (_, instruction) in rung.instructions() {
            let owned = instruction.operands_with::<Structure>(OperandRole::Owns);
            for structure in owned {
                let done = structure.value.done_name();
                let Some(done) = structure.value.member(done) else { continue };
                let rungd_engine::isa::Address::Bit(done) = done else { continue };
                let bit = probed.watch(self, WatchedPlace::Done(structure.value), instruction.span);
                let done = Contact::Bit(done, Span::default());
                probed.behind.push(added(vec![done], set(bit)));
            }
        }
        probed
    }

    fn when(&mut self, contacts: &[Contact], probed: &mut ProbedRung) {
        let span = probed.rung.extent;
        let power = probed.watch(self, WatchedPlace::Power(None), span);
        let around = probed.probes.len() - 1;
        for part in parts(contacts) {
            let span = part.part.span();
            let bit = probed.watch(self, WatchedPlace::Part(part.part, around), span);
            probed.before.push(added(part.matters, set(bit)));
        }
        self.contacts(contacts, probed);
        let body = self.body(&probed.rung.body.clone(), probed);
        probed.rung.body = [set(power)].into_iter().chain(body).collect();
        let mut branches = Vec::new();
        for branch in std::mem::take(&mut probed.rung.branches) {
            self.branch(branch, &mut branches, probed);
        }
        probed.rung.branches = branches;
    }

    fn branch(&mut self, branch: Branch, all: &mut Vec<Branch>, probed: &mut ProbedRung) {
        let span = branch.contacts.first().map_or(probed.rung.extent, Contact::span);
        let name = Some("branch".to_owned());
        let power = probed.watch(self, WatchedPlace::Power(name), span);
        let around = probed.probes.len() - 1;
        all.push(Branch { contacts: branch.contacts.clone(), body: vec![set(power)] });
        for part in parts(&branch.contacts) {
            let span = part.part.span();
            let bit = probed.watch(self, WatchedPlace::Part(part.part, around), span);
            all.push(Branch { contacts: part.matters, body: vec![set(bit)] });
        }
        let body = self.body(&branch.body, probed);
        all.push(Branch { contacts: branch.contacts, body });
    }

    /// A leg with a key: its rung has one instruction, so all probes stand before it.
    fn leg(&mut self, leg: &Leg, probed: &mut ProbedRung) {
        let span = leg.contacts.first().map_or(probed.rung.extent, Contact::span);
        let name = Some(format!("leg {}", leg.name.key()));
        let power = probed.watch(self, WatchedPlace::Power(name), span);
        let around = probed.probes.len() - 1;
        probed.before.push(added(leg.contacts.clone(), set(power)));
        for part in parts(&leg.contacts) {
            let span = part.part.span();
            let bit = probed.watch(self, WatchedPlace::Part(part.part, around), span);
            probed.before.push(added(part.matters, set(bit)));
        }
        self.contacts(&leg.contacts, probed);
    }

    fn contacts(&mut self, contacts: &[Contact], probed: &mut ProbedRung) {
        for MishapCondition { mishap, condition } in of_contacts(contacts) {
            let span = contacts.first().map_or(probed.rung.extent, Contact::span);
            let bit = probed.watch(self, WatchedPlace::Mishap(mishap, None), span);
            probed.before.push(added(vec![computed(condition)], set(bit)));
        }
    }

    /// Instructions, each behind the probes of what can go wrong in it.
    fn body(&mut self, body: &[Instruction], probed: &mut ProbedRung) -> Vec<Instruction> {
        let mut all = Vec::new();
        for instruction in body {
            for MishapCondition { mishap, condition } in of_instruction(instruction, &self.ranges) {
                let watched = WatchedPlace::Mishap(mishap, Some(instruction.clone()));
                let bit = probed.watch(self, watched, instruction.span);
                all.push(math(bit, condition));
            }
            all.push(instruction.clone());
        }
        all
    }
}

/// A rung with its probes.
pub(super) struct ProbedRung {
    pub before: Vec<Rung>,
    pub rung: Rung,
    pub behind: Vec<Rung>,
    pub probes: Vec<Probe>,
}

impl ProbedRung {
    fn watch(&mut self, prober: &mut Prober, watched: WatchedPlace, span: Span) -> Bit {
        let bit = prober.bit();
        self.probes.push(Probe { watched, bit, span });
        bit
    }
}

fn always() -> Contact {
    Contact::Bit(Bit::Space(BitSpace::St, st::ON), Span::default())
}

fn computed(condition: Formula) -> Contact {
    let contact = ComputedContact { left: condition, compare: None };
    Contact::Computed(Box::new(contact), Span::default())
}

pub(crate) fn added(contacts: Vec<Contact>, instruction: Instruction) -> Rung {
    Rung {
        name: None,
        doc: None,
        allow: Vec::new(),
        extent: Span::default(),
        of_use: None,
        legs: vec![Leg { name: LegName::When, contacts }],
        body: vec![instruction],
        branches: Vec::new(),
    }
}

pub(crate) fn set(bit: Bit) -> Instruction {
    acting(Mnemonic::Set, bit)
}

/// A MATH that stores a condition in a bit.
fn math(bit: Bit, condition: Formula) -> Instruction {
    let calculation = Calculation { index: None, value: condition };
    Instruction { calculation: Some(Box::new(calculation)), ..acting(Mnemonic::Math, bit) }
}

fn acting(mnemonic: Mnemonic, bit: Bit) -> Instruction {
    let (row, span) = (&mnemonic.spec().operands[0], Span::default());
    let operand = ResolvedOperand { row, value: OperandValue::Bit(bit), span };
    Instruction { mnemonic, span, operands: OperandList(vec![operand]), calculation: None }
}
