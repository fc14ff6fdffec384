//! The notation of a Modbus device's points: `coil 0..7`, `holding 100`, `holding 5.3`.
//!
//! Called by the driver's resolver for each row. Addresses are those of the protocol, from 0, as in
//! the bytes of a request, in decimal or hexadecimal (`holding 0x9C41`). This file does not
//! consider the number type of registers: a stretch consists of bits or of registers. `manuals` has
//! the notations of manuals and of other programs.

use super::manuals::{self, ManualNumber, ManualReading};
use super::stretch::ElementStretch;
use crate::controller::device::driver::PointBeginning;
use rungd_io::modbus::settings::ModbusTable;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Help, advise, meant, proposed};
use rungd_language::source::nearest::nearest;
use rungd_language::source::reader::Text;
use rungd_language::source::span::Located;

/// Whether a text is intended as this notation, even if it has mistakes. An address of memory never
/// has a space before a digit.
pub(super) fn is_point(text: &str) -> bool {
    let Some((table, rest)) = text.trim().split_once(char::is_whitespace) else { return false };
    table.chars().all(|c| c.is_ascii_alphabetic() || c == '-')
        && rest.trim_start().starts_with(|c: char| c.is_ascii_digit())
}

/// The finding for a text that is no address of memory, but points in the notation of a manual or
/// of another program: `40001`, `%MW100`.
pub(super) fn other_notation(points: &Text) -> Option<Finding> {
    let readings = manuals::readings(&points.text);
    let text = &points.text;
    let message = format!("`{text}` is in a notation of manuals and other programs");
    let finding = Finding::new(Code::Controller, points.span, message);
    (!readings.is_empty()).then(|| {
        finding.help(rows_help("addresses are those of the protocol, from 0: write", &readings))
    })
}

/// The beginnings of points, for editors: the tables of a device.
pub(in crate::controller::device) fn beginnings() -> Vec<PointBeginning> {
    let beginning = |table: ModbusTable| {
        let element = if table.is_bits() { "bit" } else { "word" };
        let access = if table.is_writable() { "read and written" } else { "only read" };
        let (text, about) = (format!("{} ", table.name()), format!("a {element}, {access}"));
        PointBeginning { text, about, is_written: table.is_writable() }
    };
    ModbusTable::NAMES.into_iter().map(|(_, table)| beginning(table)).collect()
}

/// The points of a text, or the finding with the text to write instead.
pub(super) fn parse(points: &Text) -> Result<ElementStretch, Finding> {
    let text = &points.text;
    let find = |message: String| Finding::new(Code::Controller, points.span, message);
    let help_or = |help: Help| match &manuals::readings(text)[..] {
        [] => help,
        readings => rows_help("write", readings),
    };
    let (table, rest) = text.trim().split_once(char::is_whitespace).unwrap_or((text, ""));
    let named = ModbusTable::NAMES.into_iter().find(|(name, _)| *name == table);
    let (_, table) = named.ok_or_else(|| {
        find(format!("no table of a Modbus device is called `{table}`"))
            .help(help_or(table_help(table, rest.trim())))
    })?;
    let rest = rest.trim();
    let (low, high) = rest.split_once("..").unwrap_or((rest, rest));
    let wrong = || {
        let name = table.name();
        let example = proposed(format!("{name} {}", if table.is_bits() { "0..7" } else { "0..3" }));
        let help = match table.is_bits() {
            true => advise("write `{}`; addresses are 0 to 65535", [example]),
            false => advise(
                "write `{}` or `{}`; addresses are 0 to 65535",
                [example, proposed("holding 5.3")],
            ),
        };
        find(format!("`{text}` names no points")).help(help_or(help))
    };
    let first = element(low.trim(), table).ok_or_else(wrong)?;
    let last = element(high.trim(), table).ok_or_else(wrong)?;
    let is_bit = first.is_bit;
    if is_bit != last.is_bit || (is_bit && table.is_bits()) {
        return Err(wrong());
    }
    let is_hexadecimal = first.is_hexadecimal || last.is_hexadecimal;
    let (first, last) = (first.number, last.number);
    if last < first {
        let range = format!("{} {}..{}", table.name(), high.trim(), low.trim());
        return Err(find("a range goes from low to high".into()).write(range));
    }
    let count = last - first + 1;
    Ok(ElementStretch { table, first, count, is_bits_of_registers: is_bit, is_hexadecimal })
}

