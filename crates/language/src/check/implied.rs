//! Whether a condition follows from a condition that was ON shortly before.
//!
//! Called by `runs_through`. From contacts that are ON follow facts about bits and compares; with
//! these facts and the knowledge of what changed since, other contacts are ON, OFF, or unknown. The
//! other contacts are executed for the first time, so the history of an edge contact among them is
//! OFF: `rise(X0)` is ON if X0 is ON, and `fall(X0)` is never ON. Every answer is certain, or there
//! is none.

use std::collections::HashMap;

use crate::resolve::program::{Comparison, Contact, Edge, Value};
use rungd_engine::isa::{Bit, BitSpace, Word, status};

use super::constant_compare::{ValueCompare, holds, mirrored};

/// The maximum number of cases that the alternatives of a condition are split into.
const CASES_MAX: usize = 16;

/// The maximum number of compares that are facts.
const COMPARES_MAX: usize = 64;

/// What is known to be so.
#[derive(Clone, Default)]
pub struct KnownStates {
    bits: HashMap<Bit, bool>,
    compares: Vec<ValueCompare>,
}

/// Whether a bit or word still has the value that it had when the facts were found.
pub trait Unchanged {
    fn bit(&self, bit: Bit) -> bool;
    fn word(&self, word: Word) -> bool;
}

/// What is known if all contacts are ON: one of the cases.
pub fn cases(contacts: &[&Contact]) -> Vec<KnownStates> {
    let mut cases = vec![KnownStates::default()];
    contacts.iter().for_each(|contact| add_case(contact, &mut cases));
    cases
}

/// Splits the cases by the alternatives of a contact that is ON.
fn add_case(contact: &Contact, cases: &mut Vec<KnownStates>) {
    match contact {
        Contact::All(parts, _) => parts.iter().for_each(|part| add_case(part, cases)),
        Contact::Edge(Edge::Rise, inner, _) => add_case(inner, cases),
        // Without a fact of it, the cases are still right.
        Contact::Any(parts, _) if cases.len() * parts.len() <= CASES_MAX => {
            let before = std::mem::take(cases);
            for part in parts {
                let mut of_part = before.clone();
                add_case(part, &mut of_part);
                cases.append(&mut of_part);
            }
        }
        Contact::Bit(..)
        | Contact::Element(..)
        | Contact::Not(..)
        | Contact::Any(..)
        | Contact::Edge(Edge::Fall, ..)
        | Contact::Compare(..)
        | Contact::Computed(..) => cases.iter_mut().for_each(|facts| facts.learn(contact, true)),
    }
}

impl KnownStates {
    /// Adds what follows from a contact that is ON or OFF.
    fn learn(&mut self, contact: &Contact, is_on: bool) {
        match (contact, is_on) {
            (Contact::Bit(bit, _), _) => {
                self.bits.insert(*bit, is_on);
            }
            (Contact::Not(inner, _), _) => self.learn(inner, !is_on),
            (Contact::All(parts, _), true) | (Contact::Any(parts, _), false) => {
                parts.iter().for_each(|part| self.learn(part, is_on));
            }
            (Contact::Edge(edge, inner, _), true) => self.learn(inner, *edge == Edge::Rise),
            (Contact::Compare(left, comparison, right, _), _) => {
                let comparison = if is_on { *comparison } else { opposite(*comparison) };
                if self.compares.len() < COMPARES_MAX {
                    let compare = ValueCompare { left: *left, comparison, right: *right };
                    self.compares.push(compare);
                }
            }
            (Contact::All(..), false)
            | (Contact::Any(..), true)
            | (Contact::Edge(..), false)
            | (Contact::Element(..) | Contact::Computed(..), _) => {}
        }
    }

