//! The legs of an instruction as data: the contacts that decided their powers, each followed.

use std::collections::HashMap;

use super::answer::{
    ContactDetail, ContactSeen, Cut, ExplainedOperand, ExplainedValue, Followed, LegSeen,
    OperandName,
};
use super::inquiry::Inquiry;
use super::leaves::{LeafSeen, LegLogic, legs};
use super::logic::{Leaves, Logic};
use super::past::TapeMoment;
use super::replay::{Changed, SEARCHED_MAX};
use super::seen_values::SeenValue;
use rungd_engine::{BitCell, Cell};
pub use rungd_language::resolve::program::{self, Comparison};

/// The maximum number of contacts of a leg that are told in their own order, and none of them
/// folded.
pub(super) const TOLD_MAX: usize = 6;

/// The number of steps by which the explanation of a contact that is also OFF is shorter.
const ALSO_OFF_LESS: u32 = 2;

/// The contacts of a part, as they were seen in the call of an entry.
struct PartSeen<'s> {
    leaves: Leaves<'s>,
    seen: &'s [LeafSeen],
    /// For each leaf, the first leaf with the same contact.
    keys: Vec<usize>,
    /// The moment of the call.
    at: TapeMoment,
}

impl PartSeen<'_> {
    fn is_on(&self, leaf: usize) -> bool {
        self.seen.get(leaf).is_some_and(|leaf| leaf.on)
    }

    fn key(&self, leaf: usize) -> usize {
        self.keys.get(leaf).copied().unwrap_or(leaf)
    }

    /// The moment at which a contact was evaluated.
    fn moment(&self, leaf: usize) -> TapeMoment {
        let step = self.seen.get(leaf).map_or(self.at.step, |leaf| leaf.step);
        TapeMoment { step, ..self.at }
    }
}

