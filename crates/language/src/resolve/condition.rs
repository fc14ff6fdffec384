//! Resolves the conditions of tests: every name becomes a bit, or a value in a sum.
//!
//! Called by `testing` with the names of a resolved program. Bits and values are resolved as in a
//! ladder's contacts (`contact`). A compare may also have sums of them; in a sum a bit is 0 or 1,
//! as in MATH.

use super::array::ArrayElement;
use super::program::{NamedOperand, Program, Value};
use super::scope::{NamedThing, Scope};
use super::{LoadOptions, Resolver};
use crate::source::atom::AtomKind;
use crate::source::contact::{Comparison, Edge, WrittenContact};
use crate::source::contact_sum::{Sum, SumPart, SumSign};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, advise, possible};
use crate::source::span::Span;
use rungd_engine::isa::{Address, Bit};

/// A condition over addresses.
#[derive(Clone, Debug)]
pub enum AddressCondition {
    /// A bit.
    Bit(Bit),
    /// The bit of an array that a word selects.
    Element(ArrayElement),
    /// `!`.
    Not(Box<AddressCondition>),
    /// `&`: two or more.
    All(Vec<AddressCondition>),
    /// `|`: two or more.
    Any(Vec<AddressCondition>),
    /// `rise(…)`, `fall(…)`.
    Edge(Edge, Box<AddressCondition>),
    /// A compare of two sums, each in postfix order.
    Compare(Vec<SumTerm>, Comparison, Vec<SumTerm>),
}

/// A part of a sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SumTerm {
    /// A constant or a word.
    Value(Value),
    /// A bit: 0 or 1.
    Bit(Bit),
    /// The bit of an array that a word selects: 0 or 1.
    BitElement(ArrayElement),
    /// An operator behind its two operands.
    Sign(SumSign),
}

/// A condition, and the operands that it reads.
#[derive(Clone, Debug)]
pub struct ResolvedCondition {
    /// The condition.
    pub contact: AddressCondition,
    /// The bits and words that it reads, in the order in which they are written.
    pub reads: Vec<NamedOperand>,
    /// The elements that words select, each with its name as written.
    pub elements: Vec<(String, ArrayElement)>,
}

/// The names of a program, for conditions.
pub struct ConditionNames<'a> {
    resolver: Resolver<'a>,
    elements: Vec<(String, ArrayElement)>,
}

