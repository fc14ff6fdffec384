//! The memory image: one byte for each bit, one `i32` for each word, and the masks of forced cells.
//!
//! A forced cell keeps its value because `MemoryView` (in `memory`) discards every write to it.
//! Other parts of the program read the image between scans.

use super::power::Power;
use super::reach::NEAR;

/// The number of a bit in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BitCell(pub u32);

/// The number of a word in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WordCell(pub u32);

/// The public memory of a program, followed by the engine's own cells.
#[derive(Clone, Debug)]
pub struct Image {
    pub(super) bits: Box<[u8]>,
    pub(super) words: Box<[i32]>,
    pub(super) forced_bits: Box<[bool]>,
    pub(super) forced_words: Box<[bool]>,
    forces: u32,
    /// Number of the program's bits; the memory is at least [`NEAR`] cells long.
    bit_count: usize,
    word_count: usize,
}

impl Image {
    /// An image of `bits` bits and `words` words, all OFF and 0.
    pub(super) fn new(bits: usize, words: usize) -> Image {
        let room = |cells: usize| cells.max(NEAR);
        Image {
            bits: vec![0; room(bits)].into(),
            words: vec![0; room(words)].into(),
            forced_bits: vec![false; bits].into(),
            forced_words: vec![false; words].into(),
            forces: 0,
            bit_count: bits,
            word_count: words,
        }
    }

    /// Whether every cell's number fits into 16 bits.
    pub(super) fn is_near(&self) -> bool {
        self.bit_count <= NEAR && self.word_count <= NEAR
    }

    /// Whether a power is ON.
    pub fn power(&self, power: Power) -> bool {
        self.bit(BitCell(power.cell())) != power.is_opposite()
    }

    /// Whether a bit is ON.
    pub fn bit(&self, cell: BitCell) -> bool {
        self.bits[cell.0 as usize] != 0
    }

    /// 64 bits from `first` on; the lowest one is that of `first`.
    pub(super) fn packed(&self, first: BitCell) -> u64 {
        let first = first.0 as usize;
        let (eights, _) = self.bits[first..first + 64].as_chunks::<8>();
        let pack = |packed: u64, eight: &[u8; 8]| {
            // Multiplied, byte i of the eight arrives at bit i of the highest byte.
            packed << 8 | u64::from_be_bytes(*eight).wrapping_mul(0x8040_2010_0804_0201) >> 56
        };
        eights.iter().rev().fold(0, pack)
    }

    /// A word's value.
    pub fn word(&self, cell: WordCell) -> i32 {
        self.words[cell.0 as usize]
    }

    /// All bits by cell number, each 0 or 1.
    pub fn bits(&self) -> &[u8] {
        &self.bits[..self.bit_count]
    }

    /// All words by cell number.
    pub fn words(&self) -> &[i32] {
        &self.words[..self.word_count]
    }

    /// The number of forced cells.
    pub fn forces(&self) -> u32 {
        self.forces
    }

    /// Forces these cells and no others. `forces`: their number.
    pub(super) fn put_forced(&mut self, forces: u32, bits: &[bool], words: &[bool]) {
        if forces > 0 || self.forces > 0 {
            self.forced_bits.copy_from_slice(bits);
            self.forced_words.copy_from_slice(words);
        }
        self.forces = forces;
    }

    /// Writes a bit, unless it is forced; returns whether that changed it.
    #[inline]
    pub(super) fn write_bit(&mut self, BitCell(cell): BitCell, on: bool) -> bool {
        let bit = &mut self.bits[cell as usize];
        let changes = *bit != u8::from(on) && !(self.forces > 0 && self.forced_bits[cell as usize]);
        if changes {
            *bit = u8::from(on);
        }
        changes
    }

    /// Writes a word, unless it is forced; returns whether that changed it.
    #[inline]
    pub(super) fn write_word(&mut self, WordCell(cell): WordCell, value: i32) -> bool {
        let word = &mut self.words[cell as usize];
        let changes = *word != value && !(self.forces > 0 && self.forced_words[cell as usize]);
        if changes {
            *word = value;
        }
        changes
    }

    /// Writes consecutive bits, except forced ones.
    pub(super) fn put_bits(&mut self, first: u32, values: &[u8]) {
        let at = first as usize..first as usize + values.len();
        put_unforced(&mut self.bits[at.clone()], &self.forced_bits[at], self.forces, values);
    }

    /// Writes consecutive words, except forced ones.
    pub(super) fn put_words(&mut self, first: u32, values: &[i32]) {
        let at = first as usize..first as usize + values.len();
        put_unforced(&mut self.words[at.clone()], &self.forced_words[at], self.forces, values);
    }

    pub(super) fn force_bit(&mut self, cell: BitCell, value: bool) {
        let at = cell.0 as usize;
        self.bits[at] = u8::from(value);
        self.forces += u32::from(!self.forced_bits[at]);
        self.forced_bits[at] = true;
    }

    pub(super) fn force_word(&mut self, cell: WordCell, value: i32) {
        let at = cell.0 as usize;
        self.words[at] = value;
        self.forces += u32::from(!self.forced_words[at]);
        self.forced_words[at] = true;
    }

    pub(super) fn release_bit(&mut self, cell: BitCell) {
        let forced = &mut self.forced_bits[cell.0 as usize];
        self.forces -= u32::from(*forced);
        *forced = false;
    }

    pub(super) fn release_word(&mut self, cell: WordCell) {
        let forced = &mut self.forced_words[cell.0 as usize];
        self.forces -= u32::from(*forced);
        *forced = false;
    }
}

fn put_unforced<T: Copy>(cells: &mut [T], forced: &[bool], forces: u32, values: &[T]) {
    if forces == 0 {
        return cells.copy_from_slice(values);
    }
    for ((cell, forced), value) in cells.iter_mut().zip(forced).zip(values) {
        if !forced {
            *cell = *value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn packed_bits_equal_the_bits_of_the_image(values: u64, first in 0u32..NEAR as u32 - 64) {
            let mut image = Image::new(NEAR, 1);
            for at in 0..64 {
                image.write_bit(BitCell(first + at), values >> at & 1 != 0);
            }
            prop_assert_eq!(image.packed(BitCell(first)), values);
        }
    }
}
