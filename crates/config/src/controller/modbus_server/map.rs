//! The explicit map of the Modbus server, resolved: no two operands have the same place.
//!
//! Called by [`super`]; the server builds its own map from the entries resolved here.
//!
//! ```toml
//! # passes: two registers from 4000 on, four discrete inputs from 0 on where MI1 is moved away
//! [modbus-server]
//! standard-map = false
//! [[modbus-server.map]]
//! operand = "CT0.Acc"
//! table   = "holding"
//! address = 4000
//! [[modbus-server.map]]
//! operand = "X0..X3"
//! table   = "discrete"      # fails with "holding": X is a bit
//! address = 0
//! ```

use std::collections::HashSet;

use super::keys::{self as written, NUMBER_TYPE};
use crate::controller::resolver::SettingsResolver;
use rungd_engine::isa::{Address, MemorySizes, NumberRange, NumberRanges};
use rungd_io::modbus::number::{RegisterNumberType, WordOrder};
use rungd_io::modbus::settings::{MappedOperands, ModbusTable};
use rungd_language::resolve::operands::{Operands, resolve_operands};
use rungd_language::resolve::scope::Scope;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, Help, pair, possible, propose, proposed};
use rungd_language::source::span::{Located, Span};

/// Protocol addresses are 16 bits.
const ADDRESSES: u32 = 65_536;

/// The valid entries. Wrong entries, and conflicts between entries, become findings of the
/// resolver.
pub(super) fn resolve(
    server: &written::WrittenModbusServer,
    sizes: &MemorySizes,
    resolver: &mut SettingsResolver,
) -> Vec<MappedOperands> {
    let SettingsResolver { scope, progress, findings, .. } = resolver;
    let mut entries: Vec<MappedOperands> = Vec::new();
    let mut taken = TakenPlaces::default();
    let units = server.settings.units.as_ref();
    let answered: HashSet<u8> = units.into_iter().flatten().copied().collect();
    for map in progress.during(&server.maps) {
        let Some(entry) = resolve_entry(map, scope, findings) else { continue };
        let lies_at = |table: ModbusTable, at| {
            server.settings.standard_map.then(|| standard(table, sizes) > at)
        };
        if lies_at(entry.table, u32::from(entry.address)) == Some(true) {
            findings.push(over_standard(&entry, server.span, sizes));
        }
        if let Some(other) = taken.by(&entry).map(|at| &entries[at]) {
            let (one, another) = (&entry.operands, &other.operands);
            let message = format!("`{one}` at {}, where `{another}` is", place(&entry));
            let words = format!("`{another}` is at {}", place(other));
            let finding = Finding::new(Code::Controller, entry.span, message);
            let free = pair(format!("address = {}", addresses(other, ()).last + 1)).possible();
            let finding = finding.related(other.span, words);
            findings.push(finding.help("give one of them another address").fix(free));
        }
        if let (Some(_), Some(unit)) = (units, &map.unit)
            && !answered.contains(&unit.value)
        {
            findings.push(beside_units(server.units_at, unit));
        }
        taken.add(&entry, entries.len());
        entries.push(entry);
    }
    entries
}

/// The number of elements that the standard map has in a table, from address 0.
fn standard(table: ModbusTable, sizes: &MemorySizes) -> u32 {
    match table {
        ModbusTable::Coils => sizes.mc,
        ModbusTable::DiscreteInputs => sizes.mi,
        ModbusTable::HoldingRegisters => sizes.mhr,
        ModbusTable::InputRegisters => sizes.mir,
    }
}

fn over_standard(entry: &MappedOperands, server: Span, sizes: &MemorySizes) -> Finding {
    let count = standard(entry.table, sizes);
    let space = entry.table.prefix();
    let message = format!("`{}` at {}, where the standard map is", entry.operands, place(entry));
    Finding::new(Code::Controller, entry.span, message)
        .related(
            server,
            format!("{space}1..{space}{count} are at {} 0..{}", entry.table.name(), count - 1),
        )
        .help(
            propose(pair(format!("address = {count}")))
                .and(" or a higher one, or `standard-map = false`"),
        )
}

/// The places that entries have taken.
#[derive(Default)]
struct TakenPlaces {
    of_any: NumberRanges<ModbusTable>,
    /// Those of the entries for one unit, and of the entries for all units.
    of_units: NumberRanges<(ModbusTable, Option<u8>)>,
}

impl TakenPlaces {
    fn add(&mut self, entry: &MappedOperands, index: usize) {
        self.of_any.add(addresses(entry, entry.table), index);
        self.of_units.add(addresses(entry, (entry.table, entry.unit)), index);
    }

    /// The first entry that has an address of this entry. An entry without a unit is there for all.
    fn by(&self, entry: &MappedOperands) -> Option<usize> {
        let Some(unit) = entry.unit else {
            return self.of_any.first_in(addresses(entry, entry.table));
        };
        let of_unit = |unit| self.of_units.first_in(addresses(entry, (entry.table, unit)));
        of_unit(None).into_iter().chain(of_unit(Some(unit))).min()
    }
}

/// An entry's addresses, as numbers of a kind.
fn addresses<K>(entry: &MappedOperands, kind: K) -> NumberRange<K> {
    let first = u32::from(entry.address);
    NumberRange { kind, first, last: first + entry.length() - 1 }
}

