//! One mutation of one rung, and how it is made in a program.
//!
//! A mutation names the part that it changes by numbers: a contact by its place in a walk over its
//! leg, an operand by its place in its instruction. So a rung with many mutants is not stored for
//! each. What the resolver guarantees stays true: a leg is never empty, and a group has two members
//! or more.

use crate::isa::{Bit, BitSpace, status::st};
use crate::resolve::formula::{Formula, Part};
use crate::resolve::program::{Action, Contact, Instruction, Program, Rung, Value};
use crate::source::span::Span;

use super::values::values_mut;

/// Where a rung stands in a program. Sorts as the rungs stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct RungIndex {
    /// The index of the block.
    pub block: usize,
    /// The index of the Stage in the block; `None`: the block's own rungs.
    pub stage: Option<usize>,
    /// The index of the rung.
    pub rung: usize,
}

impl RungIndex {
    /// The rungs among which it stands.
    fn rungs(self, program: &mut Program) -> &mut Vec<Rung> {
        let block = &mut program.blocks[self.block];
        match self.stage {
            None => &mut block.rungs,
            Some(stage) => &mut block.stages[stage].rungs,
        }
    }

    /// The rung.
    pub fn rung_of(self, program: &mut Program) -> &mut Rung {
        &mut self.rungs(program)[self.rung]
    }
}

/// A series of contacts of a rung.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum ContactSeries {
    /// The leg with this index.
    Leg(usize),
    /// The contacts of the branch with this index.
    Branch(usize),
}

/// Where an instruction stands in its rung.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct InstructionIndex {
    /// The branch; `None`: `do` of the rung.
    pub branch: Option<usize>,
    /// The index.
    pub at: usize,
}

/// Which formula of a MATH.
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
    /// The contact with this number in a walk over the series, each before those in it, is
    /// another one, or left out.
    Contact(ContactSeries, u32, Option<Contact>),
    /// The instruction is another one, or left out.
    Instruction(InstructionIndex, Option<Box<Instruction>>),
    /// The value with this number among those of the instruction is another one.
    Value(InstructionIndex, usize, Value),
    /// The part of a formula with this index is another one, or left out.
    Part(InstructionIndex, FormulaOf, usize, Option<Part>),
}

impl Mutation {
    /// What orders mutations of one rung: the later ones are made first, so that no number of
    /// the earlier ones changes.
    pub fn order(&self) -> (u8, usize, usize, usize) {
        let instruction = |at: &InstructionIndex| (at.branch.map_or(0, |branch| branch + 1), at.at);
        match self {
            Mutation::RungOut => (0, 0, 0, 0),
            Mutation::BranchOut(at) => (1, *at, 0, 0),
            Mutation::Contact(ContactSeries::Leg(leg), number, _) => (2, *leg, *number as usize, 0),
            Mutation::Contact(ContactSeries::Branch(at), number, _) => {
                (3, *at, *number as usize, 0)
            }
            Mutation::Instruction(at, _) => (4, instruction(at).0, instruction(at).1, 0),
            Mutation::Value(at, number, _) => (5, instruction(at).0, instruction(at).1, *number),
            Mutation::Part(at, FormulaOf::Value, part, _) => {
                (6, instruction(at).0, instruction(at).1, *part)
            }
            Mutation::Part(at, FormulaOf::Index, part, _) => {
                (7, instruction(at).0, instruction(at).1, *part)
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
            | Mutation::Part(..) => self.make_in(index.rung_of(program)),
        }
    }

    fn make_in(&self, rung: &mut Rung) {
        match self {
            Mutation::RungOut => {}
            Mutation::BranchOut(at) => drop(rung.branches.remove(*at)),
            Mutation::Contact(series, number, new) => {
                let contacts = match *series {
                    ContactSeries::Leg(at) => &mut rung.legs[at].contacts,
                    ContactSeries::Branch(at) => &mut rung.branches[at].contacts,
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
                let values = &mut values_mut(&mut body(rung, *at)[at.at].action);
                if let Some(value) = values.get_mut(*number) {
                    *value.value = *new;
                }
            }
            Mutation::Part(at, of, part, new) => {
                let action = &mut body(rung, *at)[at.at].action;
                let Some(Formula { parts }) = formula(action, *of) else { return };
                match new {
                    Some(new) => parts[*part] = *new,
                    None => drop(parts.remove(*part)),
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

fn formula(action: &mut Action, of: FormulaOf) -> Option<&mut Formula> {
    let Action::Math { formula, index, .. } = action else { return None };
    match of {
        FormulaOf::Value => Some(formula),
        FormulaOf::Index => index.as_deref_mut(),
    }
}

/// `$On`.
pub(super) fn always_on(span: Span) -> Contact {
    Contact::Bit(Bit::Space(BitSpace::St, st::ON), span)
}

/// Replaces one contact in a walk.
struct ContactWalk {
    /// The contacts before it.
    left: u32,
    /// `None`: it is left out.
    new: Option<Contact>,
}

impl ContactWalk {
    /// Whether the contact was in this series.
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

    /// Whether the contact was this one, or in it.
    fn one(&mut self, contact: &mut Contact) -> bool {
        if self.left == 0 {
            *contact = self.new.take().unwrap_or_else(|| always_on(contact.span()));
            return true;
        }
        self.left -= 1;
        match contact {
            Contact::Bit(..) | Contact::Element(..) | Contact::Compare(..) => false,
            Contact::Not(inner, _) | Contact::Edge(_, inner, _) => self.one(inner),
            Contact::All(contacts, span) | Contact::Any(contacts, span) => {
                let span = *span;
                self.series(contacts, span)
            }
        }
    }
}

/// Puts groups with one member right: the member alone.
pub(super) fn without_lone_groups(contacts: &mut [Contact]) {
    for contact in contacts {
        match contact {
            Contact::Bit(..) | Contact::Element(..) | Contact::Compare(..) => {}
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
