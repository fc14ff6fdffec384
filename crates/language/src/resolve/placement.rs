//! Gives each tag with a `type` its place in memory.
//!
//! Called by `typed` with all such tags of a load, and with the addresses in use. The rules are in
//! `docs/language.md`, *Tags without an address*: tags are placed in byte order of their names,
//! each from the top of its space downward, in the first stretch of free elements that is long
//! enough. Element 0 of an array has the array's lowest number. This module reads no files and
//! makes no findings.

use std::collections::BTreeMap;

use super::places::TagPlace;
use rungd_engine::isa::{MemorySizes, NumberRange, NumberRanges, Space};

/// A tag that needs a place.
#[derive(Clone, Debug)]
pub(super) struct PlacementRequest {
    /// The tag's whole name.
    pub name: String,
    /// The space.
    pub space: Space,
    /// The number of elements, at least 1.
    pub count: u32,
    /// Whether it is an array.
    pub is_array: bool,
    /// The length of its name before the index of an element.
    pub index_at: usize,
}

/// The elements that the files name by their addresses.
#[derive(Debug, Default)]
pub(super) struct UsedElements {
    spaces: BTreeMap<Space, Vec<bool>>,
    /// The long ranges so far: a file may name one range of thousands of elements again and again.
    long: NumberRanges<Space>,
}

/// Number of elements from which a range is long.
const LONG: u32 = 64;

/// The result of a placement.
#[derive(Debug, Default)]
pub(super) struct Placement {
    pub places: Vec<TagPlace>,
    /// The tags without a place, in byte order.
    pub short: Vec<PlacementRequest>,
}

/// The largest size of a space that can be set.
pub(super) const SIZE_MAX: u32 = 65_536;

impl UsedElements {
    /// Marks `count` elements of a space as used, from a number on.
    pub fn add(&mut self, space: Space, first: u32, count: u32) {
        let begin = first.saturating_sub(space.first()).min(SIZE_MAX);
        let end = begin.saturating_add(count).min(SIZE_MAX) as usize;
        let used = self.spaces.entry(space).or_default();
        used.resize(used.len().max(end), false);
        if end < (begin + LONG) as usize {
            return used[begin as usize..end].fill(true);
        }
        let new = NumberRange { kind: space, first: begin, last: end as u32 - 1 };
        for (first, last) in self.long.add(new, 0) {
            used[first as usize..=last as usize].fill(true);
        }
    }

    /// Whether an element is in use; `at` is its number, counted from 0.
    pub fn has(&self, space: Space, at: u32) -> bool {
        self.spaces.get(&space).and_then(|used| used.get(at as usize)).is_some_and(|used| *used)
    }

    /// The number of elements of a space that are in use.
    pub fn count(&self, space: Space) -> u32 {
        self.spaces.get(&space).map_or(0, |used| used.iter().filter(|used| **used).count() as u32)
    }

    /// The stretches of free elements, from the top downward. Each has the number of its first
    /// element, and the number behind its last element.
    fn free(&self, space: Space, size: u32) -> Vec<(u32, u32)> {
        let mut stretches: Vec<(u32, u32)> = Vec::new();
        for at in (0..size).rev().filter(|at| !self.has(space, *at)) {
            match stretches.last_mut() {
                Some((first, _)) if *first == at + 1 => *first = at,
                _ => stretches.push((at, at + 1)),
            }
        }
        stretches
    }
}

/// Sorts the tags by name, and places them.
pub(super) fn place(
    mut wishes: Vec<PlacementRequest>,
    used: &UsedElements,
    sizes: &MemorySizes,
) -> Placement {
    wishes.sort_by(|a, b| a.name.cmp(&b.name));
    let mut spaces: BTreeMap<Space, FreeElements> = BTreeMap::new();
    let mut placement = Placement::default();
    for wish in wishes {
        let space = wish.space;
        let free = spaces.entry(space).or_insert_with(|| FreeElements {
            stretches: used.free(space, space.count(sizes)),
            from: BTreeMap::new(),
        });
        match free.take(wish.count) {
            Some(at) => placement.places.push(TagPlace {
                name: wish.name,
                space,
                first: space.first() + at,
                count: wish.count,
                is_array: wish.is_array,
                index_at: wish.index_at,
            }),
            None => placement.short.push(wish),
        }
    }
    placement
}

