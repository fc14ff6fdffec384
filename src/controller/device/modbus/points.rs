//! The notation of a Modbus device's points: `coil 0..7`, `holding 100`, `holding 5.3`.
//!
//! Called by the driver's resolver for each row. Addresses are those of the protocol, from 0, as in
//! the bytes of a request. This file does not consider the number type of registers: a stretch
//! consists of bits or of registers.

use crate::io::modbus::settings::Table;
use crate::source::finding::{Code, Finding};
use crate::source::nearest::did_you_mean;
use crate::source::reader::Text;

/// The bits or registers that a text names: consecutive addresses of one table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stretch {
    pub table: Table,
    /// The first address; for bits of registers, 16 times the register plus the bit.
    pub first: u32,
    pub count: u32,
    /// Bits of registers: `holding 5.0..5.7`.
    pub is_bits_of_registers: bool,
}

/// Whether a text is intended as this notation, even if it has mistakes. An address of memory never
/// has a space before a digit, and is never a bare number.
pub(super) fn is_point(text: &str) -> bool {
    if is_vendor_number(text) {
        return true;
    }
    let Some((table, rest)) = text.trim().split_once(char::is_whitespace) else { return false };
    table.chars().all(|c| c.is_ascii_alphabetic() || c == '-')
        && rest.trim_start().starts_with(|c: char| c.is_ascii_digit())
}

/// Whether a text has the form of a vendor's number: `40001`, `400001`.
fn is_vendor_number(text: &str) -> bool {
    text.len() >= 5 && text.len() <= 6 && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// The points of a text, or the finding with the text to write instead.
pub(super) fn parse(points: &Text) -> Result<Stretch, Finding> {
    let text = &points.text;
    let find = |message: String| Finding::new(Code::Controller, points.span, message);
    if is_vendor_number(text) {
        return Err(find(format!("`{text}` is a vendor's number")).help(vendor_help(text)));
    }
    let (table, rest) = text.trim().split_once(char::is_whitespace).unwrap_or((text, ""));
    let table = Table::named(table).ok_or_else(|| {
        find(format!("no table of a Modbus device is called `{table}`")).help(table_help(table))
    })?;
    let rest = rest.trim();
    let (low, high) = rest.split_once("..").unwrap_or((rest, rest));
    let wrong = || {
        let name = table.name();
        let example = if table.is_bits() { "0..7" } else { "0..3` or `holding 5.3" };
        find(format!("`{text}` names no points"))
            .help(format!("write `{name} {example}`; addresses are 0 to 65535"))
    };
    let first = element(low.trim()).ok_or_else(wrong)?;
    let last = element(high.trim()).ok_or_else(wrong)?;
    let is_bit = first.is_bit;
    if is_bit != last.is_bit || (is_bit && table.is_bits()) {
        return Err(wrong());
    }
    let (first, last) = (first.number, last.number);
    if last < first {
        let help = format!("write `{} {}..{}`", table.name(), high.trim(), low.trim());
        return Err(find("a range goes from low to high".into()).help(help));
    }
    Ok(Stretch { table, first, count: last - first + 1, is_bits_of_registers: is_bit })
}

/// The help for a word that is not the name of a table.
fn table_help(name: &str) -> String {
    let names = || Table::ALL.iter().map(|table| table.name());
    let longer = names().find(|known| name.to_ascii_lowercase().starts_with(known));
    match longer {
        Some(known) => format!("did you mean `{known}`?"),
        None => did_you_mean(name, names())
            .unwrap_or_else(|| "there are `coil`, `discrete`, `holding` and `input`".to_owned()),
    }
}

/// An element of a table, as a text names it.
struct WrittenElement {
    number: u32,
    /// Whether the text names a bit of a register.
    is_bit: bool,
}

/// Reads `5` as element 5, and `5.3` as bit 16 * 5 + 3.
fn element(text: &str) -> Option<WrittenElement> {
    let Some((register, bit)) = text.split_once('.') else {
        return Some(WrittenElement { number: number(text)?, is_bit: false });
    };
    let bit = number(bit).filter(|bit| *bit < 16)?;
    Some(WrittenElement { number: number(register)? * 16 + bit, is_bit: true })
}

fn number(text: &str) -> Option<u32> {
    let is_plain = text.bytes().all(|byte| byte.is_ascii_digit());
    let is_plain = is_plain && (text == "0" || !text.starts_with('0'));
    text.parse().ok().filter(|n| is_plain && *n <= u32::from(u16::MAX))
}

/// The help for a vendor's number: `400001` is the first holding register, 0 in the protocol.
fn vendor_help(text: &str) -> String {
    let (table, element) = text.split_at(1);
    let table = match table {
        "0" => "coil",
        "1" => "discrete",
        "3" => "input",
        "4" => "holding",
        _ => "",
    };
    let address = element.parse::<u32>().ok().and_then(|n| n.checked_sub(1));
    match address {
        Some(address) if !table.is_empty() && address <= u32::from(u16::MAX) => {
            format!("addresses are those of the protocol, from 0: write `{table} {address}`")
        }
        _ => "addresses are those of the protocol, from 0: `holding 0`".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::span::Span;

    fn points(text: &str) -> Text {
        Text { text: text.to_owned(), span: Span::default(), exact: false }
    }

    fn stretch(text: &str) -> (Table, u32, u32, bool) {
        let found = parse(&points(text)).unwrap_or_else(|finding| panic!("{text}: {finding:?}"));
        (found.table, found.first, found.count, found.is_bits_of_registers)
    }

    fn help(text: &str) -> String {
        assert!(is_point(text), "{text}");
        parse(&points(text)).unwrap_err().help_text().unwrap_or_default().into_owned()
    }

    #[test]
    fn what_is_written_is_what_is_asked_for() {
        assert_eq!(stretch("coil 0..7"), (Table::Coils, 0, 8, false));
        assert_eq!(stretch("discrete 65535"), (Table::DiscreteInputs, 65_535, 1, false));
        assert_eq!(stretch("holding 10 .. 11"), (Table::HoldingRegisters, 10, 2, false));
        assert_eq!(stretch("holding 5.3"), (Table::HoldingRegisters, 83, 1, true));
        assert_eq!(stretch("input  5.0..6.15"), (Table::InputRegisters, 80, 32, true));
    }

    #[test]
    fn what_is_not_names_the_right_way() {
        assert_eq!(help("discrete-input 0"), "did you mean `discrete`?");
        assert_eq!(help("coils 0..7"), "did you mean `coil`?");
        assert_eq!(help("Holding 0"), "did you mean `holding`?");
        assert_eq!(help("holding 7..0"), "write `holding 0..7`");
        assert!(help("400001").ends_with("write `holding 0`"));
        assert!(help("10009").ends_with("write `discrete 8`"));
        assert!(help("999999").ends_with("from 0: `holding 0`"));
        for text in
            ["coil 65536", "coil 07", "coil 0..", "coil 5.3", "holding 5.16", "holding 5..5.3"]
        {
            assert!(help(text).contains("65535"), "{text}");
        }
    }

    #[test]
    fn addresses_of_memory_are_no_points() {
        for text in ["X0..X7", "X0 .. X7", "D5", "CT0.Acc", "Filling.Fill", "coil", "count", ""] {
            assert!(!is_point(text), "{text}");
        }
    }
}
