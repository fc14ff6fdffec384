//! Numbers and durations in the notation of other systems: `0XFF`, `16#FF`, `2#1010`, `0FFh`,
//! `0b1010`, `1_000`, `T#5s`, `2d`.
//!
//! None of them is a number here. The readers of values ask [`corrected`] before they refuse a
//! text, so that all of them give the same help. This module accepts nothing.

use super::duration;

/// The longest text that is read.
const TEXT_MAX: usize = 48;

/// The same number or duration as it is written here; `None` for any other text.
pub fn corrected(text: &str) -> Option<String> {
    if text.len() > TEXT_MAX {
        return None;
    }
    let (sign, plain) = match text.strip_prefix('-') {
        Some(plain) => ("-", plain),
        None => ("", text),
    };
    if let Some((before, behind)) = plain.rsplit_once('#') {
        return typed(&before.to_ascii_uppercase(), sign, behind);
    }
    let lower = plain.to_ascii_lowercase();
    if let Some(digits) = lower.strip_prefix("0x") {
        return whole(sign, digits, 16);
    }
    if let Some(digits) = lower.strip_prefix("0b") {
        return whole(sign, digits, 2);
    }
    if let Some(digits) = lower.strip_prefix("0o") {
        return whole(sign, digits, 8);
    }
    if let Some(days) = lower.strip_suffix('d').and_then(|days| days.parse::<u32>().ok()) {
        let is_short = days <= 24 && sign.is_empty();
        return is_short.then(|| format!("{}h", 24 * days));
    }
    match lower.strip_suffix('h') {
        Some(digits) if digits.contains(|c: char| c.is_ascii_alphabetic()) => {
            whole(sign, digits, 16)
        }
        Some(_) => None,
        None => whole(sign, &lower, 10),
    }
}

/// A literal of IEC 61131-3: the words before its last `#`, and what follows it.
fn typed(before: &str, sign: &str, behind: &str) -> Option<String> {
    let base = before.rsplit('#').next()?;
    match base {
        "16" | "8" | "2" => whole(sign, behind, base.parse().ok()?),
        "T" | "TIME" | "LT" | "LTIME" | "S5T" | "S5TIME" => {
            let time = behind.replace('_', "").to_ascii_lowercase();
            match duration::parse(&time) {
                Ok(ms) => Some(duration::print(ms)),
                Err(_) => duration::of_fraction(&time),
            }
        }
        "SINT" | "INT" | "DINT" | "LINT" | "USINT" | "UINT" | "UDINT" | "BYTE" | "WORD"
        | "DWORD" | "B" | "W" | "DW" | "L" => whole(sign, behind, 10),
        "REAL" | "LREAL" => {
            let is_real = behind.contains('.') && behind.parse::<f64>().is_ok();
            is_real.then(|| format!("{sign}{behind}"))
        }
        _ => None,
    }
}

/// The number of digits of a base, with `_` between them. A number of bits beyond the signed range
/// becomes the negative number with the same bits.
fn whole(sign: &str, digits: &str, base: u32) -> Option<String> {
    let plain = digits.replace('_', "");
    if plain.is_empty() || !plain.chars().all(|c| c.is_digit(base)) {
        return None;
    }
    let number = u32::from_str_radix(&plain, base).ok()?;
    match i32::try_from(number) {
        Ok(number) if matches!(base, 2 | 16) => Some(format!("{sign}0x{number:X}")),
        Ok(number) => Some(format!("{sign}{number}")),
        Err(_) if matches!(base, 2 | 16) && sign.is_empty() => {
            Some(number.cast_signed().to_string())
        }
        Err(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::corrected;

    #[test]
    fn literals_of_other_systems_are_converted() {
        let pairs = [
            ("0XFF", Some("0xFF")),
            ("-0X1f", Some("-0x1F")),
            ("16#FF", Some("0xFF")),
            ("W#16#FF", Some("0xFF")),
            ("16#FF_00", Some("0xFF00")),
            ("16#FFFF_FFFF", Some("-1")),
            ("2#1010", Some("0xA")),
            ("8#17", Some("15")),
            ("0b1010", Some("0xA")),
            ("0o17", Some("15")),
            ("0FFh", Some("0xFF")),
            ("1_000", Some("1000")),
            ("INT#5", Some("5")),
            ("REAL#1.5", Some("1.5")),
            ("T#5s", Some("5s")),
            ("t#1m_30s", Some("1m30s")),
            ("TIME#1.5s", Some("1s500ms")),
            ("S5T#250ms", Some("250ms")),
            ("20d", Some("480h")),
            ("-1d", None),
            ("30d", None),
            ("12h", None),
            ("16#GG", None),
            ("16#FFFFFFFFF", None),
            ("X#1", None),
            ("#", None),
            ("12a", None),
            ("0x", None),
            ("", None),
        ];
        for (text, right) in pairs {
            assert_eq!(corrected(text).as_deref(), right, "{text}");
        }
    }
}
