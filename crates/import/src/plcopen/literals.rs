//! Literals of IEC 61131-3: `TRUE`, `16#FF`, `INT#-5`, `1.5e3`, `T#1m30s`.

use super::types::IecType;

/// A literal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum IecLiteral {
    Bool(bool),
    Whole(i64),
    Real(f64),
    /// In ms; whether the text had a part below 1 ms.
    Time {
        ms: i64,
        is_rounded: bool,
    },
}

/// The type that a literal of a whole number names: `DINT#5`.
pub(super) fn named_type(text: &str) -> Option<IecType> {
    let (head, _) = text.trim().split_once('#')?;
    let named = IecType::named(head.trim()).ok()?;
    matches!(named, IecType::Whole { .. }).then_some(named)
}

/// The literal that a text is; `None` if it is none.
pub(super) fn literal(text: &str) -> Option<IecLiteral> {
    let upper = text.trim().to_uppercase();
    // OpenPLC's editor keeps what was typed: `T# 5s`.
    let upper = if upper.contains('#') { upper.replace(' ', "") } else { upper };
    match upper.as_str() {
        "TRUE" => return Some(IecLiteral::Bool(true)),
        "FALSE" => return Some(IecLiteral::Bool(false)),
        _ => {}
    }
    let Some((head, rest)) = upper.split_once('#') else { return number(&upper) };
    match head {
        "T" | "TIME" => time(rest),
        "BOOL" => match rest {
            "1" | "TRUE" => Some(IecLiteral::Bool(true)),
            "0" | "FALSE" => Some(IecLiteral::Bool(false)),
            _ => None,
        },
        "2" | "8" | "16" => based(head, rest),
        "SINT" | "INT" | "DINT" | "LINT" | "USINT" | "UINT" | "UDINT" | "ULINT" | "BYTE"
        | "WORD" | "DWORD" | "LWORD" => match rest.split_once('#') {
            Some((base, digits)) => based(base, digits),
            None => number(rest).filter(|number| matches!(number, IecLiteral::Whole(_))),
        },
        "REAL" | "LREAL" => {
            let number = number(rest)?;
            if let IecLiteral::Whole(value) = number {
                Some(IecLiteral::Real(value as f64))
            } else {
                Some(number)
            }
        }
        _ => None,
    }
}

fn based(base: &str, digits: &str) -> Option<IecLiteral> {
    let base = base.parse().ok().filter(|base| [2, 8, 10, 16].contains(base))?;
    i64::from_str_radix(&digits.replace('_', ""), base).ok().map(IecLiteral::Whole)
}

fn number(text: &str) -> Option<IecLiteral> {
    let plain = text.replace('_', "");
    let begins = plain.trim_start_matches(['-', '+']);
    if !begins.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    if let Ok(whole) = plain.parse::<i64>() {
        return Some(IecLiteral::Whole(whole));
    }
    plain.parse::<f64>().ok().filter(|real| real.is_finite()).map(IecLiteral::Real)
}

/// The units of a duration, in ns.
const UNITS: [(&str, f64); 7] = [
    ("MS", 1e6),
    ("US", 1e3),
    ("NS", 1.0),
    ("D", 86_400e9),
    ("H", 3_600e9),
    ("M", 60e9),
    ("S", 1e9),
];

fn time(text: &str) -> Option<IecLiteral> {
    let text = text.replace('_', "");
    let (sign, mut rest) = match text.strip_prefix('-') {
        Some(rest) => (-1, rest),
        None => (1, text.as_str()),
    };
    if rest.is_empty() {
        return None;
    }
    let mut ns = 0.0;
    while !rest.is_empty() {
        let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.')?;
        let value: f64 = rest[..end].parse().ok()?;
        rest = &rest[end..];
        let (unit, length) = UNITS.iter().find(|(unit, _)| rest.starts_with(unit))?;
        ns += value * length;
        rest = &rest[unit.len()..];
    }
    let ms = (ns / 1e6).round();
    if ms.abs() > f64::from(i32::MAX) {
        return None;
    }
    let is_rounded = (ns - ms * 1e6).abs() >= 1.0;
    Some(IecLiteral::Time { ms: ms as i64 * sign, is_rounded })
}

/// A time as rungd writes it: `1m30s`; a negative one is a number of ms.
pub(super) fn duration(ms: i64) -> String {
    if ms <= 0 {
        return if ms == 0 { "0ms".to_owned() } else { ms.to_string() };
    }
    let mut text = String::new();
    let mut rest = ms;
    for (unit, length) in [("h", 3_600_000), ("m", 60_000), ("s", 1000), ("ms", 1)] {
        if rest >= length {
            text += &format!("{}{unit}", rest / length);
            rest %= length;
        }
    }
    text
}

/// A real as rungd writes it.
pub(super) fn real(value: f64) -> String {
    let value = value as f32;
    let value = if value == 0.0 { 0.0 } else { value };
    format!("{value:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_of_all_kinds_are_read() {
        let time = |ms| Some(IecLiteral::Time { ms, is_rounded: false });
        for (text, value) in [
            ("TRUE", Some(IecLiteral::Bool(true))),
            ("bool#0", Some(IecLiteral::Bool(false))),
            ("-1_000", Some(IecLiteral::Whole(-1000))),
            ("16#ff", Some(IecLiteral::Whole(255))),
            ("WORD#2#101", Some(IecLiteral::Whole(5))),
            ("INT#-5", Some(IecLiteral::Whole(-5))),
            ("1.5e3", Some(IecLiteral::Real(1500.0))),
            ("REAL#2", Some(IecLiteral::Real(2.0))),
            ("T#1m30s", time(90_000)),
            ("T# 5s", time(5000)),
            ("time#1d_2h", time(93_600_000)),
            ("t#0.5s", time(500)),
            ("T#1500us", Some(IecLiteral::Time { ms: 2, is_rounded: true })),
            ("T#", None),
            ("T#5", None),
            ("motor", None),
            ("INT#motor", None),
            ("1 + 2", None),
        ] {
            assert_eq!(literal(text), value, "{text}");
        }
    }

    #[test]
    fn a_duration_is_written_in_its_largest_units() {
        assert_eq!(duration(90_000), "1m30s");
        assert_eq!(duration(3_600_005), "1h5ms");
        assert_eq!(duration(0), "0ms");
    }
}
