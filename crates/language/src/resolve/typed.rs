//! Tags with a `type`: collects the addresses that the files name, and gives these tags their
//! places.
//!
//! Called by `declare` before any tag is resolved, because each such tag needs a place that no
//! address of any file uses. `placement` contains the rules; the places become part of the program.
//!
//! Addresses are found in the texts, not in resolved operands. A text that only looks like an
//! address makes a place unavailable, which does no harm. An overlooked address would give the same
//! memory two meanings. (`Scope` refuses such an address.)

use std::collections::{HashMap, HashSet};

use super::Resolver;
use super::placement::{self, Placement, PlacementRequest, SIZE_MAX, UsedElements};
use super::places::{Places, TYPES, space_of, type_of};
use super::program::TagMeaning;
use crate::source::atom::is_name_letter;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, possible};
use crate::source::ladder::{self, Ladder, WrittenRung};
use crate::source::nearest::did_you_mean;
use crate::source::reader::Text;
use crate::source::span::{FileId, Span};
use rungd_engine::isa::address_text;
use rungd_engine::isa::{Address, MemorySizes, Space};

impl Resolver<'_> {
    /// Places the tags with a `type` of all ladders.
    pub(super) fn place_typed(&mut self, ladders: &[(FileId, Ladder)]) {
        let tags = || ladders.iter().flat_map(|(_, ladder)| &ladder.tags);
        let mut seen = HashSet::new();
        let fresh = tags().filter(|tag| seen.insert(tag.name.text.as_str()));
        let wishes: Vec<PlacementRequest> = fresh.filter_map(wish).collect();
        if wishes.is_empty() {
            return;
        }
        if self.observes {
            return self.place_behind(wishes, ladders);
        }
        let used = self.used_addresses(ladders);
        let placement = placement::place(wishes.clone(), &used, &self.options.sizes);
        self.find_short(&placement, &wishes, &used, |name| {
            let tag = tags().find(|tag| tag.name.text == name);
            tag.and_then(|tag| tag.kind.as_ref()).map_or_else(Span::default, |kind| kind.span)
        });
        self.scope.set_places(Places::new(placement.places));
    }

    /// The meaning of a tag with a `type`: its place.
    pub(super) fn typed(&mut self, tag: &ladder::WrittenTag, kind: &Text) -> Option<TagMeaning> {
        if space_of(&kind.text).is_none() {
            let message = format!("a tag has no type `{}`", kind.text);
            let names = self.type_names();
            let records = self.records.keys().map(String::as_str);
            let help = did_you_mean(&kind.text, names.iter().copied().chain(records));
            let meant = match kind.text.to_ascii_lowercase().as_str() {
                "bool" | "boolean" => Some("bit"),
                "dint" | "int32" | "integer" | "long" => Some("int"),
                "uint" | "uint16" | "ushort" => Some("word"),
                "float" | "lreal" | "double" => Some("real"),
                _ => None,
            };
            let all = || Help::from(format!("the types are {}", names.join(", ")));
            let help = help.unwrap_or_else(|| all().with_all(meant.map(possible)));
            self.find(Finding::new(Code::TagKey, kind.span, message).help(help));
        }
        let place = self.scope.places().named(&tag.name.text)?;
        Some(TagMeaning::Address(place.address(0)))
    }

    /// The types that a tag may have, but for records.
    fn type_names(&self) -> Vec<&'static str> {
        let observes = self.observes;
        let types = TYPES.into_iter();
        let types = types.filter(|(_, space)| !observes || *space != Space::Sensaphone);
        types.map(|(name, _)| name).collect()
    }

    fn used_addresses(&self, ladders: &[(FileId, Ladder)]) -> UsedElements {
        let mut used = UsedElements::default();
        let mut tags = HashMap::new();
        let sizes = &self.options.sizes;
        for tag in ladders.iter().flat_map(|(_, ladder)| &ladder.tags) {
            let Some(at) = &tag.at else { continue };
            let Some(element) = element(&at.text, sizes) else { continue };
            used.add(element.0, element.1, count_of(tag));
            tags.insert(tag.name.text.as_str(), element);
        }
        let progress = &self.options.progress;
        for rung in progress.during(ladders.iter().flat_map(|(_, ladder)| rungs(ladder))) {
            self.spans(rung).for_each(|text| add_words(&mut used, text, sizes));
        }
        for text in progress.during(&self.options.addresses) {
            add_words(&mut used, text, sizes);
            let end = |text: &str| {
                let tag = || tags.get(text.trim().split('.').next()?).copied();
                element(text.trim(), sizes).or_else(tag)
            };
            if let Some((low, high)) = text.split_once("..")
                && let (Some(low), Some(high)) = (end(low), end(high))
                && low.0 == high.0
                && low.1 <= high.1
            {
                used.add(low.0, low.1, high.1 - low.1 + 1);
            }
        }
        used
    }

    /// The texts of a rung's contacts and instructions.
    fn spans<'r>(&'r self, rung: &'r WrittenRung) -> impl Iterator<Item = &'r str> {
        let legs = rung.when.iter().chain(&rung.legs).map(|leg| leg.span);
        let branches = rung.branches.iter();
        let contacts = branches.flat_map(|branch| &branch.contacts).map(|contact| contact.span());
        let behind = rung.branches.iter().flat_map(|branch| &branch.body);
        let body = rung.body.iter().chain(behind).map(|instruction| instruction.span);
        legs.chain(contacts).chain(body).map(|span| self.text(span))
    }

    /// Adds one finding for each space in which tags have no place.
    fn find_short(
        &mut self,
        placement: &Placement,
        wishes: &[PlacementRequest],
        used: &UsedElements,
        place: impl Fn(&str) -> Span,
    ) {
        for (kind, space) in TYPES {
            let short = placement.short.iter().filter(|wish| wish.space == space);
            let names: Vec<&str> = short.clone().map(|wish| wish.name.as_str()).collect();
            let Some(first) = names.first() else { continue };
            let wanted: u32 = of(wishes, space).map(|wish| wish.count).sum();
            let (size, name) = (space.count(&self.options.sizes), space.name());
            let in_use = used.count(space).min(size);
            let beside = match names.len() - 1 {
                0 => String::new(),
                1 => " and one more tag".to_owned(),
                more => format!(" and {more} more tags"),
            };
            let message = format!(
                "no room for `{first}`{beside}: the tags with `type = \"{kind}\"` need {wanted} \
                 {name}, and {in_use} of {size} {name} have addresses in these files"
            );
            let finding = Finding::new(Code::MemoryFull, place(first), message);
            let missing = short.map(|wish| wish.count).sum();
            let short = ShortSpace { space, missing };
            self.find(finding.help(enough(wishes, used, &self.options.sizes, short)));
        }
    }
}

