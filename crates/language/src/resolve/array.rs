//! Arrays: neighbouring bits, words or structures of one space, and elements that a word selects.
//!
//! The scope makes them from names (`recipe`, `recipe[0..6]`, `recipe[step]`); contacts,
//! instructions and formulas contain them. An element with a constant index is a plain address.

use std::fmt;

use rungd_engine::isa::{Address, Bit, NumberRange, Space, Word, WordBit};

/// Neighbouring bits, words or structures of one space, or one member of each structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Array {
    /// The space.
    pub space: Space,
    /// The number of element 0, as written.
    pub first: u32,
    /// The number of elements; at least 1.
    pub count: u32,
    /// If its elements are bits of words: the number of the bit in each word.
    pub bit: Option<u8>,
    /// The member that each element is, in an array of structures: `lanes[i].Acc`.
    pub member: Option<&'static str>,
}

/// An element of an array. A word selects it at run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArrayElement {
    /// The array.
    pub array: Array,
    /// The word that contains the element's number, from 0.
    pub index: Word,
}

/// Bits that SR shifts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShiftBits {
    /// The bits.
    pub array: Array,
    /// Whether the shift begins at the last bit: `data` goes into the last bit instead of the
    /// first.
    pub down: bool,
}

impl Array {
    /// The address of an element.
    pub fn element(&self, at: u32) -> Address {
        self.address(self.first + at)
    }

    fn address(&self, number: u32) -> Address {
        let address = match (self.space.address(number), self.member) {
            (Address::Structure(structure), Some(member)) => {
                structure.member(member).unwrap_or(Address::Structure(structure))
            }
            (address, _) => address,
        };
        match (address, self.bit) {
            (Address::Word(word), Some(number)) => {
                Address::Bit(Bit::InWord(WordBit { word, number }))
            }
            (Address::Bit(_) | Address::Word(_) | Address::Structure(_), _) => address,
        }
    }

    /// The array of the words, if its elements are bits of words; else itself.
    pub fn of_words(&self) -> Array {
        Array { bit: None, ..*self }
    }

    /// The number of the bit in each word, as text behind an element: `.3`; else nothing.
    pub fn bit_text(&self) -> String {
        self.bit.map_or(String::new(), |number| format!(".{number}"))
    }

    /// One member of each of its structures; `None` if they have no such member.
    pub fn of_member(&self, member: &str) -> Option<Array> {
        let Address::Structure(structure) = self.element(0) else { return None };
        let member = structure.member(member)?.member()?;
        Some(Array { member: Some(member), ..*self })
    }

    /// Whether its elements are whole structures.
    pub fn is_structures(&self) -> bool {
        matches!(self.element(0), Address::Structure(_))
    }

    /// Its numbers as written, with their space.
    pub fn numbers(&self) -> NumberRange<Space> {
        NumberRange { kind: self.space, first: self.first, last: self.first + self.count - 1 }
    }

    /// All addresses, element 0 first.
    pub fn addresses(&self) -> impl Iterator<Item = Address> + use<> {
        let array = *self;
        (0..array.count).map(move |at| array.element(at))
    }

    /// The elements `low..=high`.
    pub fn slice(&self, low: u32, high: u32) -> Array {
        Array { first: self.first + low, count: high - low + 1, ..*self }
    }

    /// Whether its elements are bits.
    pub fn is_bits(&self) -> bool {
        matches!(self.element(0), Address::Bit(_))
    }

    /// Whether its elements are reals.
    pub fn is_real(&self) -> bool {
        matches!(self.element(0), Address::Word(word) if word.is_real())
    }

    /// Element 0 of an array of words; `None` for an array of bits.
    pub fn first_word(&self) -> Option<Word> {
        if let Address::Word(word) = self.element(0) { Some(word) } else { None }
    }

    /// Whether a program may write its elements.
    pub fn is_writable(&self) -> bool {
        match self.element(0) {
            Address::Bit(bit) => bit.writable_by_ladder(),
            Address::Word(word) => word.writable(),
            Address::Structure(_) => false,
        }
    }
}

impl fmt::Display for Array {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{}", self.element(0), self.element(self.count - 1))
    }
}

impl fmt::Display for ShiftBits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ShiftBits { array, down } = self;
        match down {
            true => write!(f, "{}..{}", array.element(array.count - 1), array.element(0)),
            false => array.fmt(f),
        }
    }
}

impl fmt::Display for ArrayElement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = self.array.of_words();
        write!(f, "{words}[{}]{}", self.index, self.array.bit_text())
    }
}