/// An entry's table and addresses, for a message.
fn place(entry: &MappedOperands) -> String {
    let (first, length) = (u32::from(entry.address), entry.length());
    let unit = entry.unit.map_or(String::new(), |unit| format!(" of unit {unit}"));
    match length {
        1 => format!("{} {first}{unit}", entry.table.name()),
        _ => format!("{} {first}..{}{unit}", entry.table.name(), first + length - 1),
    }
}

/// The finding for an entry with a unit that the server does not answer for.
fn beside_units(units_at: Span, unit: &Located<u8>) -> Finding {
    let message = format!("the server does not answer for unit {}", unit.value);
    let finding = Finding::new(Code::Controller, unit.span, message);
    let finding = finding.related(units_at, "it answers for these units");
    let pair = format!("units = [{}]", unit.value);
    finding.help("add it to `units`").fix(possible(FixEdit::Under { table: "modbus-server", pair }))
}

fn resolve_entry(
    map: &written::WrittenMapEntry,
    scope: &Scope,
    findings: &mut Vec<Finding>,
) -> Option<MappedOperands> {
    let operands = map.operand.as_ref().and_then(|text| {
        resolve_operands(scope, text).map_err(|finding| findings.push(finding)).ok()
    });
    let (operands, table, address) = (operands?, map.table?, map.address.as_ref()?.value);
    let order = map.word_order.as_ref().map_or(WordOrder::default(), |order| order.value);
    let unit = map.unit.as_ref().map(|unit| unit.value);
    let kind = match (operands.first, &map.kind) {
        (Address::Word(_), Some(kind)) => Some(kind.value),
        (Address::Word(word), None) => Some(RegisterNumberType::of(word)),
        (Address::Bit(_) | Address::Structure(_), _) => None,
    };
    let entry = MappedOperands { operands, table, address, kind, order, unit, span: map.span };
    let wrong = fits_type(map, &entry)
        .or_else(|| fits_table(map, &entry))
        .or_else(|| fits_addresses(map, &entry));
    let Some(finding) = wrong else { return Some(entry) };
    findings.push(finding);
    None
}

/// The finding for a word of reals with an integer type, or a word of integers with a real type.
fn fits_type(map: &written::WrittenMapEntry, entry: &MappedOperands) -> Option<Finding> {
    let (Address::Word(word), Some(kind)) = (entry.operands.first, &map.kind) else { return None };
    let (is, words, right): (_, _, &[&str]) =
        match (word.is_real(), kind.value == RegisterNumberType::F32) {
            (true, false) => ("holds reals", "write `f32`, or nothing", &["f32"]),
            (false, true) => (
                "holds whole numbers",
                "write `u16`, `i16`, `u32` or `i32`",
                &["u16", "i16", "u32", "i32"],
            ),
            (true, true) | (false, false) => return None,
        };
    let message = format!("`{word}` {is}: no `{}`", NUMBER_TYPE.word(kind.value));
    let help = Help::from(words).with_all(right.iter().map(|right| proposed(*right)));
    Some(Finding::new(Code::Controller, kind.span, message).help(help))
}

/// The finding for words in a table of bits, or bits in a table of words.
fn fits_table(map: &written::WrittenMapEntry, entry: &MappedOperands) -> Option<Finding> {
    let bits = matches!(entry.table, ModbusTable::Coils | ModbusTable::DiscreteInputs);
    let Operands { first, span, .. } = &entry.operands;
    let (is, instead) = match (first, bits) {
        (Address::Bit(_), false) => ("registers are words", ["coil", "discrete"]),
        (Address::Word(_), true) => ("coils and discrete inputs are bits", ["holding", "input"]),
        _ => {
            let kind = map.kind.as_ref().map(|kind| ("type", kind.span));
            let order = map.word_order.as_ref().map(|order| ("word-order", order.span));
            let (key, span) = kind.or(order)?;
            let single = entry.kind.is_some_and(|kind| kind.registers() == 1);
            let why = match (bits, key == "word-order" && single) {
                (true, _) => "a bit has none",
                (false, true) => "one register has none",
                (false, false) => return None,
            };
            let message = format!("`{key}` has no effect here: {why}");
            return Some(Finding::new(Code::Controller, span, message).or_omit());
        }
    };
    let message = format!("`{}` in table `{}`: {is}", entry.operands, entry.table.name());
    let help = format!("its table is `{}` or `{}`", instead[0], instead[1]);
    let tables = instead.map(|table| pair(format!("table = \"{table}\"")).possible());
    Some(Finding::new(Code::Controller, *span, message).help(help).fixes(tables))
}

fn fits_addresses(map: &written::WrittenMapEntry, entry: &MappedOperands) -> Option<Finding> {
    let end = u32::from(entry.address) + entry.length();
    if end <= ADDRESSES {
        return None;
    }
    let span = map.address.as_ref().map_or(map.span, |address| address.span);
    let length = entry.length();
    let message = format!("{length} addresses from {} reach beyond 65535", entry.address);
    let finding = Finding::new(Code::OutOfRange, span, message);
    Some(match ADDRESSES.checked_sub(length) {
        Some(last) => {
            let fix = pair(format!("address = {last}"));
            finding.help(format!("the highest first address is {last}")).fix(fix)
        }
        None => finding,
    })
}
