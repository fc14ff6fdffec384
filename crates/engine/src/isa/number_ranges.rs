//! Ranges of numbers: the numbers that no earlier range has, and the first range with a number.
//!
//! A file may name a hundred thousand ranges, each as long as memory. A comparison of each range
//! with all others, or with all elements, would take hours; here a range takes the logarithm of
//! their number. Used by the resolver, the rules and the controller file's settings. The meaning of
//! the numbers is not known here: a caller chooses the kinds, such as spaces of memory.

use std::collections::BTreeMap;

/// Consecutive numbers of a kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NumberRange<K> {
    /// Their kind.
    pub kind: K,
    /// The first number.
    pub first: u32,
    /// The last number; less than `u32::MAX`.
    pub last: u32,
}

impl<K> NumberRange<K> {
    /// A single number.
    pub fn one(kind: K, number: u32) -> NumberRange<K> {
        NumberRange { kind, first: number, last: number }
    }
}

/// Ranges of numbers, added one after the other. Each number belongs to a kind.
#[derive(Debug)]
pub struct NumberRanges<K> {
    /// All numbers that were added, as ranges that do not touch each other: kind and first number,
    /// last number.
    covered: BTreeMap<(K, u32), u32>,
    /// The same numbers, as parts of the ranges that added them: kind and first number, last number
    /// and the index of the range.
    parts: BTreeMap<(K, u32), (u32, usize)>,
}

impl<K> Default for NumberRanges<K> {
    fn default() -> Self {
        NumberRanges { covered: BTreeMap::new(), parts: BTreeMap::new() }
    }
}

impl<K: Copy + Ord> NumberRanges<K> {
    /// Adds the numbers of a range. Returns those that are new, as first and last numbers in order;
    /// [`NumberRanges::first_in`] gives `index` for them.
    pub fn add(&mut self, range: NumberRange<K>, index: usize) -> Vec<(u32, u32)> {
        let NumberRange { kind, first, last } = range;
        let (mut low, mut high, mut at) = (first, last, first);
        let mut new = Vec::new();
        for (begin, end) in self.touching(range) {
            self.covered.remove(&(kind, begin));
            (low, high) = (low.min(begin), high.max(end));
            if at < begin {
                new.push((at, begin - 1));
            }
            at = at.max(end + 1);
        }
        if at <= last {
            new.push((at, last));
        }
        self.covered.insert((kind, low), high);
        self.parts.extend(new.iter().map(|(begin, end)| ((kind, *begin), (*end, index))));
        new
    }

    /// The first and last numbers of the covered ranges that overlap a range or are next to it, in
    /// order.
    fn touching(&self, range: NumberRange<K>) -> Vec<(u32, u32)> {
        let NumberRange { kind, first, last } = range;
        let below = self.covered.range((kind, 0)..=(kind, last + 1)).rev();
        let touching = below.take_while(|(_, end)| **end + 1 >= first);
        let mut found: Vec<(u32, u32)> = touching.map(|((_, begin), end)| (*begin, *end)).collect();
        found.reverse();
        found
    }

    /// The lowest number from `from` on that was not added.
    pub fn next_new(&self, kind: K, from: u32) -> u32 {
        let before = self.covered.range((kind, 0)..=(kind, from)).next_back();
        before.filter(|(_, end)| **end >= from).map_or(from, |(_, end)| end + 1)
    }

    /// Of the numbers of a range that were added, the lowest: the index of the first range with it.
    pub fn first_in(&self, range: NumberRange<K>) -> Option<usize> {
        let NumberRange { kind, first, last } = range;
        let before = self.parts.range((kind, 0)..=(kind, first)).next_back();
        let around = before.filter(|(_, (end, _))| *end >= first);
        let found = around.or_else(|| self.parts.range((kind, first)..=(kind, last)).next());
        found.map(|(_, (_, index))| *index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(kind: char, first: u32, last: u32) -> NumberRange<char> {
        NumberRange { kind, first, last }
    }

    #[test]
    fn adding_a_range_returns_only_its_new_numbers() {
        let mut ranges = NumberRanges::default();
        assert_eq!(ranges.add(range('x', 4, 6), 0), [(4, 6)]);
        assert_eq!(ranges.add(range('y', 4, 6), 1), [(4, 6)]);
        assert!(ranges.add(range('x', 5, 6), 2).is_empty());
        assert_eq!(ranges.add(range('x', 9, 9), 3), [(9, 9)]);
        assert_eq!(ranges.add(range('x', 0, 12), 4), [(0, 3), (7, 8), (10, 12)]);
        assert_eq!(ranges.add(range('x', 13, 14), 5), [(13, 14)]);
        assert_eq!(ranges.covered.len(), 2);
    }

    #[test]
    fn a_number_belongs_to_the_first_range_that_contains_it() {
        let mut ranges = NumberRanges::default();
        for (index, (first, last)) in [(4, 6), (0, 5), (20, 30), (25, 40)].into_iter().enumerate() {
            ranges.add(range('x', first, last), index);
        }
        for ((first, last), expected) in [
            ((4, 4), Some(0)),
            ((3, 6), Some(1)),
            ((7, 19), None),
            ((7, 50), Some(2)),
            ((30, 30), Some(2)),
            ((31, 31), Some(3)),
            ((41, 99), None),
        ] {
            assert_eq!(ranges.first_in(range('x', first, last)), expected, "{first}..{last}");
        }
        assert_eq!(ranges.first_in(range('w', 0, 99)), None);
        assert_eq!(ranges.first_in(range('y', 0, 99)), None);
        assert_eq!([0, 6, 7, 30, 41].map(|from| ranges.next_new('x', from)), [7, 7, 7, 41, 41]);
        assert_eq!(ranges.next_new('y', 5), 5);
    }

    /// Overlapping ranges are merged: the work does not grow with the number of earlier ranges.
    #[test]
    fn overlapping_ranges_are_merged() {
        let mut ranges = NumberRanges::default();
        for (index, at) in (0..50_000).enumerate() {
            ranges.add(range('x', at % 100, 65_535 - at % 100), index);
            ranges.add(range('y', 2 * at, 2 * at), index);
        }
        let count = |kind: char| {
            ranges.covered.keys().filter(|(range_kind, _)| *range_kind == kind).count()
        };
        assert_eq!([count('x'), count('y')], [1, 50_000]);
        assert_eq!(ranges.parts.len(), 50_001);
        assert_eq!(ranges.add(range('y', 0, 99_999), 0).len(), 50_000);
        assert_eq!(ranges.covered.len(), 2);
    }
}
