//! Resolves the conditions of tests and of `[[watch]]`, which are contacts over the names of a
//! resolved program.
//!
//! Called by `testing` and `controller`. `contact` resolves them, as those of a ladder.

use super::array::ArrayElement;
use super::observed::{ObservedProgram, Remembered, remembered};
use super::program::{Contact, NamedOperand, Program, TagMeaning};
use super::resolver::ConditionText;
use super::scope::{NamedThing, Scope};
use super::{LoadOptions, Resolver};
use crate::source::condition::WrittenCondition;
use crate::source::finding::{Finding, Severity};
use crate::source::fix::{Help, advise, possible};
use crate::source::span::Located;
use crate::source::was;

/// A condition, and the operands that it reads.
#[derive(Clone, Debug)]
pub struct ResolvedCondition {
    /// The condition.
    pub contact: Contact,
    /// The bits and words that it reads, in the order in which they are written.
    pub reads: Vec<NamedOperand>,
    /// The elements that words select, each with its name as written.
    pub elements: Vec<(String, ArrayElement)>,
}

/// The names of a program, for conditions.
pub struct ConditionNames<'a> {
    resolver: Resolver<'a>,
}

impl<'a> ConditionNames<'a> {
    /// The names of a resolved program. `options` are not those of a load.
    pub fn of(program: &Program, options: &'a LoadOptions) -> ConditionNames<'a> {
        let mut resolver = Resolver::new(&[], options);
        resolver.scope = Scope::of(program);
        resolver.used = vec![false; program.tags.len()];
        ConditionNames { resolver }
    }

    /// The names of a program that its tests observe.
    pub fn observing(observed: &ObservedProgram, options: &'a LoadOptions) -> ConditionNames<'a> {
        let mut names = ConditionNames::of(&observed.program, options);
        let resolver = &mut names.resolver;
        resolver.scope = Scope::within(&observed.program, observed.sizes.clone());
        let was = observed.was.iter().map(|Remembered { name, kept, .. }| (name, kept));
        let shown = observed.shown.iter().map(|shown| (&shown.name, &shown.address));
        for (name, place) in was.chain(shown) {
            let meaning = Some(TagMeaning::Address(*place));
            resolver.scope.add_tag(name, resolver.used.len(), meaning);
            resolver.used.push(false);
        }
        names
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
        written: &WrittenCondition,
    ) -> Result<ResolvedCondition, Vec<Finding>> {
        let mistakes: Vec<Finding> = was::names(&written.contact)
            .into_iter()
            .filter_map(|Located { value, span }| {
                let span = was::place_of_x(written.text_of(span), span);
                remembered(self.scope(), &value, span).err()
            })
            .map(|finding| finding.declared_as(not_in_ladder))
            .collect();
        if !mistakes.is_empty() {
            return Err(mistakes);
        }
        let resolver = &mut self.resolver;
        let WrittenCondition { text, span, contact } = written;
        resolver.condition = Some(ConditionText { text: text.clone(), span: *span });
        let contact = resolver.contact(contact);
        resolver.condition = None;
        let reads = std::mem::take(&mut resolver.named);
        let arrays = std::mem::take(&mut resolver.arrays);
        resolver.constants.clear();
        resolver.elements = 0;
        let findings = std::mem::take(&mut resolver.findings);
        match contact {
            Some(contact) if !findings.iter().any(is_error) => {
                let reads = reads.into_iter().map(|(_, operand)| operand).collect();
                let scope = &resolver.scope;
                let elements = arrays.into_iter().filter_map(|(_, array)| {
                    match scope.look_up(&array.name).map(|found| found.thing) {
                        Ok(NamedThing::Element(element)) => Some((array.name, element)),
                        Ok(_) | Err(_) => None,
                    }
                });
                Ok(ResolvedCondition { contact, reads, elements: elements.collect() })
            }
            Some(_) | None => {
                let of_test = |finding: Finding| finding.declared_as(not_in_ladder);
                Err(findings.into_iter().map(of_test).collect())
            }
        }
    }
}

fn is_error(finding: &Finding) -> bool {
    finding.severity() == Severity::Error
}

/// The help for a name that no ladder has.
pub fn not_in_ladder() -> Help {
    let words = "it is in no ladder: name a tag of the ladder, an address as `{}`, a block's \
                 `Main.Running`, a Stage's `Drain.Open`";
    advise(words, [possible("D0")])
}