/// The warning for a valid number that many manuals use in a different way.
pub(super) fn doubt(points: &Text, stretch: &ElementStretch, is_output: bool) -> Option<Finding> {
    let ManualNumber { number, row, exact } = manuals::doubt(stretch, is_output)?;
    let message = format!("`{}` can be a number of a manual that counts from 1", points.text);
    let label = format!("protocol address {number}; a manual's {number} is `{row}`");
    let help = format!(
        "if the manual counts so, write `{row}`; if {number} is the protocol's address, write \
         `{exact}`, or in a ladder `allow = [\"vendor-number\"]` under `[ladder]`"
    );
    let finding = Finding::new(Code::VendorNumber, points.span, message).label(label).help(help);
    Some([row, exact].into_iter().fold(finding, |finding, row| finding.fix(proposed(row))))
}

/// The same for the register of a watchdog.
pub(super) fn doubt_of_watchdog(register: &Located<u16>) -> Option<Finding> {
    let (table, first) = (ModbusTable::HoldingRegisters, u32::from(register.value));
    let stretch = ElementStretch {
        table,
        first,
        count: 1,
        is_bits_of_registers: false,
        is_hexadecimal: false,
    };
    let ManualNumber { number, row, .. } = manuals::doubt(&stretch, true)?;
    let address = row.strip_prefix("holding ")?;
    let message = format!("register {number} can be a number of a manual that counts from 1");
    let label = format!("protocol address {number}; a manual's {number} is {address}");
    let help = format!(
        "if the manual counts so, write `{address}`; if {number} is the protocol's address, write \
         in a ladder `allow = [\"vendor-number\"]` under `[ladder]`"
    );
    let finding = Finding::new(Code::VendorNumber, register.span, message).label(label);
    Some(finding.help(help).fix(proposed(address)))
}

/// A help with readings.
fn rows_help(words: &str, readings: &[ManualReading]) -> Help {
    let is_one = readings.len() == 1;
    let row = |reading: &ManualReading| match reading.when {
        "" => format!("`{}`", reading.row),
        _ if is_one => format!("`{}`", reading.row),
        when => format!("`{}` ({when})", reading.row),
    };
    let rows = readings.iter().map(row).collect::<Vec<_>>().join(", or ");
    let help = Help::from(format!("{words} {rows}"));
    help.with_all(readings.iter().map(|reading| proposed(&*reading.row)))
}

/// The help for a word that is not the name of a table.
fn table_help(name: &str, points: &str) -> Help {
    let names = || ModbusTable::NAMES.into_iter().map(|(name, _)| name);
    let longer = names().find(|known| name.to_ascii_lowercase().starts_with(known));
    match longer.or_else(|| nearest(name, names())) {
        Some(known) => meant(format!("{known} {points}")),
        None => "there are `coil`, `discrete`, `holding` and `input`".into(),
    }
}

/// An element of a table, as a text names it.
struct WrittenElement {
    number: u32,
    /// Whether the text names a bit of a register.
    is_bit: bool,
    is_hexadecimal: bool,
}

/// Reads `5` as element 5, and `5.3` as bit 16 * 5 + 3.
fn element(text: &str, table: ModbusTable) -> Option<WrittenElement> {
    let (register, bit) = text.split_once('.').map_or((text, None), |(at, bit)| (at, Some(bit)));
    let is_hexadecimal = register.starts_with("0x");
    let register = match is_hexadecimal {
        true => hexadecimal(register, table)?,
        false => number(register)?,
    };
    let Some(bit) = bit else {
        return Some(WrittenElement { number: register, is_bit: false, is_hexadecimal });
    };
    let bit = number(bit).filter(|bit| *bit < 16)?;
    Some(WrittenElement { number: register * 16 + bit, is_bit: true, is_hexadecimal })
}

fn number(text: &str) -> Option<u32> {
    let is_plain = text.bytes().all(|byte| byte.is_ascii_digit());
    let is_plain = is_plain && (text == "0" || !text.starts_with('0'));
    text.parse().ok().filter(|n| is_plain && *n <= u32::from(u16::MAX))
}

