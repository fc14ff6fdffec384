//! The words of tags, for tags that are a bit of one: `at = "status.3"`.
//!
//! Made by `declare` before any tag is resolved, because the tag of the word may come later in the
//! files. It has only the names that such a text may contain, and makes no findings about them:
//! `tags` reports the mistakes of each tag.

use super::array::Array;
use super::mistake::{Mistake, mistake};
use super::places::Places;
use super::scope::{LookUp, NamedThing, Scope};
use super::tag::TagMeaning;
use crate::source::atom::ConstantForm;
use crate::source::finding::Code;
use crate::source::ladder::{Ladder, WrittenTag};
use crate::source::reader::Constant;
use crate::source::span::FileId;
use rungd_engine::isa::address_text::{self, split_bit};
use rungd_engine::isa::{Address, MemorySizes, Space};

/// The tags of words, structures and arrays, and the constants.
#[derive(Debug)]
pub(super) struct TagWords(Scope);

impl TagWords {
    /// The words of all tags; `None` if no tag is a bit of another tag's word.
    pub fn of(
        ladders: &[(FileId, Ladder)],
        places: &Places,
        sizes: &MemorySizes,
    ) -> Option<TagWords> {
        let tags = || ladders.iter().flat_map(|(_, ladder)| &ladder.tags);
        let is_bit = |tag: &WrittenTag| {
            let at = tag.at.as_ref().map_or("", |at| &at.text);
            split_bit(at).is_some() && address_text::parse(at, sizes).is_err()
        };
        tags().any(is_bit).then(|| {
            let mut scope = Scope::new(sizes.clone());
            scope.set_places(places.clone());
            for tag in tags() {
                if let Some(meaning) = meaning(tag, places, sizes) {
                    scope.add_tag(&tag.name.text, 0, Some(meaning));
                }
            }
            TagWords(scope)
        })
    }

    /// The bit of a word that a text names; `None` if the text has no number of a bit.
    pub fn bit(&self, text: &str) -> Option<Result<Address, Mistake>> {
        split_bit(text)?;
        Some(match self.0.look_up(text) {
            Ok(LookUp { thing: NamedThing::Address(address), .. }) => Ok(address),
            Ok(LookUp { thing: NamedThing::Element(_), .. }) => {
                let message = format!("the index of `{text}` is a word");
                let help = "a tag has one place: the index is a constant here";
                Err(mistake(Code::OperandType, message, help))
            }
            Ok(_) => Err(mistake(Code::UnknownName, format!("`{text}` is no bit"), "")),
            Err(mistake) => Err(mistake),
        })
    }
}

/// The meaning of a tag without mistakes.
fn meaning(tag: &WrittenTag, places: &Places, sizes: &MemorySizes) -> Option<TagMeaning> {
    if let Some(value) = &tag.value {
        return match value.value {
            Constant::Integer(n) => Some(TagMeaning::Constant(n, ConstantForm::Integer)),
            Constant::Duration(ms) => Some(TagMeaning::Constant(ms, ConstantForm::Duration)),
            Constant::Real(_) | Constant::Bit(_) => None,
        };
    }
    let address = match &tag.at {
        Some(at) => address_text::parse(&at.text, sizes).ok()?,
        None => places.named(&tag.name.text)?.address(0),
    };
    let Some(count) = &tag.count else { return Some(TagMeaning::Address(address)) };
    let (space, first) = Space::of(address)?;
    let count = u32::try_from(count.value).ok().filter(|count| *count > 0)?;
    Some(TagMeaning::Array(Array { space, first, count, member: None, bit: None }))
}