impl<'a> ConditionNames<'a> {
    /// The names of a resolved program. `options` are not those of a load.
    pub fn of(program: &Program, options: &'a LoadOptions) -> ConditionNames<'a> {
        let mut resolver = Resolver::new(&[], options);
        resolver.scope = Scope::of(program);
        resolver.used = vec![false; program.tags.len()];
        ConditionNames { resolver, elements: Vec::new() }
    }

    /// The names.
    pub fn scope(&self) -> &Scope {
        &self.resolver.scope
    }

    /// Resolves a condition.
    ///
    /// # Errors
    /// Its mistakes.
    pub fn resolve(
        &mut self,
        written: &WrittenContact<Sum>,
    ) -> Result<ResolvedCondition, Vec<Finding>> {
        let contact = self.contact(written);
        let resolver = &mut self.resolver;
        let (reads, elements) =
            (std::mem::take(&mut resolver.named), std::mem::take(&mut self.elements));
        resolver.arrays.clear();
        resolver.constants.clear();
        let findings = std::mem::take(&mut resolver.findings);
        match contact {
            Some(contact) if findings.is_empty() => {
                let reads = reads.into_iter().map(|(_, operand)| operand).collect();
                Ok(ResolvedCondition { contact, reads, elements })
            }
            Some(_) | None => {
                let of_test = |finding: Finding| finding.declared_as(not_in_ladder);
                Err(findings.into_iter().map(of_test).collect())
            }
        }
    }

    fn contact(&mut self, written: &WrittenContact<Sum>) -> Option<AddressCondition> {
        match written {
            WrittenContact::Bit(name) if self.is_difference(&name.value, name.span) => None,
            WrittenContact::Bit(name) => match self.resolver.bit(&name.value, name.span)? {
                super::program::Contact::Element(element, _) => {
                    self.elements.push((name.value.clone(), element));
                    Some(AddressCondition::Element(element))
                }
                super::program::Contact::Bit(bit, _) => Some(AddressCondition::Bit(bit)),
                super::program::Contact::Not(..)
                | super::program::Contact::All(..)
                | super::program::Contact::Any(..)
                | super::program::Contact::Edge(..)
                | super::program::Contact::Compare(..) => None,
            },
            WrittenContact::Not(inner, _) => {
                Some(AddressCondition::Not(Box::new(self.contact(inner)?)))
            }
            WrittenContact::All(items, _) => Some(AddressCondition::All(self.all_of(items)?)),
            WrittenContact::Any(items, _) => Some(AddressCondition::Any(self.all_of(items)?)),
            WrittenContact::Edge(edge, inner, _) => {
                Some(AddressCondition::Edge(*edge, Box::new(self.contact(inner)?)))
            }
            WrittenContact::Compare(a, comparison, b, _) => {
                let (a, b) = (self.sum(a), self.sum(b));
                Some(AddressCondition::Compare(a?, *comparison, b?))
            }
        }
    }

    fn all_of(&mut self, items: &[WrittenContact<Sum>]) -> Option<Vec<AddressCondition>> {
        let all: Vec<AddressCondition> =
            items.iter().filter_map(|item| self.contact(item)).collect();
        (all.len() == items.len()).then_some(all)
    }

    fn sum(&mut self, sum: &Sum) -> Option<Vec<SumTerm>> {
        let has_signs = sum.parts.len() > 1;
        let mut terms = Vec::new();
        for part in &sum.parts {
            terms.extend(match part {
                SumPart::Sign(sign) => Some(SumTerm::Sign(*sign)),
                SumPart::Value(atom) => match &atom.kind {
                    AtomKind::Name(name) if self.is_difference(name, atom.span) => None,
                    AtomKind::Name(name) if has_signs && self.is_bit(name) => {
                        self.bit_term(name, atom.span)
                    }
                    AtomKind::Name(name) => {
                        let value = self.resolver.value(atom);
                        if let Some(Value::Element(element)) = value {
                            self.elements.push((name.clone(), element));
                        }
                        value.map(SumTerm::Value)
                    }
                    AtomKind::Integer(_) | AtomKind::Duration(_) | AtomKind::Real(_) => {
                        self.resolver.value(atom).map(SumTerm::Value)
                    }
                },
            });
        }
        let is_complete = terms.len() == sum.parts.len();
        (is_complete && !self.ands_a_real(sum, &terms)).then_some(terms)
    }

    /// Reports an `&` of a real; returns whether it did.
    fn ands_a_real(&mut self, sum: &Sum, terms: &[SumTerm]) -> bool {
        let mut waiting: Vec<bool> = Vec::new();
        for term in terms {
            let is_real = match term {
                SumTerm::Bit(_) | SumTerm::BitElement(_) => false,
                SumTerm::Value(value) => value.is_real(),
                SumTerm::Sign(sign) => {
                    let (b, a) = (waiting.pop() == Some(true), waiting.pop() == Some(true));
                    if *sign == SumSign::And && (a || b) {
                        let message = "`&` works on the bits of integers, not on a real";
                        let finding = Finding::new(Code::OperandType, sum.span, message);
                        let help = "compare the real by itself: `level > 2.5`";
                        self.resolver.findings.push(finding.help(help));
                        return true;
                    }
                    a || b
                }
            };
            waiting.push(is_real);
        }
        false
    }

    /// Reports `D0-D1`, which is read as one name; returns whether it did.
    fn is_difference(&mut self, name: &str, span: Span) -> bool {
        let scope = &self.resolver.scope;
        let Some((left, right)) = name.split_once('-') else { return false };
        if scope.look_up(name).is_ok() || scope.look_up(left).is_err() {
            return false;
        }
        let finding = Finding::new(Code::ContactSyntax, span, "a minus without spaces around it");
        self.resolver.findings.push(finding.write(format!("{left} - {right}")));
        true
    }

    fn is_bit(&self, name: &str) -> bool {
        match self.resolver.scope.look_up(name).map(|found| found.thing) {
            Ok(NamedThing::Address(Address::Bit(_))) => true,
            Ok(NamedThing::Element(element)) => element.array.is_bits(),
            Ok(
                NamedThing::Address(_)
                | NamedThing::Constant(..)
                | NamedThing::Real(_)
                | NamedThing::Block(_)
                | NamedThing::Device(_)
                | NamedThing::Array(_),
            )
            | Err(_) => false,
        }
    }

    fn bit_term(&mut self, name: &str, span: Span) -> Option<SumTerm> {
        let written =
            WrittenContact::Bit(crate::source::span::Located { value: name.to_owned(), span });
        match self.contact(&written)? {
            AddressCondition::Bit(bit) => Some(SumTerm::Bit(bit)),
            AddressCondition::Element(element) => Some(SumTerm::BitElement(element)),
            AddressCondition::Not(_)
            | AddressCondition::All(_)
            | AddressCondition::Any(_)
            | AddressCondition::Edge(..)
            | AddressCondition::Compare(..) => None,
        }
    }
}

/// The help for a name that no ladder has.
pub fn not_in_ladder() -> Help {
    let words = "it is in no ladder: name a tag of the ladder, an address as `{}`, a block's \
                 `Main.Running`, a Stage's `Drain.Open`";
    advise(words, [possible("D0")])
}
