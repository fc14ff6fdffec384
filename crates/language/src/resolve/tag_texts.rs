//! Resolves `texts` of tags: the texts of a tag's values.
//!
//! Called by `tags` for each tag, and by `declare` once all tags are known.

use std::collections::HashSet;
use std::sync::Arc;

use super::Resolver;
use super::names::kept;
use super::program::{Program, TagMeaning};
use super::tag::TagLimits;
use super::value_texts::ValueTexts;
use crate::source::finding::{Code, Finding};
use crate::source::fix::possible;
use crate::source::ladder;
use crate::source::reader::Text;
use crate::source::span::Span;
use crate::source::wording::is_obeyed;
use rungd_engine::isa::{Address, NumberMap};

/// Maximum number of characters of a text: tables show it behind the value.
const TEXT_CHARS_MAX: usize = 40;
/// Maximum number of texts of a tag.
const TEXTS_MAX: usize = 256;

/// The whole numbers that a tag can hold, with the places of its `min` and `max`.
pub(super) struct HeldNumbers {
    least: i32,
    most: i32,
    min: Option<Span>,
    max: Option<Span>,
}

impl HeldNumbers {
    /// The numbers of a tag of this meaning with these limits; `None` if it holds no whole numbers.
    pub fn new(meaning: TagMeaning, limits: &TagLimits) -> Option<HeldNumbers> {
        let TagMeaning::Address(address) = meaning else { return None };
        let TagLimits { min, max } = *limits;
        match address {
            Address::Bit(_) => Some(HeldNumbers { least: 0, most: 1, min: None, max: None }),
            Address::Word(word) if !word.is_real() => {
                let (least, most) = word.range();
                Some(HeldNumbers {
                    least: min.map_or(least, |(min, _)| min),
                    most: max.map_or(most, |(max, _)| max),
                    min: min.map(|(_, span)| span),
                    max: max.map(|(_, span)| span),
                })
            }
            Address::Word(_) | Address::Structure(_) => None,
        }
    }
}

impl Resolver<'_> {
    /// The texts of a tag's values; `None` if it has none. `held`: the numbers that it can hold.
    pub(super) fn value_texts(
        &mut self,
        tag: &ladder::WrittenTag,
        held: Option<HeldNumbers>,
    ) -> Option<Arc<ValueTexts>> {
        let (written, held) = (tag.texts.as_ref()?, held?);
        let mut texts = ValueTexts::default();
        for entry in written.value.iter().take(TEXTS_MAX) {
            self.text_misfits(tag, &entry.text);
            if let Some(number) = self.number_of_text(tag, &entry.value, &held) {
                texts.add(number, &entry.text.text);
            }
        }
        let name = kept(&tag.name.text);
        let (count, span) = (written.value.len(), written.span);
        if count == 0 {
            let finding = Finding::new(Code::TagKey, span, format!("`texts` of `{name}` is empty"));
            let help = "write the texts of its values: `texts = { 0 = \"idle\", 1 = \"running\" }`";
            self.find(finding.help(help).or_omit());
        } else if count > TEXTS_MAX {
            let message = format!("`texts` of `{name}` has {count} texts");
            let help = format!("a tag has at most {TEXTS_MAX}: leave out those nobody needs");
            self.find(Finding::new(Code::TagKey, span, message).help(help));
        }
        (count > 0).then(|| Arc::new(texts))
    }

    /// The value that a key of `texts` names.
    fn number_of_text(
        &mut self,
        tag: &ladder::WrittenTag,
        key: &Text,
        held: &HeldNumbers,
    ) -> Option<i32> {
        let number: Option<i32> = key.text.parse().ok();
        let name = kept(&tag.name.text);
        let Some(number) = number.filter(|number| number.to_string() == key.text) else {
            let message =
                format!("`{}` in `texts` of `{name}` is no whole number", kept(&key.text));
            let finding = Finding::new(Code::TagKey, key.span, message);
            let plain = match key.text.to_ascii_lowercase().as_str() {
                "true" | "on" => Some(1),
                "false" | "off" => Some(0),
                text => text.parse::<i32>().ok(),
            };
            let help = "its keys are the values of the tag: 0, 1, -5";
            self.find(finding.help(help).fixes(plain.map(|number| possible(number.to_string()))));
            return None;
        };
        let HeldNumbers { least, most, min, max } = *held;
        if !(least..=most).contains(&number) {
            let message = format!("`{name}` holds {least}..{most}, so it never has {number}");
            let finding = Finding::new(Code::OutOfRange, key.span, message);
            let finding = match if number < least { min } else { max } {
                Some(limit) => finding.related(limit, "the limit"),
                None => finding,
            };
            self.find(finding.help("leave its text out: nobody would see it"));
            return None;
        }
        Some(number)
    }

    /// Reports a text that cannot be shown behind a value.
    fn text_misfits(&mut self, tag: &ladder::WrittenTag, text: &Text) {
        let count = text.text.chars().count();
        let name = kept(&tag.name.text);
        let (message, help) = if text.text.trim().is_empty() {
            (format!("a text in `texts` of `{name}` is empty"), "leave it out".to_owned())
        } else if count > TEXT_CHARS_MAX {
            let help = format!("a text has at most {TEXT_CHARS_MAX}; `doc` has room for more");
            (format!("a text in `texts` of `{name}` has {count} characters"), help)
        } else if text.text.contains(is_obeyed) {
            let help = "a text is printed as it stands, in one line: leave the character out";
            (format!("a text in `texts` of `{name}` has a control character"), help.to_owned())
        } else {
            return;
        };
        self.find(Finding::new(Code::TagKey, text.span, message).help(help));
    }

    /// Reports two tags of one location with different texts.
    pub(super) fn check_texts(&mut self, program: &Program) {
        let mut first: NumberMap<Address, usize> = NumberMap::default();
        // Two arrays may share many elements: one finding for each pair of tags is enough.
        let mut found = HashSet::new();
        for (at, tag) in program.tags.iter().enumerate() {
            let TagMeaning::Address(address) = tag.meaning else { continue };
            let Some(texts) = &tag.texts else { continue };
            let other = &program.tags[*first.entry(address).or_insert(at)];
            if other.texts.as_ref() != Some(texts) && found.insert((tag.span, other.span)) {
                let message = format!("`texts` of `{address}` is given twice, differently");
                let finding = Finding::new(Code::TagKey, tag.span, message);
                let finding =
                    finding.related(other.span, "another tag of this address gives others");
                self.find(finding.help("leave `texts` to one of the two tags"));
            }
        }
    }
}
