//! One mutation of one rung, and the code that makes it in a program.
//!
//! A mutation identifies the part that it changes by numbers: a contact by its place in a walk over
//! its leg, an operand by its place in its instruction. So a mutant does not need a copy of its
//! rung. The guarantees of the resolver stay true: a leg is never empty, and a group has two or
//! more members.

use std::ops::Range;

use rungd_engine::isa::{Bit, BitSpace, status::st};
use rungd_language::resolve::formula::{Formula, FormulaPart};
use rungd_language::resolve::instruction::{Calculation, OperandValue};
use rungd_language::resolve::program::{Contact, Instruction, Program, Rung, Value};
use rungd_language::source::span::Span;

/// The place of a rung in a program. Sorts in the order of the rungs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RungIndex {
    /// The index of the block.
    pub block: usize,
    /// The index of the Stage in the block; `None`: the block's own rungs.
    pub stage: Option<usize>,
    /// The index of the rung.
    pub rung: usize,
}

impl RungIndex {
    /// The list of rungs that contains the rung.
    pub fn rungs(self, program: &mut Program) -> &mut Vec<Rung> {
        let block = &mut program.blocks[self.block];
        match self.stage {
            None => &mut block.rungs,
            Some(stage) => &mut block.stages[stage].rungs,
        }
    }

    /// The rung.
    pub fn rung_in(self, program: &Program) -> &Rung {
        let block = &program.blocks[self.block];
        let rungs = self.stage.map_or(&block.rungs, |stage| &block.stages[stage].rungs);
        &rungs[self.rung]
    }

    /// The rung, to change it.
    pub fn rung_of(self, program: &mut Program) -> &mut Rung {
        &mut self.rungs(program)[self.rung]
    }
}

/// A series of contacts of a rung.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum RungContacts {
    /// The leg with this index.
    Leg(usize),
    /// The contacts of the branch with this index.
    Branch(usize),
}

/// The place of an instruction in its rung.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct InstructionIndex {
    /// The branch; `None`: `do` of the rung.
    pub branch: Option<usize>,
    /// The index.
    pub at: usize,
}

/// A formula of a MATH.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum FormulaOf {
    /// The expression.
    Value,
    /// The index of the target.
    Index,
}

/// A mutation of one rung.
#[derive(Clone, Debug)]
pub(super) enum Mutation {
    /// The rung is left out.
    RungOut,
    /// The branch is left out.
    BranchOut(usize),
    /// A contact is replaced or left out: the contact with this number in a walk over the series,
    /// in which each contact comes before the contacts in it.
    Contact(RungContacts, u32, Option<Contact>),
    /// The instruction is replaced or left out.
    Instruction(InstructionIndex, Option<Box<Instruction>>),
    /// The value with this number among the values of the instruction is replaced.
    Value(InstructionIndex, usize, Value),
    /// A formula is changed at one place.
    Formula(InstructionIndex, FormulaOf, FormulaEdit),
}

/// A change of a formula.
#[derive(Clone, Debug)]
pub(super) enum FormulaEdit {
    /// The part with this index is replaced.
    Part(usize, FormulaPart),
    /// An operator with all its operands is replaced by one of them.
    Operand {
        /// The parts of the operator and its operands.
        all: Range<usize>,
        /// The parts of the operand that remains.
        kept: Range<usize>,
    },
}

impl FormulaEdit {
    /// Makes the change.
    pub fn make(&self, parts: &mut Vec<FormulaPart>) {
        match self {
            FormulaEdit::Part(at, new) => parts[*at] = *new,
            FormulaEdit::Operand { all, kept } => {
                parts.drain(kept.end..all.end);
                parts.drain(all.start..kept.start);
            }
        }
    }

    /// The index of the last part that it changes.
    fn last(&self) -> usize {
        match self {
            FormulaEdit::Part(at, _) => *at,
            FormulaEdit::Operand { all, .. } => all.end - 1,
        }
    }
}

impl Mutation {
    /// The key that orders the mutations of one rung. Later mutations are made first, so that the
    /// numbers in earlier ones stay valid.
    pub fn order(&self) -> (u8, usize, usize, usize) {
        let instruction = |at: &InstructionIndex| (at.branch.map_or(0, |branch| branch + 1), at.at);
        match self {
            Mutation::RungOut => (0, 0, 0, 0),
            Mutation::BranchOut(at) => (1, *at, 0, 0),
            Mutation::Contact(RungContacts::Leg(leg), number, _) => (2, *leg, *number as usize, 0),
            Mutation::Contact(RungContacts::Branch(at), number, _) => (3, *at, *number as usize, 0),
            Mutation::Instruction(at, _) => (4, instruction(at).0, instruction(at).1, 0),
            Mutation::Value(at, number, _) => (5, instruction(at).0, instruction(at).1, *number),
            Mutation::Formula(at, FormulaOf::Value, edit) => {
                (6, instruction(at).0, instruction(at).1, edit.last())
            }
            Mutation::Formula(at, FormulaOf::Index, edit) => {
                (7, instruction(at).0, instruction(at).1, edit.last())
            }
        }
    }