impl Inquiry<'_> {
    /// The legs of an instruction of a part, at its execution.
    pub fn legs(
        &mut self,
        part: u32,
        seen: &[LeafSeen],
        at: TapeMoment,
        depth: u32,
    ) -> Vec<LegSeen> {
        let (legs, leaves) = legs(self.subject, part);
        let keys = keys(&leaves);
        let part = PartSeen { leaves, seen, keys, at };
        legs.iter().map(|leg| self.leg(&part, leg, depth)).collect()
    }

    fn leg(&mut self, part: &PartSeen, leg: &LegLogic, depth: u32) -> LegSeen {
        let (on, key) = (|at: usize| part.is_on(at), |at: usize| part.key(at));
        let why = leg.logic.why(&on, &key);
        let series = leg.series.iter().map(|contact| self.subject.place(contact.span()));
        let latest = self.latest(part, &why.named);
        let mut contacts: Vec<Option<ContactSeen>> = vec![None; why.named.len()];
        // The answer may become too long: the contacts that changed last are followed first.
        for at in &latest {
            contacts[*at] = Some(self.contact(part, why.named[*at], depth));
        }
        LegSeen {
            name: leg.name.key(),
            on: leg.logic.is_on(&on),
            series: series.collect(),
            contacts: contacts.into_iter().flatten().collect(),
            latest,
            also_off: why.also_off.iter().map(|at| self.also_off(part, *at, depth)).collect(),
        }
    }

    /// The order in which named contacts are told, as indices: of a few their own order, of many
    /// those first that changed last.
    fn latest(&mut self, part: &PartSeen, named: &[usize]) -> Vec<usize> {
        let mut order: Vec<usize> = (0..named.len()).collect();
        if named.len() > TOLD_MAX {
            let changed = |inquiry: &mut Self, leaf: usize| {
                let at = part.moment(leaf);
                let cells = inquiry.cells_of(part, leaf);
                let last = cells.into_iter().filter_map(|cell| {
                    match inquiry.replay.last_change(cell, at, SEARCHED_MAX) {
                        Changed::At(_, moment) => Some(moment),
                        Changed::Never(..) => None,
                    }
                });
                last.max()
            };
            let last: Vec<_> = named.iter().map(|leaf| changed(self, *leaf)).collect();
            order.sort_by_key(|at| std::cmp::Reverse(last[*at]));
        }
        order
    }

    /// The cells that a contact reads.
    fn cells_of(&self, part: &PartSeen, leaf: usize) -> Vec<Cell> {
        let Some(seen) = part.seen.get(leaf) else { return Vec::new() };
        match part.leaves.contacts[leaf] {
            program::Contact::Bit(bit, _) => {
                vec![self.subject.symbols.layout.bit_in(*bit)]
            }
            program::Contact::Edge(..) => vec![Cell::Bit(BitCell(seen.power.cell()))],
            program::Contact::Element(..)
            | program::Contact::Compare(..)
            | program::Contact::Computed(..)
            | program::Contact::Not(..)
            | program::Contact::All(..)
            | program::Contact::Any(..) => {
                seen.sides.iter().filter_map(|side| side.cell).chain(seen.selected).collect()
            }
        }
    }

    /// A contact that is also OFF. Its explanation is less deep than that of a contact that
    /// decides.
    fn also_off(&mut self, part: &PartSeen, leaf: usize, depth: u32) -> ContactSeen {
        let outer = self.owed;
        self.owed += ALSO_OFF_LESS.saturating_sub(depth);
        let contact = self.contact(part, leaf, depth.saturating_sub(ALSO_OFF_LESS));
        self.owed = outer;
        contact
    }

    fn contact(&mut self, part: &PartSeen, leaf: usize, depth: u32) -> ContactSeen {
        let contact = part.leaves.contacts[leaf];
        let place = self.subject.place(contact.span());
        ContactSeen { place, on: part.is_on(leaf), detail: self.detail(part, leaf, depth) }
    }

    fn detail(&mut self, part: &PartSeen, leaf: usize, depth: u32) -> ContactDetail {
        let at = part.moment(leaf);
        let none = || LeafSeen {
            step: at.step,
            power: rungd_engine::ops::Power::of(0),
            on: false,
            sides: Vec::new(),
            selected: None,
            computed: Vec::new(),
            is_time: false,
        };
        let seen = part.seen.get(leaf).cloned().unwrap_or_else(none);
        match part.leaves.contacts[leaf] {
            program::Contact::Bit(bit, _) => {
                let cell = self.subject.symbols.layout.bit_in(*bit);
                let (operand, followed) = self.operand(cell, i32::from(seen.on), at, depth);
                ContactDetail::Bit(operand, followed)
            }
            program::Contact::Element(..) => {
                let value = i32::from(seen.on);
                let bit = seen.selected.map(|cell| self.operand(cell, value, at, depth));
                let index = seen.sides.first().copied().unwrap_or(NO_SIDE);
                let word = index.cell.unwrap_or(Cell::Bit(BitCell(0)));
                let (operand, followed) = self.operand(word, index.value, at, depth);
                let index = ExplainedOperand { operand, value: index.value, followed };
                ContactDetail::Element { bit, index }
            }
            program::Contact::Compare(_, how, _, _) => self.compare(&seen, *how, at, depth),
            program::Contact::Computed(..) => self.computed(seen, at, depth),
            program::Contact::Edge(..) => self.edge(part, leaf, seen.power.cell(), depth),
            // These contacts are no leaves.
            program::Contact::Not(..) | program::Contact::All(..) | program::Contact::Any(..) => {
                let sides = [constant(0), constant(0)];
                ContactDetail::Compare { sides, real: [false; 2] }
            }
        }
    }

    fn operand(
        &mut self,
        cell: Cell,
        value: i32,
        at: TapeMoment,
        depth: u32,
    ) -> (OperandName, Followed) {
        if cell.is_bit() {
            self.propose(cell, vec![1 - value]);
        }
        let operand = self.subject.operand(cell);
        (operand, self.follow(cell, value, at, depth))
    }

    /// A side of a compare, or an operand of an instruction.
    pub fn side(&mut self, side: SeenValue, at: TapeMoment, depth: u32) -> ExplainedValue {
        match side.cell {
            Some(cell) => {
                let (operand, followed) = self.operand(cell, side.value, at, depth);
                ExplainedValue { value: side.value, operand: Some(operand), followed }
            }
            None => constant(side.value),
        }
    }

    fn compare(
        &mut self,
        seen: &LeafSeen,
        how: Comparison,
        at: TapeMoment,
        depth: u32,
    ) -> ContactDetail {
        let left = seen.sides.first().copied().unwrap_or(NO_SIDE);
        let right = seen.sides.get(1).copied().unwrap_or(NO_SIDE);
        if !left.real && !right.real {
            // Values at which the result of the compare changes.
            let near = |value: i32| vec![value, value.saturating_add(1), value.saturating_sub(1)];
            for (side, other) in [(left, right), (right, left)] {
                if let Some(cell @ Cell::Word(_)) = side.cell {
                    self.propose(cell, near(other.value));
                }
            }
        }
        let _ = how;
        ContactDetail::Compare {
            sides: [self.side(left, at, depth), self.side(right, at, depth)],
            real: [left.real, right.real],
        }
    }

    fn computed(&mut self, seen: LeafSeen, at: TapeMoment, depth: u32) -> ContactDetail {
        let operands = seen.sides.iter().filter_map(|side| {
            let (operand, followed) = self.operand(side.cell?, side.value, at, depth);
            Some(ExplainedOperand { operand, value: side.value, followed })
        });
        let (sides, is_time) = (seen.computed, seen.is_time);
        ContactDetail::Computed { operands: operands.collect(), sides, is_time }
    }

    fn edge(&mut self, part: &PartSeen, leaf: usize, cell: u32, depth: u32) -> ContactDetail {
        let at = part.moment(leaf);
        let last = match part.is_on(leaf) {
            true => super::answer::Since::At(self.replay.when_of(at.section, at.entry)),
            false => self.replay.since(Cell::Bit(BitCell(cell)), at, &|change| change.after == 1),
        };
        let inner = part.leaves.inner.get(leaf).cloned().flatten();
        let inner = inner.unwrap_or(Logic::All(Vec::new()));
        let (on, key) = (|at: usize| part.is_on(at), |at: usize| part.key(at));
        let named = inner.why(&on, &key).named;
        ContactDetail::Edge {
            last,
            inner_on: inner.is_on(&on),
            inner: named.iter().map(|at| self.contact(part, *at, depth)).collect(),
        }
    }
}

/// The value of a constant.
fn constant(value: i32) -> ExplainedValue {
    ExplainedValue { value, operand: None, followed: Followed::Cut(Cut::Constant) }
}

const NO_SIDE: SeenValue = SeenValue { value: 0, cell: None, real: false, adds_nothing: false };

/// For each leaf, the first leaf with the same contact. Edges are never the same, because each has
/// its own history.
fn keys(leaves: &Leaves) -> Vec<usize> {
    let mut first = HashMap::new();
    let key = |(at, contact): (usize, &&program::Contact)| {
        let text = match contact {
            program::Contact::Bit(bit, _) => format!("{bit:?}"),
            program::Contact::Element(element, _) => format!("{element:?}"),
            program::Contact::Compare(a, how, b, _) => format!("{a:?} {how:?} {b:?}"),
            program::Contact::Computed(computed, _) => format!("{computed:?}"),
            program::Contact::Not(..)
            | program::Contact::All(..)
            | program::Contact::Any(..)
            | program::Contact::Edge(..) => return at,
        };
        *first.entry(text).or_insert(at)
    };
    leaves.contacts.iter().enumerate().map(key).collect()
}
