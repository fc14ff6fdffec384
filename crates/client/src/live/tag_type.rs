//! The type in which the value of a tag is passed on to other systems: the smallest that has the
//! range of its values.
//!
//! Used by `edge` (Sparkplug) and by the OPC UA server, which give it the names of their standards.

use rungd_engine::Cell;
use rungd_engine::isa::{Address, Word};
use rungd_language::lower::Symbols;

/// The type of a tag's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TagType {
    /// A bit.
    Bit,
    /// 0 to 65535.
    Unsigned16,
    /// -32768 to 32767.
    Signed16,
    /// Any other integer.
    Signed32,
    /// binary32.
    Real,
}

impl TagType {
    /// The type of an operand with its cell.
    pub fn of(address: Address, cell: Cell, symbols: &Symbols) -> TagType {
        match (address, cell) {
            (_, Cell::Bit(_) | Cell::WordBit(_)) => TagType::Bit,
            (_, Cell::Word(word)) if symbols.layout.is_real(word) => TagType::Real,
            (Address::Word(word @ Word::Space(..)), _) => match word.range() {
                (0.., 0..=0xffff) => TagType::Unsigned16,
                (-0x8000.., ..=0x7fff) => TagType::Signed16,
                _ => TagType::Signed32,
            },
            (
                Address::Word(Word::Acc(_) | Word::Pre(_))
                | Address::Bit(_)
                | Address::Structure(_),
                _,
            ) => TagType::Signed32,
        }
    }
}
