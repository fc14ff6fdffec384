//! The places of the map at which Modbus clients find a given bit or word.
//!
//! Used by the cross-reference (`draw::xref`). The server needs the reverse, the operand at a given
//! place, which [`super::ModbusMap`] finds.

use super::number::RegisterNumberType;
use super::settings::{ModbusServerSettings, ModbusTable};
use rungd_engine::isa::{Address, Bit, BitSpace, Word, WordSpace};
use rungd_language::resolve::range::Range;
use rungd_language::source::span::Span;

/// A place of the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModbusPlace {
    /// The table.
    pub table: ModbusTable,
    /// The protocol address of its first element.
    pub first: u32,
    /// The number of its elements: the registers of a word, or 1 for a bit.
    pub count: u32,
    /// The only unit that shows it; `None`: all.
    pub unit: Option<u8>,
    /// Whether a client may write it.
    pub is_writable: bool,
    /// The place of its entry in the file; `None` in the standard map.
    pub span: Option<Span>,
}

impl ModbusServerSettings {
    /// The places of an address: first in the standard map, then in the entries, in their order. A
    /// Y that is copied to an MI also has the places of the MI. An X also has the places of the MC
    /// that is copied to it.
    pub fn places(&self, address: Address) -> Vec<ModbusPlace> {
        let mut all = self.own_places(address);
        let copies = |ranges: Option<(Range, Range)>, from: BitSpace, to: BitSpace| {
            let (at, elements) = ranges?;
            let n = (at.first..=at.last).position(|n| address == bit(from, n))?;
            Some(bit(to, elements.first + n as u32))
        };
        let read = copies(self.outputs, BitSpace::Y, BitSpace::Mi);
        let moved = self.inputs.map(|(mc, x)| (x, mc));
        let moved = copies(moved, BitSpace::X, BitSpace::Mc);
        all.extend(read.into_iter().chain(moved).flat_map(|operand| self.own_places(operand)));
        all
    }

    fn own_places(&self, address: Address) -> Vec<ModbusPlace> {
        let may_write =
            self.lists.iter().flat_map(|list| &list.ranges).any(|range| range.hold(address))
                || self.inputs.is_some_and(|(mc, _)| {
                    (mc.first..=mc.last).any(|n| address == bit(BitSpace::Mc, n))
                });
        let mut all = Vec::new();
        if let Some((table, first)) = standard(address).filter(|_| self.standard_map) {
            let is_writable = may_write && table.is_writable();
            all.push(ModbusPlace { table, first, count: 1, unit: None, is_writable, span: None });
        }
        for entry in &self.entries {
            let Some(at) = entry.operands.addresses().position(|operand| operand == address) else {
                continue;
            };
            let registers = match address {
                Address::Word(word) => {
                    entry.kind.unwrap_or_else(|| RegisterNumberType::of(word)).registers()
                }
                Address::Bit(_) | Address::Structure(_) => 1,
            };
            let count = u32::from(registers);
            let first = u32::from(entry.address) + at as u32 * count;
            let is_writable = may_write && entry.table.is_writable();
            let (table, unit, span) = (entry.table, entry.unit, Some(entry.span));
            all.push(ModbusPlace { table, first, count, unit, is_writable, span });
        }
        all
    }
}

fn bit(space: BitSpace, n: u32) -> Address {
    Address::Bit(Bit::Space(space, n))
}

/// The place in the standard map: MC1 is coil 0.
fn standard(address: Address) -> Option<(ModbusTable, u32)> {
    let (table, n) = match address {
        Address::Bit(Bit::Space(space, n)) => match space {
            BitSpace::Mc => (ModbusTable::Coils, n),
            BitSpace::Mi => (ModbusTable::DiscreteInputs, n),
            BitSpace::X | BitSpace::Y | BitSpace::C | BitSpace::St => return None,
        },
        Address::Word(Word::Space(space, n)) => match space {
            WordSpace::Mhr => (ModbusTable::HoldingRegisters, n),
            WordSpace::Mir => (ModbusTable::InputRegisters, n),
            WordSpace::V | WordSpace::D | WordSpace::R | WordSpace::Dst => return None,
        },
        Address::Bit(
            Bit::Flag(..)
            | Bit::Stage(_)
            | Bit::Running(_)
            | Bit::Done(_)
            | Bit::Device(..)
            | Bit::InWord(_),
        )
        | Address::Word(Word::Acc(_) | Word::Pre(_))
        | Address::Structure(_) => return None,
    };
    Some((table, n.checked_sub(1)?))
}
