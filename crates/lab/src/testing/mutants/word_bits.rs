//! Another bit of the same word, as an author mistypes the number of a bit of a status word.
//!
//! Called by `contacts`, `formula` and `instructions`, which make the mutations.

use rungd_engine::isa::{Bit, WordBit};

/// The next bit of the word; of its highest bit, the one below. `None`: no bit of a word.
pub(super) fn other_bit_of_word(bit: Bit) -> Option<WordBit> {
    let WordBit { word, number } = bit.of_word()?;
    let is_highest = number + 1 >= word.bit_count();
    let number = if is_highest { number.checked_sub(1)? } else { number + 1 };
    Some(WordBit { word, number })
}

/// The text of a bit with the number of another bit; of a tag that is the bit, with the number
/// behind its name.
pub(super) fn with_number(written: &str, bit: Bit, other: WordBit) -> String {
    let ends = bit.of_word().map(|bit| format!(".{}", bit.number)).unwrap_or_default();
    match written.strip_suffix(&ends) {
        Some(word) if !ends.is_empty() => format!("{word}.{}", other.number),
        Some(_) | None => format!("bit {} of its word", other.number),
    }
}
