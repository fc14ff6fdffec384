//! The elements of the map: the bit or register at each address of each table.
//!
//! The map builds [`TableElements`] once, for all units or for one unit, and looks up elements in
//! them. Each element contains all data for reading and writing it, so a request needs no ranges
//! and no settings.

use super::number::{RegisterNumberType, WordOrder};
use super::pdu::ModbusTable;
use super::refusal::ModbusRefusal;
use rungd_engine::isa::{Bit, Real, Word};
use rungd_engine::{Cell, WordCell};
use rungd_runtime::exchange::Snapshot;

/// A set of write lists, one bit per list: the lists that contain an element, or the lists that
/// admit a client.
pub(super) type ListSet = u64;

/// A coil or discrete input.
#[derive(Clone, Copy, Debug)]
pub(super) struct BitElement {
    pub bit: Bit,
    pub cell: Cell,
    /// The number of the Y whose output value it shows.
    pub output: Option<u32>,
    pub lists: ListSet,
    /// The number of the X that it is copied to.
    pub input: Option<u32>,
}

/// A register: a word, or half of one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Register {
    pub word: Word,
    pub cell: WordCell,
    pub kind: RegisterNumberType,
    pub part: RegisterPart,
    pub order: WordOrder,
    pub lists: ListSet,
    /// The least and greatest value of the word: its range, narrowed by its tags.
    pub limits: (i32, i32),
}

/// The part of the word that a register holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RegisterPart {
    Whole,
    First,
    Second,
}

/// The elements of the four tables.
#[derive(Debug, Default)]
pub(super) struct TableElements {
    pub coils: ElementRows<BitElement>,
    pub discrete: ElementRows<BitElement>,
    pub holding: ElementRows<Register>,
    pub input: ElementRows<Register>,
}

/// Elements by address: rows of consecutive addresses, in ascending order.
#[derive(Debug)]
pub(super) struct ElementRows<T>(Vec<(u32, Vec<T>)>);

impl<T> Default for ElementRows<T> {
    fn default() -> Self {
        ElementRows(Vec::new())
    }
}

impl<T> ElementRows<T> {
    /// Adds a row after or between the others. Its addresses must be free.
    pub fn add(&mut self, first: u32, elements: Vec<T>) {
        if !elements.is_empty() {
            let at = self.0.partition_point(|(other, _)| *other < first);
            self.0.insert(at, (first, elements));
        }
    }

    /// The element at an address.
    pub fn at(&self, address: u32) -> Option<&T> {
        let row = self.0.partition_point(|(first, _)| *first <= address).checked_sub(1)?;
        let (first, elements) = self.0.get(row)?;
        elements.get((address - first) as usize)
    }
}

impl TableElements {
    /// The bits of a table of bits.
    pub fn bits(&self, table: ModbusTable) -> &ElementRows<BitElement> {
        if table == ModbusTable::Coils { &self.coils } else { &self.discrete }
    }

    /// The registers of a table of words.
    pub fn words(&self, table: ModbusTable) -> &ElementRows<Register> {
        if table == ModbusTable::HoldingRegisters { &self.holding } else { &self.input }
    }
}

impl BitElement {
    /// The value that a read shows.
    pub fn shown(&self, snapshot: &Snapshot) -> bool {
        match self.output {
            Some(y) => snapshot.outputs[y as usize] != 0,
            None => snapshot.value(self.cell) != 0,
        }
    }
}

impl Register {
    /// The value that a read shows; a value beyond the type becomes the nearest value of the type.
    pub fn shown(&self, snapshot: &Snapshot) -> u16 {
        let content = snapshot.word(self.cell);
        let bits = match self.word.is_real() {
            true => self.kind.nearest_bits(Real::of_cell(content).into()),
            false => self.kind.bits(content.into()),
        };
        let [first, second] = self.order.split(bits as u32);
        match self.part {
            RegisterPart::Whole => bits as u16,
            RegisterPart::First => first,
            RegisterPart::Second => second,
        }
    }

    /// The word's value from its only register, or from its two registers in the order of their
    /// addresses.
    ///
    /// # Errors
    /// If the word does not accept the value.
    pub fn value(&self, first: u16, second: Option<u16>) -> Result<i32, ModbusRefusal> {
        let bits = second.map_or(first.into(), |second| self.order.join(first, second).into());
        let (min, max) = self.limits;
        let (word, kind) = (self.word, self.kind);
        let beyond = ModbusRefusal::BeyondLimits { word, kind, bits, min, max };
        let content = match self.word.is_real() {
            true => self.kind.number(bits).and_then(|number| {
                let nearest = Real::stored(number);
                (!nearest.is_beyond).then(|| nearest.real.cell())
            }),
            false => self.kind.value(bits).and_then(|value| i32::try_from(value).ok()),
        };
        content.filter(|content| (min..=max).contains(content)).ok_or(beyond)
    }

    /// Whether it accepts and shows every 16-bit value, so that every mask write is valid.
    pub fn takes_mask(&self) -> bool {
        let (min, max) = self.limits;
        self.part == RegisterPart::Whole && self.kind.range() == (min.into(), max.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_by_address() {
        let mut rows = ElementRows::default();
        rows.add(10, vec!['d', 'e']);
        rows.add(0, vec!['a', 'b', 'c']);
        rows.add(3, vec!['x']);
        rows.add(7, Vec::new());
        let found: String = (0..14).map(|at| rows.at(at).copied().unwrap_or('.')).collect();
        assert_eq!(found, "abcx......de..");
        assert_eq!(rows.at(u32::MAX), None);
        assert_eq!(ElementRows::<char>::default().at(0), None);
    }
}