/// The free elements of a space.
struct FreeElements {
    /// The stretches of free elements, from the top downward.
    stretches: Vec<(u32, u32)>,
    /// For some numbers of elements: the index of the stretch at which the next search for that
    /// number or a greater one begins. No stretch before it is long enough, since stretches only
    /// get shorter. The indices increase with the numbers.
    from: BTreeMap<u32, usize>,
}

impl FreeElements {
    fn take(&mut self, count: u32) -> Option<u32> {
        let begin = self.from.range(..=count).next_back().map_or(0, |(_, at)| *at);
        let fits = |(first, end): &(u32, u32)| end - first >= count;
        let at = self.stretches[begin..].iter().position(fits);
        let at = at.map_or(self.stretches.len(), |at| begin + at);
        self.begin_at(count, at);
        let (_, end) = self.stretches.get_mut(at)?;
        *end -= count;
        Some(*end)
    }

    /// Enters the place where searches for `count` begin. Removes the entries of greater numbers
    /// that say no more.
    fn begin_at(&mut self, count: u32, at: usize) {
        while let Some((greater, begin)) = self.from.range(count..).next()
            && *begin <= at
        {
            let greater = *greater;
            self.from.remove(&greater);
        }
        self.from.insert(count, at);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_engine::isa::WordSpace;

    const D: Space = Space::Word(WordSpace::D);

    /// Places `name` or `name*count` in ten D words, some of which are used.
    fn check(used: &[u32], names: &str, expected: &str) {
        let sizes = MemorySizes { d: 10, ..MemorySizes::default() };
        let mut all = UsedElements::default();
        used.iter().for_each(|at| all.add(D, *at, 1));
        let wish = |text: &str| {
            let (name, count) = text.split_once('*').unwrap_or((text, "1"));
            let count = count.parse().unwrap();
            let (name, index_at) = (name.to_owned(), name.len());
            PlacementRequest { name, space: D, count, is_array: count > 1, index_at }
        };
        let placement = place(names.split(' ').map(wish).collect(), &all, &sizes);
        let placed = placement.places.iter().map(|place| format!("{}={}", place.name, place.first));
        let short = placement.short.iter().map(|wish| format!("{}?", wish.name));
        assert_eq!(placed.chain(short).collect::<Vec<_>>().join(" "), expected, "{names}");
    }

    #[test]
    fn tags_are_placed_in_byte_order_of_their_names_from_the_top_down() {
        check(&[], "b a c", "a=9 b=8 c=7");
        check(&[], "b B a1 a.b a", "B=9 a=8 a.b=7 a1=6 b=5");
    }

    #[test]
    fn tags_are_not_placed_on_used_addresses() {
        check(&[9, 7, 0], "a b c", "a=8 b=6 c=5");
        check(&[50], "a", "a=9");
    }

    #[test]
    fn an_array_takes_the_first_free_range_that_is_long_enough() {
        check(&[8], "a*2 b", "a=6 b=9");
        check(&[], "a b*3 c", "a=9 b=6 c=5");
        check(&[4], "a*5 b*4 c", "a=5 b=0 c?");
        check(&[5], "a*5 b*5 c*4", "a=0 c=6 b?");
    }

    #[test]
    fn tags_without_room_are_reported_and_the_others_are_placed() {
        check(&[0, 1, 2, 3, 4, 5, 6, 7], "a b c d", "a=9 b=8 c? d?");
        check(&[5], "a*11 b", "b=9 a?");
    }

    #[test]
    fn a_hundred_thousand_tags_fit_between_used_addresses() {
        let sizes = MemorySizes { d: SIZE_MAX, ..MemorySizes::default() };
        let mut used = UsedElements::default();
        (0..SIZE_MAX / 2).for_each(|at| used.add(D, 2 * at, 1));
        let wish = |at: u32| {
            let count = 1 + at % 3;
            let (name, is_array) = (format!("t{at:06}"), count > 1);
            PlacementRequest { name, space: D, count, is_array, index_at: 7 }
        };
        let placement = place((0..100_000).map(wish).collect(), &used, &sizes);
        assert_eq!(placement.places.len(), 32_768);
        assert_eq!(placement.short.len(), 67_232);
    }
}