/// A space in which tags have no place.
struct ShortSpace {
    space: Space,
    /// The number of elements of these tags.
    missing: u32,
}

/// The help: a size of the space that is enough.
fn enough(
    wishes: &[PlacementRequest],
    used: &UsedElements,
    sizes: &MemorySizes,
    ShortSpace { space, missing }: ShortSpace,
) -> String {
    let name = space.name();
    let requests: Vec<PlacementRequest> = of(wishes, space).cloned().collect();
    let mut size = space.count(sizes);
    // After some steps, the steps get longer: each places all tags.
    let mut steps = (0..).map(|step: u32| missing.max(1).saturating_mul(1 << (step / 8).min(16)));
    while size < SIZE_MAX && space != Space::Sensaphone {
        size = size.saturating_add(steps.next().unwrap_or(SIZE_MAX)).min(SIZE_MAX);
        let sizes = space.sized(sizes, size);
        if placement::place(requests.clone(), used, &sizes).short.is_empty() {
            return format!("write `{name} = {size}` under `[memory]` of the controller file");
        }
    }
    format!("there are {} {name} at most: take tags away", SIZE_MAX.min(size))
}

fn of(wishes: &[PlacementRequest], space: Space) -> impl Iterator<Item = &PlacementRequest> {
    wishes.iter().filter(move |wish| wish.space == space)
}