    /// Makes the mutation in a program.
    pub fn make(&self, program: &mut Program, index: RungIndex) {
        match self {
            Mutation::RungOut => drop(index.rungs(program).remove(index.rung)),
            Mutation::BranchOut(_)
            | Mutation::Contact(..)
            | Mutation::Instruction(..)
            | Mutation::Value(..)
            | Mutation::Formula(..) => self.make_in(index.rung_of(program)),
        }
    }

    fn make_in(&self, rung: &mut Rung) {
        match self {
            Mutation::RungOut => {}
            Mutation::BranchOut(at) => drop(rung.branches.remove(*at)),
            Mutation::Contact(series, number, new) => {
                let contacts = match *series {
                    RungContacts::Leg(at) => &mut rung.legs[at].contacts,
                    RungContacts::Branch(at) => &mut rung.branches[at].contacts,
                };
                let mut walk = ContactWalk { left: *number, new: new.clone() };
                walk.series(contacts, Span::default());
            }
            Mutation::Instruction(at, new) => {
                let body = body(rung, *at);
                match new {
                    Some(new) => body[at.at] = (**new).clone(),
                    None => drop(body.remove(at.at)),
                }
            }
            Mutation::Value(at, number, new) => {
                let operands = body(rung, *at)[at.at].operands.0.iter_mut();
                let mut values =
                    operands.filter(|operand| matches!(operand.value, OperandValue::Value(_)));
                if let Some(operand) = values.nth(*number) {
                    operand.value = OperandValue::Value(*new);
                }
            }
            Mutation::Formula(at, of, edit) => {
                let calculation = body(rung, *at)[at.at].calculation.as_deref_mut();
                if let Some(Formula { parts }) = calculation.and_then(|all| formula(all, *of)) {
                    edit.make(parts);
                }
            }
        }
    }
}

fn body(rung: &mut Rung, at: InstructionIndex) -> &mut Vec<Instruction> {
    match at.branch {
        None => &mut rung.body,
        Some(branch) => &mut rung.branches[branch].body,
    }
}

fn formula(calculation: &mut Calculation, place: FormulaOf) -> Option<&mut Formula> {
    match place {
        FormulaOf::Value => Some(&mut calculation.value),
        FormulaOf::Index => calculation.index.as_mut(),
    }
}

/// `$On`.
pub(super) fn always_on(span: Span) -> Contact {
    Contact::Bit(Bit::Space(BitSpace::St, st::ON), span)
}

/// Replaces one contact in a walk.
struct ContactWalk {
    /// The number of contacts before it.
    left: u32,
    /// The new contact; `None`: the contact is left out.
    new: Option<Contact>,
}

impl ContactWalk {
    /// Replaces the contact if it is in this series; returns whether it was.
    fn series(&mut self, contacts: &mut Vec<Contact>, around: Span) -> bool {
        for at in 0..contacts.len() {
            if self.left == 0 && self.new.is_none() {
                contacts.remove(at);
                if contacts.is_empty() {
                    contacts.push(always_on(around));
                }
                return true;
            }
            if self.one(&mut contacts[at]) {
                return true;
            }
        }
        false
    }

    /// Replaces the contact if it is this one or in it; returns whether it was.
    fn one(&mut self, contact: &mut Contact) -> bool {
        if self.left == 0 {
            *contact = self.new.take().unwrap_or_else(|| always_on(contact.span()));
            return true;
        }
        self.left -= 1;
        match contact {
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => false,
            Contact::Not(inner, _) | Contact::Edge(_, inner, _) => self.one(inner),
            Contact::All(contacts, span) | Contact::Any(contacts, span) => {
                let span = *span;
                self.series(contacts, span)
            }
        }
    }
}

/// Replaces groups with one member by the member.
pub(super) fn without_lone_groups(contacts: &mut [Contact]) {
    for contact in contacts {
        match contact {
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => {}
            Contact::Not(inner, _) | Contact::Edge(_, inner, _) => {
                without_lone_groups(std::slice::from_mut(inner));
            }
            Contact::All(members, _) | Contact::Any(members, _) => {
                without_lone_groups(members);
                if members.len() == 1 {
                    let member = members.remove(0);
                    *contact = member;
                }
            }
        }
    }
}
