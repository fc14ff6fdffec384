//! The notations of manuals and of other programs: `40001`, `4x0001`, `%MW100`, `HR100`.
//!
//! Called by `points`: for a text that is not in this program's notation, [`readings`] returns the
//! points that it may mean, in this notation; for a valid number that many manuals use in a
//! different way, [`doubt`] returns the other meaning. `docs/modbus-devices.md` has a table of
//! these notations, which a test tries. No findings are made here.

use super::stretch::ElementStretch;
use rungd_io::modbus::settings::ModbusTable;

/// The number of elements of a table.
const ELEMENTS: u32 = 65_536;

/// A possible meaning of a text in a different notation.
pub(super) struct ManualReading {
    /// The points in the notation of a map.
    pub row: String,
    /// The condition for this meaning; empty if there is no other.
    pub when: &'static str,
}

/// Consecutive elements, or bits of one register.
#[derive(Clone, Copy)]
struct ManualElements {
    first: u32,
    last: u32,
    bit: Option<u32>,
}

/// Elements as a text has them, before the first is counted from 0.
struct WrittenElements<'a> {
    first: &'a str,
    behind: ElementsEnd<'a>,
}

/// What follows the first number.
#[derive(Clone, Copy)]
enum ElementsEnd<'a> {
    Nothing,
    /// The last number of a range.
    To(&'a str),
    /// The number of a bit.
    Bit(&'a str),
    /// The number of a bit, or the number of elements.
    BitOrCount(&'a str),
}

/// The numbers that manuals have for the elements of a table: a digit, then the element from 1.
#[derive(Clone, Copy)]
struct Digit {
    digit: u32,
    table: ModbusTable,
}

const DIGITS: [Digit; 4] = [
    Digit { digit: 0, table: ModbusTable::Coils },
    Digit { digit: 1, table: ModbusTable::DiscreteInputs },
    Digit { digit: 3, table: ModbusTable::InputRegisters },
    Digit { digit: 4, table: ModbusTable::HoldingRegisters },
];

/// The names of tables in other programs, without spaces and signs.
const NAMES: [(ModbusTable, &[&str]); 4] = [
    (
        ModbusTable::Coils,
        &["coil", "coils", "coilstatus", "outputcoil", "outputcoils", "co", "do", "fc1", "fc01"],
    ),
    (
        ModbusTable::DiscreteInputs,
        &[
            "discrete",
            "discretes",
            "discreteinput",
            "discreteinputs",
            "inputstatus",
            "inputcontact",
            "di",
            "fc2",
            "fc02",
        ],
    ),
    (
        ModbusTable::InputRegisters,
        &["input", "inputregister", "inputregisters", "inputreg", "ir", "ai", "fc4", "fc04"],
    ),
    (
        ModbusTable::HoldingRegisters,
        &[
            "holding",
            "holdings",
            "holdingregister",
            "holdingregisters",
            "holdingreg",
            "register",
            "reg",
            "hr",
            "ao",
            "fc3",
            "fc03",
        ],
    ),
];

/// The points that a text in a different notation may mean, the likeliest first; none if it is in
/// no notation that is known here.
pub(super) fn readings(text: &str) -> Vec<ManualReading> {
    let text = text.trim();
    if let Some(address) = text.strip_prefix('%') {
        return iec(address);
    }
    match text.starts_with(|c: char| c.is_ascii_digit()) {
        true => numbered(text),
        false => named(text),
    }
}

/// The other meaning of a valid number that is written in decimal: `holding 40001` is `holding 0`
/// if the manual counts so. An output has no meaning that can only be read.
pub(super) fn doubt(stretch: &ElementStretch, is_output: bool) -> Option<ManualNumber> {
    if stretch.is_hexadecimal {
        return None;
    }
    let bits = if stretch.is_bits_of_registers { 16 } else { 1 };
    let (first, last) = (stretch.first / bits, (stretch.first + stretch.count - 1) / bits);
    let of_digit = |digit: &&Digit| {
        let elements = digit.digit * 10_000 + 1..=digit.digit * 10_000 + 9999;
        digit.digit > 0 && elements.contains(&first) && elements.contains(&last)
    };
    let Digit { digit, table } = *DIGITS.iter().find(of_digit)?;
    let is_possible =
        table.is_bits() == stretch.table.is_bits() && (table.is_writable() || !is_output);
    let skipped = (digit * 10_000 + 1) * bits;
    let other = ElementStretch { table, first: stretch.first - skipped, ..*stretch };
    is_possible.then(|| ManualNumber {
        number: first,
        row: other.text(ElementStretch::decimal),
        exact: stretch.text(ElementStretch::hexadecimal),
    })
}

/// The other meaning of a valid number.
pub(super) struct ManualNumber {
    /// The number that the manual may have.
    pub number: u32,
    /// The points, if it is the manual's number.
    pub row: String,
    /// The points as they are, in a notation without doubt.
    pub exact: String,
}

/// A text that begins with a digit: `40001`, `4x0001`, `4:0001`, `0x9C41`, `40001:2`, `100`.
fn numbered(text: &str) -> Vec<ManualReading> {
    let mut all = Vec::new();
    let bytes = text.as_bytes();
    if let [digit, b'x' | b'X' | b':', ..] = bytes
        && let Some(digit) = of_digit(u32::from(digit - b'0'))
    {
        let from_one = |number: &str| plain(number)?.checked_sub(1);
        let is_element = |written: &WrittenElements<'_>| written.first.len() >= 4;
        if let Some(written) = WrittenElements::of(&text[2..]).filter(is_element) {
            push(
                &mut all,
                digit.table,
                &written,
                NumberReading { number: from_one, when: "of a manual, counted from 1" },
            );
        }
        // `4x0001` is nothing else; `0x0001` can be in hexadecimal.
        if !text[..2].eq_ignore_ascii_case("0x") {
            return all;
        }
    }
    let Some(written) = WrittenElements::of(text) else { return all };
    if hexadecimal(written.first).is_some() {
        push(
            &mut all,
            ModbusTable::HoldingRegisters,
            &written,
            NumberReading { number: hexadecimal, when: "in hexadecimal" },
        );
    } else if let Some(digit) = manual_digit(written.first) {
        push(&mut all, digit.table, &written, NumberReading { number: manual_element, when: "" });
    } else {
        for (table, when) in [
            (ModbusTable::HoldingRegisters, "a holding register"),
            (ModbusTable::InputRegisters, "an input register"),
            (ModbusTable::Coils, "a coil"),
            (ModbusTable::DiscreteInputs, "a discrete input"),
        ] {
            push(&mut all, table, &written, NumberReading { number: plain, when });
        }
    }
    all
}

/// A text that begins with a name: `HR100`, `holding register 5`, `holding:3`, `coil 00001`.
fn named(text: &str) -> Vec<ManualReading> {
    let mut all = Vec::new();
    let Some((table, rest, is_own)) = table_of(text) else { return all };
    let Some(written) = WrittenElements::of(rest) else { return all };
    if manual_digit(written.first).is_some_and(|digit| digit.table == table) {
        push(
            &mut all,
            table,
            &written,
            NumberReading { number: manual_element, when: "of a manual, counted from 1" },
        );
    }
    let is_hexadecimal = hexadecimal(written.first).is_some();
    let is_manual_coil = is_hexadecimal && table == ModbusTable::Coils && written.first.len() >= 6;
    if is_manual_coil && written.first[2..].bytes().all(|byte| byte.is_ascii_digit()) {
        let from_one = |number: &str| plain(number.get(2..)?)?.checked_sub(1);
        push(
            &mut all,
            table,
            &written,
            NumberReading { number: from_one, when: "of a manual, counted from 1" },
        );
    }
    match is_hexadecimal {
        true => push(
            &mut all,
            table,
            &written,
            NumberReading { number: hexadecimal, when: "in hexadecimal" },
        ),
        false => push(
            &mut all,
            table,
            &written,
            NumberReading { number: plain, when: "as a protocol address" },
        ),
    }
    if !is_own && !is_hexadecimal && all.len() == 1 {
        let from_one = |number: &str| plain(number)?.checked_sub(1);
        push(
            &mut all,
            table,
            &written,
            NumberReading { number: from_one, when: "where the first is 1" },
        );
    }
    all
}

/// An address of IEC 61131-3 without its `%`, as the servers of Modicon and CODESYS use them.
fn iec(address: &str) -> Vec<ManualReading> {
    let mut all = Vec::new();
    let kind_bytes = address.bytes().take_while(u8::is_ascii_alphabetic).count();
    let (kind, rest) = address.split_at(kind_bytes);
    let kind = kind.to_ascii_uppercase();
    let bytes = |rest: &str| {
        let (byte, bit) = rest.split_once('.')?;
        Some((plain(byte)?, plain(bit).filter(|bit| *bit < 8)?))
    };
    let (registers, bits) = match kind.chars().next() {
        Some('I') => (ModbusTable::InputRegisters, ModbusTable::DiscreteInputs),
        Some('Q') => (ModbusTable::HoldingRegisters, ModbusTable::Coils),
        Some('M') => (ModbusTable::HoldingRegisters, ModbusTable::Coils),
        _ => return all,
    };
    match &kind[1..] {
        "W" => {
            if let Some(mut written) = WrittenElements::of(rest) {
                if let ElementsEnd::BitOrCount(bit) = written.behind
                    && let Some(bit) = bit.strip_prefix(['X', 'x'])
                {
                    written.behind = ElementsEnd::Bit(bit);
                }
                push(&mut all, registers, &written, NumberReading { number: plain, when: "" });
            }
        }
        "D" | "F" => {
            if let Some(first) = plain(rest) {
                let two =
                    |first: u32| ManualElements { first, last: first.saturating_add(1), bit: None };
                push_elements(&mut all, registers, two(first), "numbered as words");
                let doubled = two(first.saturating_mul(2));
                push_elements(&mut all, registers, doubled, "numbered as double words");
            }
        }
        "X" => {
            if let Some((byte, bit)) = bytes(rest) {
                let (register, bit_of_word) = (byte / 2, byte % 2 * 8 + bit);
                let one =
                    ManualElements { first: register, last: register, bit: Some(bit_of_word) };
                push_elements(&mut all, registers, one, "as a bit of a register");
                let at = byte.saturating_mul(8) + bit;
                let one = ManualElements { first: at, last: at, bit: None };
                push_elements(&mut all, bits, one, "as a bit of its own");
            }
        }
        "" => {
            if let Some(written) = WrittenElements::of(rest) {
                push(&mut all, bits, &written, NumberReading { number: plain, when: "" });
            }
        }
        _ => {}
    }
    all
}

/// A way to read the numbers of written elements.
#[derive(Clone, Copy)]
struct NumberReading {
    /// The element of a written number, from 0.
    number: fn(&str) -> Option<u32>,
    /// When the number has this meaning, as words for a help; may be empty.
    when: &'static str,
}

/// Adds the meanings of written elements, if they are in the table.
fn push(
    all: &mut Vec<ManualReading>,
    table: ModbusTable,
    written: &WrittenElements<'_>,
    NumberReading { number, when }: NumberReading,
) {
    let Some(first) = number(written.first) else { return };
    let one = ManualElements { first, last: first, bit: None };
    let bit = |bit: &str| {
        let bit = plain(bit).filter(|bit| *bit < 16 && !table.is_bits())?;
        Some(ManualElements { bit: Some(bit), ..one })
    };
    let count = |count: &str| {
        let count = plain(count).filter(|count| (1..=ELEMENTS).contains(count))?;
        Some(ManualElements { last: first.saturating_add(count - 1), ..one })
    };
    match written.behind {
        ElementsEnd::Nothing => push_elements(all, table, one, when),
        ElementsEnd::To(last) => {
            if let Some(last) = number(last) {
                push_elements(all, table, ManualElements { last, ..one }, when);
            }
        }
        ElementsEnd::Bit(text) => {
            if let Some(elements) = bit(text) {
                push_elements(all, table, elements, when);
            }
        }
        ElementsEnd::BitOrCount(text) => {
            for (elements, when) in
                [(bit(text), "for the bit"), (count(text), "for the number of elements")]
            {
                if let Some(elements) = elements {
                    push_elements(all, table, elements, when);
                }
            }
        }
    }
}

fn push_elements(
    all: &mut Vec<ManualReading>,
    table: ModbusTable,
    elements: ManualElements,
    when: &'static str,
) {
    let ManualElements { first, last, bit } = elements;
    if last < first || last >= ELEMENTS {
        return;
    }
    let (first, count) = match bit {
        Some(bit) => (first * 16 + bit, 1),
        None => (first, last - first + 1),
    };
    let is_bits_of_registers = bit.is_some();
    let stretch =
        ElementStretch { table, first, count, is_bits_of_registers, is_hexadecimal: false };
    // What is written here must not be in doubt again.
    let row = match doubt(&stretch, false) {
        Some(manual) => manual.exact,
        None => stretch.text(ElementStretch::decimal),
    };
    if all.iter().all(|reading| reading.row != row) {
        all.push(ManualReading { row, when });
    }
}

impl<'a> WrittenElements<'a> {
    /// Reads `5`, `5..8`, `5-8`, `5 to 8`, `5.3`, `5:3`, with or without brackets.
    fn of(text: &'a str) -> Option<WrittenElements<'a>> {
        let text = text.trim().trim_start_matches(['[', '(']).trim_end_matches([']', ')']).trim();
        let (first, behind) = if let Some((first, last)) =
            text.split_once("..").or(text.split_once(" to ")).or(text.split_once('-'))
        {
            (first, ElementsEnd::To(last.trim_start_matches('.').trim()))
        } else if let Some((first, bit)) = text.split_once(['.', '/']) {
            (first, ElementsEnd::Bit(bit.trim()))
        } else if let Some((first, bit)) = text.split_once(':') {
            (first, ElementsEnd::BitOrCount(bit.trim()))
        } else {
            (text, ElementsEnd::Nothing)
        };
        let first = first.trim();
        (!first.is_empty() && first.is_ascii()).then_some(WrittenElements { first, behind })
    }
}

/// The table that a text begins with, the text behind it, and whether this is its own name.
fn table_of(text: &str) -> Option<(ModbusTable, &str, bool)> {
    let is_name = |c: char| c.is_ascii_alphabetic() || matches!(c, ' ' | '-' | '_');
    let letters = text.find(|c| !is_name(c))?;
    let digits = text[letters..].find(|c: char| !c.is_ascii_digit());
    // The digit of a function code belongs to the name.
    let end = match (text[..letters].trim().eq_ignore_ascii_case("fc"), digits) {
        (true, Some(digits)) => letters + digits,
        _ => letters,
    };
    let (name, rest) = text.split_at(end);
    let name: String = name.chars().filter(char::is_ascii_alphanumeric).collect();
    let name = name.to_ascii_lowercase();
    let (table, _) = NAMES.iter().find(|(_, names)| names.contains(&name.as_str()))?;
    let rest = rest.trim_start_matches([':', '=', '#', '/', ' ', '_', '-']);
    Some((*table, rest, name.starts_with(table.name())))
}

fn of_digit(digit: u32) -> Option<Digit> {
    DIGITS.into_iter().find(|known| known.digit == digit)
}

/// The digit of a manual's number with five or six digits, if its element is in the table.
fn manual_digit(number: &str) -> Option<Digit> {
    let is_number = matches!(number.len(), 5 | 6) && number.bytes().all(|b| b.is_ascii_digit());
    let (digit, _) = number.split_at_checked(1).filter(|_| is_number)?;
    let element = manual_element(number)?;
    of_digit(digit.parse().ok()?).filter(|_| element < ELEMENTS)
}

/// The element of a manual's number, from 0.
fn manual_element(number: &str) -> Option<u32> {
    plain(number.get(1..)?)?.checked_sub(1)
}

/// A decimal number, with or without leading zeros.
fn plain(number: &str) -> Option<u32> {
    let is_decimal = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    number.parse().ok().filter(|_| is_decimal)
}

/// `0x9C41`, `16#9C41`, `&H9C41`, `9C41h`.
fn hexadecimal(number: &str) -> Option<u32> {
    let lower = number.to_ascii_lowercase();
    let marked = ["0x", "16#", "&h"].into_iter().find_map(|mark| lower.strip_prefix(mark));
    let digits = marked.or(lower.strip_suffix('h'))?;
    let is_hexadecimal = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_hexdigit());
    u32::from_str_radix(digits, 16).ok().filter(|_| is_hexadecimal)
}