/// Reads `0x9C41`. A coil `0x0001` is refused: in manuals it is the first coil.
fn hexadecimal(text: &str, table: ModbusTable) -> Option<u32> {
    let digits = text.strip_prefix("0x")?;
    let is_manual = table == ModbusTable::Coils
        && digits.len() >= 4
        && digits.bytes().all(|byte| byte.is_ascii_digit());
    let is_plain = digits.bytes().all(|byte| byte.is_ascii_hexdigit()) && !is_manual;
    u32::from_str_radix(digits, 16).ok().filter(|n| is_plain && *n <= u32::from(u16::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rungd_language::source::span::Span;

    fn points(text: &str) -> Text {
        Text { text: text.to_owned(), span: Span::default(), exact: false }
    }

    fn stretch(text: &str) -> (ModbusTable, u32, u32, bool) {
        let found = parse(&points(text)).unwrap_or_else(|finding| panic!("{text}: {finding:?}"));
        (found.table, found.first, found.count, found.is_bits_of_registers)
    }

    fn help(text: &str) -> String {
        assert!(is_point(text), "{text}");
        parse(&points(text)).unwrap_err().help_text().unwrap_or_default().into_owned()
    }

    fn other(text: &str) -> String {
        assert!(!is_point(text), "{text}");
        let finding = other_notation(&points(text)).unwrap_or_else(|| panic!("{text}"));
        let help = finding.help_text().unwrap_or_default().into_owned();
        help.strip_prefix("addresses are those of the protocol, from 0: write ").unwrap().to_owned()
    }

    #[test]
    fn points_are_read_as_table_address_and_count() {
        assert_eq!(stretch("coil 0..7"), (ModbusTable::Coils, 0, 8, false));
        assert_eq!(stretch("discrete 65535"), (ModbusTable::DiscreteInputs, 65_535, 1, false));
        assert_eq!(stretch("holding 10 .. 11"), (ModbusTable::HoldingRegisters, 10, 2, false));
        assert_eq!(stretch("holding 5.3"), (ModbusTable::HoldingRegisters, 83, 1, true));
        assert_eq!(stretch("input  5.0..6.15"), (ModbusTable::InputRegisters, 80, 32, true));
    }

    #[test]
    fn a_hexadecimal_address_is_the_address_of_the_protocol() {
        assert_eq!(stretch("holding 0x9C41"), (ModbusTable::HoldingRegisters, 40_001, 1, false));
        assert_eq!(stretch("input 0x10..0x11"), (ModbusTable::InputRegisters, 16, 2, false));
        assert_eq!(stretch("holding 0x9c41.3"), (ModbusTable::HoldingRegisters, 640_019, 1, true));
        assert_eq!(stretch("coil 0xFF"), (ModbusTable::Coils, 255, 1, false));
        assert_eq!(
            help("coil 0x0011"),
            "write `coil 10` (of a manual, counted from 1), or `coil 17` (in hexadecimal)"
        );
        assert!(help("holding 0x10000").contains("65535"));
    }

    #[test]
    fn a_wrong_point_is_reported_with_a_correction() {
        assert_eq!(help("discrete-input 0"), "write `discrete 0`");
        assert_eq!(help("coils 0..7"), "write `coil 0..7`");
        assert_eq!(help("Holding 0"), "write `holding 0`");
        assert_eq!(help("holdingg 0"), "did you mean `holding 0`?");
        assert_eq!(help("holding 7..0"), "write `holding 0..7`");
        assert_eq!(help("coil 07"), "write `coil 7`");
        for text in ["coil 65536", "coil 0..", "coil 5.3", "holding 5.16", "holding 5..5.3"] {
            assert!(help(text).contains("65535"), "{text}");
        }
    }

    #[test]
    fn points_in_other_notations_are_reported_with_the_right_row() {
        for (text, rows) in [
            ("400001", "`holding 0`"),
            ("40001", "`holding 0`"),
            ("40001..40004", "`holding 0..3`"),
            ("40001-40004", "`holding 0..3`"),
            ("465536", "`holding 65535`"),
            ("10009", "`discrete 8`"),
            ("00001", "`coil 0`"),
            ("40001.3", "`holding 0.3`"),
            (
                "40001:2",
                "`holding 0.2` (for the bit), or `holding 0..1` (for the number of elements)",
            ),
            ("4x0001", "`holding 0`"),
            ("3X00011", "`input 10`"),
            ("1:0001", "`discrete 0`"),
            ("0x9C41", "`holding 0x9C41`"),
            ("0x0011", "`coil 10` (of a manual, counted from 1), or `holding 17` (in hexadecimal)"),
            ("%MW100", "`holding 100`"),
            ("%mw100.3", "`holding 100.3`"),
            ("%MW100:X3", "`holding 100.3`"),
            ("%IW7", "`input 7`"),
            ("%M5", "`coil 5`"),
            (
                "%MD10",
                "`holding 10..11` (numbered as words), or `holding 20..21` (numbered as double \
                 words)",
            ),
            (
                "%MX5.3",
                "`holding 2.11` (as a bit of a register), or `coil 43` (as a bit of its own)",
            ),
            (
                "HR100",
                "`holding 100` (as a protocol address), or `holding 99` (where the first is 1)",
            ),
            (
                "HR40001",
                "`holding 0` (of a manual, counted from 1), or `holding 0x9C41` (as a protocol \
                 address)",
            ),
            ("holding:3", "`holding 3`"),
            ("holding[3]", "`holding 3`"),
            ("holding register 5", "`holding 5`"),
            ("fc3 5", "`holding 5` (as a protocol address), or `holding 4` (where the first is 1)"),
        ] {
            assert_eq!(other(text), rows, "{text}");
        }
        assert_eq!(help("holding 400001"), "write `holding 0`");
        assert_eq!(
            help("coil 00001"),
            "write `coil 0` (of a manual, counted from 1), or `coil 1` (as a protocol address)"
        );
        assert_eq!(
            help("HR 5"),
            "write `holding 5` (as a protocol address), or `holding 4` (where the first is 1)"
        );
        for text in ["", "%", "%M", "%X5", "4x", "x", "999999", "holding", "D5..", "ä5", "5ä"] {
            let found = other_notation(&points(text));
            assert!(found.is_none(), "{text}: {found:?}");
        }
    }

    #[test]
    fn an_address_that_manuals_number_differently_is_reported() {
        let told = |text: &str, is_output| {
            let manual = manuals::doubt(&parse(&points(text)).unwrap(), is_output)?;
            assert!(manuals::doubt(&parse(&points(&manual.row)).unwrap(), is_output).is_none());
            let exact = parse(&points(&manual.exact)).unwrap();
            assert!(manuals::doubt(&exact, is_output).is_none());
            Some((manual.row, manual.exact))
        };
        for (text, row, exact) in [
            ("holding 40001", "holding 0", "holding 0x9C41"),
            ("holding 40001..40004", "holding 0..3", "holding 0x9C41..0x9C44"),
            ("holding 49999", "holding 9998", "holding 0xC34F"),
            ("holding 40001.15", "holding 0.15", "holding 0x9C41.15"),
            ("input 30011", "input 10", "input 0x753B"),
            ("holding 30011", "input 10", "holding 0x753B"),
            ("input 40011", "holding 10", "input 0x9C4B"),
            ("discrete 10001", "discrete 0", "discrete 0x2711"),
        ] {
            assert_eq!(told(text, false), Some((row.into(), exact.into())), "{text}");
        }
        for text in [
            "holding 40000",
            "holding 40000..40003",
            "holding 49999..50000",
            "holding 10001",
            "holding 50001",
            "holding 0x9C41",
            "coil 1",
            "discrete 40001",
        ] {
            assert_eq!(told(text, false), None, "{text}");
        }
        assert!(told("holding 40001", true).is_some());
        assert_eq!(told("holding 30011", true), None, "no output goes to an input register");
    }

    proptest! {
        #[test]
        fn any_text_is_read_without_a_panic(text in "[%a-zA-Z0-9:./x#&\\[\\] ä-]{0,16}") {
            let points = points(&text);
            let told = other_notation(&points);
            prop_assert_eq!(told.is_some(), !manuals::readings(&text).is_empty());
            for reading in manuals::readings(&text) {
                let stretch = parse(&self::points(&reading.row));
                prop_assert!(stretch.is_ok_and(|of| manuals::doubt(&of, false).is_none()));
            }
            if let Ok(stretch) = parse(&points) {
                let _ = doubt(&points, &stretch, false);
            }
        }
    }

    #[test]
    fn memory_addresses_are_not_read_as_points() {
        for text in ["X0..X7", "X0 .. X7", "D5", "CT0.Acc", "Filling.Fill", "coil", "count", ""] {
            assert!(!is_point(text), "{text}");
            assert!(other_notation(&points(text)).is_none(), "{text}");
        }
    }
}
