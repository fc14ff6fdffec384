//! Resolves tags with a `count`: the program gets a tag for each element.
//!
//! Called by `declare`. So limits, initial values, logs, retention and reloads refer to elements by
//! name (`recipe[3]`) and need no code for arrays.

use super::Resolver;
use super::alarm_terms::AlarmTerms;
use super::array::Array;
use super::mistake::address_mistake;
use super::names::kept;
use super::program::{OfArray, Program, Tag, TagMeaning};
use super::tag::TagLimits;
use super::tag_texts::HeldNumbers;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{pair, possible, text};
use crate::source::indexed::{INDEX, with_index};
use crate::source::ladder;
use crate::source::span::{Located, Span};
use crate::source::tag::COUNT_MIN;
use rungd_engine::isa::address_text::{self, AddressError};
use rungd_engine::isa::{Address, BitSpace, Space, WordSpace};

/// Maximum number of elements of the arrays of all tags together: more than all memory has.
const ELEMENTS_MAX: usize = 1_000_000;

type ArrayCell = Option<(i32, Span)>;

impl Resolver<'_> {
    /// Resolves an array and adds its elements to the program; returns its meaning.
    pub(super) fn array_tag(
        &mut self,
        tag: &ladder::WrittenTag,
        count: &Located<i64>,
        program: &mut Program,
    ) -> Option<TagMeaning> {
        self.long_alarm(tag);
        let meaning = self.meaning(tag)?;
        let array = self.array(tag, meaning, count)?;
        self.take_elements(array.count, count.span)?;
        self.misfits(tag, meaning);
        self.no_record(tag);
        if let Some(alarm) = &tag.alarm {
            let message = "`alarm` does not go with `count`";
            let finding = Finding::new(Code::TagKey, alarm.span, message);
            self.find(match &tag.field {
                Some(field) => finding
                    .related(field.tag.span, "this tag has a `count`")
                    .help("an `alarm` is of one bit: leave it to the fields of single records")
                    .or_omit(),
                None => {
                    let element = array.element(0);
                    finding.help(format!("give the bit a tag of its own: `at = \"{element}\"`"))
                }
            });
        }
        let mut cell =
            |value: &Option<_>| value.as_ref().and_then(|value| self.tag_value(value, meaning));
        let initial = cell(&tag.initial);
        let limits = self.limits(tag, meaning);
        let texts = self.value_texts(tag, HeldNumbers::new(meaning, &limits));
        let TagLimits { min, max } = limits;
        let list = self.initial_list(tag, meaning, array.count);
        let column = column(tag);
        for at in 0..array.count {
            let own = list.get(at as usize).copied().flatten();
            program.tags.push(Tag {
                name: with_index(&column, &at.to_string()),
                span: tag.name.span,
                doc: tag.doc.clone().filter(|_| at == 0),
                meaning: TagMeaning::Address(array.element(at)),
                initial: own.or(initial),
                min,
                max,
                alarm: None,
                terms: AlarmTerms::default(),
                log_changes: tag.log.is_some(),
                unit: tag.unit.clone(),
                texts: texts.clone(),
                metric: tag.metric.as_ref().is_some_and(|metric| metric.value),
                spare: tag.spare.as_ref().is_some_and(|spare| spare.value),
                used: false,
                of_array: Some(OfArray { array, at }),
            });
            // All elements have the same limits: one finding is enough.
            if at == 0 || own.is_some() {
                let tag = program.tags[program.tags.len() - 1].clone();
                self.ranges(&tag);
            }
        }
        Some(TagMeaning::Array(array))
    }

    /// Takes room for the elements of an array; reports once if there is too little.
    fn take_elements(&mut self, count: u32, span: Span) -> Option<()> {
        let had_room = self.tag_elements <= ELEMENTS_MAX;
        self.tag_elements = self.tag_elements.saturating_add(count as usize);
        if self.tag_elements <= ELEMENTS_MAX {
            return Some(());
        }
        if had_room {
            let message = format!("the arrays of all tags have more than {ELEMENTS_MAX} elements");
            let finding = Finding::new(Code::TagKey, span, message);
            let help = "take arrays away that have the same addresses: all memory has fewer";
            self.find(finding.label("no room from here on").help(help));
        }
        None
    }

    fn array(
        &mut self,
        tag: &ladder::WrittenTag,
        meaning: TagMeaning,
        count: &Located<i64>,
    ) -> Option<Array> {
        let address = match meaning {
            TagMeaning::Address(address) => Some(address),
            TagMeaning::Constant(..) | TagMeaning::Real(_) | TagMeaning::Array(_) => None,
        };
        let plain = address.filter(|address| match address {
            Address::Bit(_) | Address::Word(_) => true,
            // With an address, each structure has a name already.
            Address::Structure(_) => tag.kind.is_some(),
        });
        let status =
            |space| matches!(space, Space::Bit(BitSpace::St) | Space::Word(WordSpace::Dst));
        let Some((space, first)) = plain.and_then(Space::of).filter(|(space, _)| !status(*space))
        else {
            let message = "`count` does not fit this tag";
            let finding = Finding::new(Code::TagKey, count.span, message);
            let help = "arrays are of bits or words: `at = \"D10\"`, `at = \"C0\"`";
            self.find(finding.help(help).or_omit());
            return None;
        };
        let is_structure = matches!(space, Space::Counter | Space::Timer | Space::Sensaphone);
        if count.value < COUNT_MIN && tag.field.is_none() && !is_structure {
            let message = format!("`count` of a tag lies outside {COUNT_MIN}..4096");
            let finding = Finding::new(Code::OutOfRange, count.span, message);
            self.find(finding.fix(text(COUNT_MIN.to_string())));
            return None;
        }
        let count = u32::try_from(count.value).ok()?;
        let array = Array { space, first, count, member: None, bit: None };
        let last = array.element(count - 1).to_string();
        if let (Err(error), Some(at)) = (address_text::parse(&last, &self.options.sizes), &tag.at) {
            let highest = if let AddressError::BeyondMemory { space, last, .. } = &error {
                (last + 1).checked_sub(count).map(|first| format!("{space}{first}"))
            } else {
                None
            };
            let finding = address_mistake(&last, error).finding(at.span);
            let finding = finding.map(|finding| finding.fixes(highest.map(possible)));
            self.findings.extend(finding);
            return None;
        }
        Some(array)
    }

    /// The values of `initial`, if it is a list: one for each element.
    fn initial_list(
        &mut self,
        tag: &ladder::WrittenTag,
        meaning: TagMeaning,
        count: u32,
    ) -> Vec<ArrayCell> {
        if let Some(field) = &tag.field {
            let value = |value: &Option<_>| self.tag_value(value.as_ref()?, meaning);
            return field.initials.iter().map(value).collect();
        }
        let Some(list) = &tag.initials else { return Vec::new() };
        if list.value.len() != count as usize {
            let values = list.value.len();
            let message = format!("`initial` has {values} values for {count} elements");
            let finding = Finding::new(Code::TagKey, list.span, message);
            let help = "give one value for all, or a list with one for each element";
            let count = pair(format!("count = {values}")).possible();
            self.find(finding.help(help).fix(count).or_omit());
        }
        list.value.iter().map(|value| self.tag_value(value, meaning)).collect()
    }

    /// Marks all elements of an array as used if one of them is.
    pub(super) fn share_uses(&self, tags: &mut [Tag]) {
        let mut at = 0;
        while at < tags.len() {
            let count = tags[at].of_array.map_or(1, |place| place.array.count as usize);
            let end = (at + count).min(tags.len());
            let used = tags[at..end].iter().any(|tag| tag.used);
            tags[at..end].iter_mut().for_each(|tag| tag.used = used);
            at = end;
        }
    }
}

/// The name of a tag's elements, with the place of their index.
fn column(tag: &ladder::WrittenTag) -> String {
    match &tag.field {
        Some(field) => format!("{}{INDEX}.{}", kept(&field.tag.text), field.field),
        None => kept(&tag.name.text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resolve::LoadOptions;

    #[test]
    fn the_total_size_of_all_arrays_is_limited() {
        let options = LoadOptions::default();
        let mut resolver = Resolver::new(&[], &options);
        let mut take = || resolver.take_elements(4096, Span::default()).is_some();
        assert!((0..244).all(|_| take()));
        assert!(!take() && !take());
        let [finding] = &resolver.findings[..] else { panic!("{:?}", resolver.findings) };
        assert!(finding.message.contains("1000000 elements"), "{}", finding.message);
    }
}