fn wish(tag: &ladder::WrittenTag) -> Option<PlacementRequest> {
    if tag.at.is_some() || tag.value.is_some() {
        return None;
    }
    let space = space_of(&tag.kind.as_ref()?.text)?;
    let is_array = tag.count.is_some();
    let name = tag.name.text.clone();
    let index_at = tag.field.as_ref().map_or(name.len(), |field| field.tag.text.len());
    Some(PlacementRequest { name, space, count: count_of(tag), is_array, index_at })
}

/// The number of elements of a tag.
fn count_of(tag: &ladder::WrittenTag) -> u32 {
    tag.count.as_ref().and_then(|count| u32::try_from(count.value).ok()).unwrap_or(1)
}

fn rungs(ladder: &Ladder) -> impl Iterator<Item = &WrittenRung> {
    ladder.blocks.iter().flat_map(|block| {
        block.rungs.iter().chain(block.stages.iter().flat_map(|stage| &stage.rungs))
    })
}

/// The element of an address; for a member, its structure.
fn element(text: &str, sizes: &MemorySizes) -> Option<(Space, u32)> {
    let address: Address = address_text::parse(text, sizes).ok()?;
    Space::with_members(address)
}

/// Marks every word of a text that is an address as used: `D0`, `T0` of `T0.Done`, `N,3` of
/// `N,3,6`.
fn add_words(used: &mut UsedElements, text: &str, sizes: &MemorySizes) {
    let mut rest = text;
    while let Some(begin) = rest.find(is_name_letter) {
        rest = &rest[begin..];
        let end = rest.find(|c| !is_name_letter(c)).unwrap_or(rest.len());
        let (word, behind) = rest.split_at(end);
        rest = behind;
        let found = match behind.trim_start().strip_prefix(',') {
            Some(number) if word == "N" => {
                let number = number.trim_start();
                let end = number.find(|c: char| !c.is_ascii_digit()).unwrap_or(number.len());
                element(&format!("N{}", &number[..end]), sizes)
            }
            Some(_) | None => element(word, sizes),
        };
        if let Some(found) = found.filter(|(space, _)| type_of(*space).is_some()) {
            let last = range_end(behind, sizes).filter(|last| last.0 == found.0);
            let (low, high) = match last {
                Some(last) => (found.1.min(last.1), found.1.max(last.1)),
                None => (found.1, found.1),
            };
            used.add(found.0, low, high - low + 1);
        }
    }
}

/// The address behind the `..` of a range.
fn range_end(behind: &str, sizes: &MemorySizes) -> Option<(Space, u32)> {
    let end = behind.strip_prefix("..")?;
    let length = end.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(end.len());
    element(&end[..length], sizes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_in_a_text_count_as_used() {
        let check = |text: &str, expected: &[&str]| {
            let mut used = UsedElements::default();
            add_words(&mut used, text, &MemorySizes::default());
            let all = TYPES.into_iter().flat_map(|(_, space)| (0..99).map(move |n| (space, n)));
            let found = all.filter(|(space, n)| used.has(*space, *n));
            let found: Vec<_> = found.map(|(space, n)| format!("{}{n}", space.name())).collect();
            assert_eq!(found, expected, "{text}");
        };
        check("[\"C0\", \"!(C1|D2 == V3)\"]", &["C0", "C1", "D2", "V3"]);
        check("MATH R0 = R1*D10/T3.Acc", &["D10", "R0", "R1", "T3"]);
        check("CNT CT7 preset=N,3,6 N , 4", &["CT7", "N3", "N4"]);
        check("D0x xD1 D_2 C-1 X4 level.D9", &["D9"]);
        check("N,x N N,", &[]);
        check("COPY D3..D5 to=D8..D9", &["D3", "D4", "D5", "D8", "D9"]);
        check("SR C2..C0", &["C0", "C1", "C2"]);
    }
}
