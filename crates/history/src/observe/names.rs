//! The operand of a cell, as answers name it.

use super::answer::OperandName;
use super::subject::Subject;
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Structure, Word};

impl Subject {
    /// The address of a public cell.
    pub(super) fn address(&self, cell: Cell) -> Option<Address> {
        self.symbols.layout.address(cell)
    }

    /// The operand of a cell.
    pub fn operand(&self, cell: Cell) -> OperandName {
        let (address, names) = (self.address(cell), &self.symbols.names);
        let tag = address.and_then(|address| names.operand_tag(address));
        let (name, own) = (tag.map(|tag| tag.to_string()), address.map(|at| names.nickname(at)));
        let doc = tag.filter(|tag| tag.member.is_none() && tag.bit.is_none()).map(|tag| tag.index);
        OperandName {
            cell,
            address: own.clone().filter(|own| name.as_ref().is_some_and(|name| name != own)),
            name: name.or(own).unwrap_or_default(),
            doc: doc.and_then(|index| self.program.tags[index].doc.clone()),
            is_bit: cell.is_bit(),
            is_real: matches!(cell, Cell::Word(word) if self.symbols.layout.is_real(word)),
            texts: address.and_then(|address| names.texts(address)).cloned(),
            is_time: matches!(address, Some(Address::Word(Word::Acc(Structure::Timer(_))))),
        }
    }
}

impl OperandName {
    /// The text of a value, if its tag gives one.
    pub fn text(&self, value: i32) -> Option<&str> {
        self.texts.as_ref()?.text(value)
    }
}
