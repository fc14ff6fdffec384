//! Maps and sets by addresses and other small numbers.
//!
//! A load looks up some hundred thousand addresses; with the standard library's hash function that
//! took a fifth of its time. That function withstands keys that an attacker has chosen, which takes
//! time; these keys come from the files of the machine's owner. Maps by names keep it.

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hasher};

/// A map by addresses or numbers.
pub(crate) type NumberMap<K, V> = HashMap<K, V, BuildHasherDefault<NumberHasher>>;

/// A set of addresses or numbers.
pub(crate) type NumberSet<K> = HashSet<K, BuildHasherDefault<NumberHasher>>;

/// An odd number without a pattern in its bits, which a product spreads over all of them.
const FACTOR: u64 = 0xf135_7aea_2e62_a9c5;

/// The hash function: a product for each number of a key.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NumberHasher(u64);

impl NumberHasher {
    #[inline]
    fn add(&mut self, number: u64) {
        self.0 = self.0.wrapping_add(number).wrapping_mul(FACTOR);
    }
}

impl Hasher for NumberHasher {
    // The upper bits depend on the most bits of a key; a table takes the lower ones.
    #[inline]
    fn finish(&self) -> u64 {
        self.0.rotate_left(26)
    }

    #[inline]
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.add(u64::from(*byte)));
    }

    #[inline]
    fn write_u32(&mut self, number: u32) {
        self.add(u64::from(number));
    }

    #[inline]
    fn write_i32(&mut self, number: i32) {
        self.add(u64::from(number.cast_unsigned()));
    }

    #[inline]
    fn write_u64(&mut self, number: u64) {
        self.add(number);
    }

    #[inline]
    fn write_usize(&mut self, number: usize) {
        self.add(number as u64);
    }

    #[inline]
    fn write_isize(&mut self, number: isize) {
        self.add(number.cast_unsigned() as u64);
    }
}

#[cfg(test)]
mod tests {
    use std::hash::{BuildHasher, Hash};

    use super::*;
    use crate::isa::{Address, Bit, BitSpace, Structure, Word, WordSpace};

    /// The greatest number of keys whose hash ends with the same bits: as many bits as a table for
    /// all of them takes.
    fn most_in_one_place(keys: impl Iterator<Item = impl Hash>) -> usize {
        let hasher = BuildHasherDefault::<NumberHasher>::default();
        let mut places = vec![0; 1 << 14];
        for key in keys {
            places[hasher.hash_one(key) as usize % (1 << 14)] += 1;
        }
        places.into_iter().max().unwrap_or(0)
    }

    #[test]
    fn neighbours_are_spread_over_a_table() {
        let words = (0..1 << 13).map(|n| Address::Word(Word::Space(WordSpace::D, n)));
        let bits = (0..1 << 13).map(|n| Address::Bit(Bit::Space(BitSpace::C, n)));
        let timers = (0..1 << 13).map(|n| Address::Structure(Structure::Timer(n)));
        let even = (0..1 << 13).map(|n| 8 * n);
        assert!(most_in_one_place(words) <= 6);
        assert!(most_in_one_place(bits) <= 6);
        assert!(most_in_one_place(timers) <= 6);
        assert!(most_in_one_place(even) <= 6);
    }
}
