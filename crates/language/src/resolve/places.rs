//! The tags with a `type`: the place that rungd chose for each tag, and the name of the tag at a
//! place.
//!
//! Made by the resolver, part of the resolved program. All code that shows an address to people
//! calls [`Places::say`]: people see an element of such a tag only by the tag's name, never by an
//! address.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Arc;

use rungd_engine::isa::{Address, Bit, Space};

/// The place of one tag: `count` neighbouring elements of a space.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TagPlace {
    /// The tag's whole name.
    pub name: String,
    /// The space.
    pub space: Space,
    /// The number of element 0.
    pub first: u32,
    /// The number of elements.
    pub count: u32,
    /// Whether the tag is an array: its elements are `name[0]`, `name[1]` ….
    pub is_array: bool,
    /// The length of the name before the index of an element: `recipe[3].target`.
    pub index_at: usize,
}

/// The places of all tags with a `type` of a program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Places(Arc<TagPlaces>);

#[derive(Debug, Default, PartialEq, Eq)]
struct TagPlaces {
    /// In order of space and number.
    places: Vec<TagPlace>,
    by_name: BTreeMap<String, usize>,
}

impl TagPlace {
    /// The address of an element; for a structure, the structure itself.
    pub fn address(&self, index: u32) -> Address {
        self.space.address(self.first + index)
    }

    /// All its addresses, in order.
    pub fn addresses(&self) -> impl Iterator<Item = Address> {
        (0..self.count).map(|index| self.address(index))
    }

    /// The name of an element: `size`, `recipe[3]`.
    pub fn name_of(&self, index: u32) -> String {
        match self.is_array {
            true => {
                let (before, behind) = self.name.split_at(self.index_at);
                format!("{before}[{index}]{behind}")
            }
            false => self.name.clone(),
        }
    }

    /// The `type` of its tag.
    pub fn type_name(&self) -> &'static str {
        type_of(self.space).unwrap_or("no type")
    }
}

/// The values of `type`, each with its space.
pub const TYPES: [(&str, Space); 7] = [
    ("bit", Space::Bit(rungd_engine::isa::BitSpace::C)),
    ("int", Space::Word(rungd_engine::isa::WordSpace::D)),
    ("word", Space::Word(rungd_engine::isa::WordSpace::V)),
    ("real", Space::Word(rungd_engine::isa::WordSpace::R)),
    ("timer", Space::Timer),
    ("counter", Space::Counter),
    ("sensaphone", Space::Sensaphone),
];

/// The space of the tags with this `type`; of a record there is none.
pub fn space_of(type_name: &str) -> Option<Space> {
    TYPES.iter().find(|(name, _)| *name == type_name).map(|(_, space)| *space)
}

/// The `type` of the tags of a space.
pub fn type_of(space: Space) -> Option<&'static str> {
    TYPES.iter().find(|(_, own_space)| *own_space == space).map(|(name, _)| *name)
}

impl Places {
    /// The places, in any order.
    pub fn new(mut places: Vec<TagPlace>) -> Places {
        places.sort_by_key(|place| (place.space, place.first));
        let by_name =
            places.iter().enumerate().map(|(at, place)| (place.name.clone(), at)).collect();
        Places(Arc::new(TagPlaces { places, by_name }))
    }

    /// All places, in byte order of their names.
    pub fn by_name(&self) -> impl Iterator<Item = &TagPlace> {
        self.0.by_name.values().map(|at| &self.0.places[*at])
    }

    /// The place of a tag.
    pub fn named(&self, name: &str) -> Option<&TagPlace> {
        self.0.by_name.get(name).map(|at| &self.0.places[*at])
    }

    /// The place that contains an address, and the index of the address in it; for a member, those
    /// of its structure.
    pub fn at(&self, address: Address) -> Option<(&TagPlace, u32)> {
        let places = &self.0.places;
        if places.is_empty() {
            return None;
        }
        let (space, number) = Space::with_members(address)?;
        let end = places.partition_point(|place| (place.space, place.first) <= (space, number));
        let place = places.get(end.checked_sub(1)?)?;
        let index = number.checked_sub(place.first)?;
        (place.space == space && index < place.count).then_some((place, index))
    }

    /// The first place that has an element in a range of numbers.
    pub fn in_range(&self, space: Space, first: u32, last: u32) -> Option<&TagPlace> {
        let begins = |place: &TagPlace| (place.space, place.first + place.count) <= (space, first);
        let place = self.0.places.get(self.0.places.partition_point(begins))?;
        (place.space == space && place.first <= last).then_some(place)
    }

    /// The name of an address that belongs to a tag with a `type`: `p1.failed`, `p1.hours.Acc`,
    /// `recipe[3]`.
    pub fn name(&self, address: Address) -> Option<String> {
        if let Address::Bit(Bit::InWord(bit)) = address {
            let word = self.name(Address::Word(bit.word))?;
            return Some(format!("{word}.{}", bit.number));
        }
        let (place, index) = self.at(address)?;
        let name = place.name_of(index);
        Some(match address.member() {
            Some(member) => format!("{name}.{member}"),
            None => name,
        })
    }

    /// Adds the text of an address for people to a text.
    pub fn write(&self, address: Address, text: &mut String) {
        match self.name(address) {
            Some(name) => text.push_str(&name),
            None => {
                let _ = write!(text, "{address}");
            }
        }
    }

    /// The text of an address for people: the name, if the address belongs to a tag with a `type`.
    pub fn say(&self, address: Address) -> String {
        self.name(address).unwrap_or_else(|| address.to_string())
    }
}