    /// The state of a contact at its first execution; `None` if it is not known.
    pub fn state(&self, contact: &Contact, unchanged: &impl Unchanged) -> Option<bool> {
        match contact {
            Contact::Bit(Bit::Space(BitSpace::St, status::st::ON), _) => Some(true),
            Contact::Bit(Bit::Space(BitSpace::St, status::st::OFF), _) => Some(false),
            Contact::Bit(bit, _) => self.bits.get(bit).copied().filter(|_| unchanged.bit(*bit)),
            Contact::Not(inner, _) => self.state(inner, unchanged).map(|is_on| !is_on),
            Contact::All(parts, _) => self.all(parts.iter(), unchanged),
            Contact::Any(parts, _) => {
                let states = parts.iter().map(|part| self.state(part, unchanged));
                joined(states.map(|state| state.map(|is_on| !is_on))).map(|none| !none)
            }
            Contact::Edge(Edge::Rise, inner, _) => self.state(inner, unchanged),
            Contact::Edge(Edge::Fall, ..) => Some(false),
            Contact::Compare(left, comparison, right, _) => {
                let (left, comparison, right) = (*left, *comparison, *right);
                self.compared(ValueCompare { left, comparison, right }, unchanged)
            }
            Contact::Element(..) | Contact::Computed(..) => None,
        }
    }

    /// The state of a series of contacts at its first execution.
    pub fn all<'c>(
        &self,
        contacts: impl Iterator<Item = &'c Contact>,
        unchanged: &impl Unchanged,
    ) -> Option<bool> {
        joined(contacts.map(|contact| self.state(contact, unchanged)))
    }

    fn compared(&self, wanted: ValueCompare, unchanged: &impl Unchanged) -> Option<bool> {
        let ValueCompare { left, comparison, right } = wanted;
        if ![left, right].iter().all(|value| is_unchanged(*value, unchanged)) {
            return None;
        }
        let follows = |wanted| self.compares.iter().any(|fact| implies(*fact, wanted));
        if follows(wanted) {
            return Some(true);
        }
        let opposite = ValueCompare { left, comparison: opposite(comparison), right };
        follows(opposite).then_some(false)
    }
}

/// The state of a series: OFF if one is OFF, ON if all are ON.
fn joined(states: impl Iterator<Item = Option<bool>>) -> Option<bool> {
    let mut all = Some(true);
    for state in states {
        match state {
            Some(false) => return Some(false),
            Some(true) => {}
            None => all = None,
        }
    }
    all
}

fn is_unchanged(value: Value, unchanged: &impl Unchanged) -> bool {
    match value {
        Value::Const(..) | Value::Real(_) => true,
        Value::Word(word) => unchanged.word(word),
        Value::Element(_) => false,
    }
}

/// Whether a compare follows from a compare that is true.
fn implies(fact: ValueCompare, wanted: ValueCompare) -> bool {
    let (fact, wanted) = (ordered(fact), ordered(wanted));
    if fact.left != wanted.left {
        return false;
    }
    let (Some(a), Some(b)) = (fact.right.constant(), wanted.right.constant()) else {
        return fact == wanted;
    };
    // Between these numbers neither compare changes.
    let numbers = [a, b, (a + b) / 2.0, a.min(b) - 1.0, a.max(b) + 1.0];
    numbers.iter().all(|n| !holds(*n, fact.comparison, a) || holds(*n, wanted.comparison, b))
}

/// The same compare, with its constant at the right.
fn ordered(compare: ValueCompare) -> ValueCompare {
    let ValueCompare { left, comparison, right } = compare;
    match left.constant() {
        Some(_) => ValueCompare { left: right, comparison: mirrored(comparison), right: left },
        None => compare,
    }
}

/// The compare that is true if this one is not.
fn opposite(comparison: Comparison) -> Comparison {
    match comparison {
        Comparison::Eq => Comparison::Ne,
        Comparison::Ne => Comparison::Eq,
        Comparison::Lt => Comparison::Ge,
        Comparison::Ge => Comparison::Lt,
        Comparison::Gt => Comparison::Le,
        Comparison::Le => Comparison::Gt,
    }
}
