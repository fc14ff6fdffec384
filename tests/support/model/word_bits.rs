//! Random bits of words.

use super::pool::Pool;

/// The words whose bits are drawn, each with the number of its bits.
const WORDS: [(&str, u32); 9] = [
    ("D0", 32),
    ("D1", 32),
    ("D2", 32),
    ("V0", 16),
    ("MHR1", 16),
    ("CT0.Acc", 32),
    ("T1.Acc", 32),
    ("N0.ACC", 16),
    ("N1.PRE", 16),
];

impl Pool {
    /// The number of a bit: mostly a low one, or the highest.
    fn bit_number(&mut self, count: u32) -> u32 {
        match self.rng.weighted(&[70, 15, 15]) {
            0 => self.rng.below(4) as u32,
            1 => self.rng.below(count as usize) as u32,
            _ => count - 1,
        }
    }

    /// A word with so many bits at least.
    pub fn word_of(&mut self, count: usize) -> String {
        let fit = WORDS.iter().filter(|(_, bits)| count <= *bits as usize);
        let fit: Vec<&str> = fit.map(|(word, _)| *word).collect();
        let word = *self.rng.pick(&fit);
        self.name(word)
    }

    /// A bit of a word to read: of an element that a word selects, too.
    pub fn word_bit(&mut self) -> String {
        if self.rng.chance(20)
            && let Some(element) = self.element(false, false)
        {
            return format!("{element}.{}", self.bit_number(16));
        }
        let (word, count) = match self.rng.chance(10) {
            true => ("$ScanCounter", 32),
            false => *self.rng.pick(&WORDS),
        };
        let address = format!("{word}.{}", self.bit_number(count));
        self.name(&address)
    }

    /// The address of a bit of a word that no tag limits; `None` if there is none.
    pub fn written_word_bit(&mut self) -> Option<String> {
        let free = WORDS.iter().filter(|(word, _)| !self.limits.contains_key(*word));
        let free: Vec<(&str, u32)> = free.copied().collect();
        let (word, count) = if free.is_empty() { return None } else { *self.rng.pick(&free) };
        Some(format!("{word}.{}", self.bit_number(count)))
    }

    /// A bit of an element of an array of words that a word selects, to write: only while no tag
    /// limits a word.
    pub fn written_element_bit(&mut self) -> Option<String> {
        let element = self.element(false, true).filter(|_| self.limits.is_empty())?;
        Some(format!("{element}.{}", self.bit_number(16)))
    }
}
