//! Numbers and durations with a decimal comma, as many countries write them: `1,5`, `1,5s`.
//!
//! A comma is never a part of a number here. Every reader of values asks [`corrected`] before it
//! refuses a text, so that all of them give the same help. This module accepts nothing.

use super::duration;

/// The number with a point in place of its comma, or the duration in whole units; `None` for any
/// other text.
pub fn corrected(text: &str) -> Option<String> {
    let (whole, fraction) = text.split_once(',')?;
    let unsigned = whole.strip_prefix(['-', '+']).unwrap_or(whole);
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    if !is_number(unsigned) || text.len() > 24 {
        return None;
    }
    match is_number(fraction) {
        true => Some(format!("{}.{fraction}", whole.trim_start_matches('+'))),
        false => duration::of_fraction(text),
    }
}

/// The sentence about a text that is refused because of its comma; `None` for any other text.
pub fn message(text: &str) -> Option<String> {
    let right = corrected(text)?;
    Some(format!("`{text}` has a decimal comma: write `{right}`"))
}

#[cfg(test)]
mod tests {
    use super::corrected;

    #[test]
    fn only_numbers_and_durations_have_a_decimal_comma() {
        let pairs = [
            ("1,5", Some("1.5")),
            ("-0,25", Some("-0.25")),
            ("+1,5", Some("1.5")),
            ("1,5s", Some("1s500ms")),
            ("0,5h", Some("30m")),
            ("1,5x", None),
            ("1,5,2", None),
            (",5", None),
            ("1,", None),
            ("N,0", None),
            ("1.5", None),
            ("1,-5", None),
        ];
        for (text, right) in pairs {
            assert_eq!(corrected(text).as_deref(), right, "{text}");
        }
    }
}
