//! Parses and prints durations: `250ms`, `1m30s`, or the vendor's `HH:MM:SS:mmm`.
//!
//! A duration is a number of milliseconds within `i32`, the range of a timer's preset
//! (596 h 31 m 23.647 s). Called by the parsers of ladder, controller and command-line values.

/// Why a text is not a duration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DurationError {
    /// The text does not have the form of a duration.
    Form,
    /// Units out of order or given twice. Units must descend, each at most once.
    Order,
    /// Longer than 2,147,483,647 ms.
    TooLong,
}

const UNITS: [(&str, u64); 4] = [("h", 3_600_000), ("m", 60_000), ("s", 1_000), ("ms", 1)];

/// Parses a duration into milliseconds, 0..=2147483647.
///
/// # Errors
/// [`DurationError`]: the form, the order of the units or the length is wrong.
pub fn parse(text: &str) -> Result<i32, DurationError> {
    let ms = if text.contains(':') { parse_vendor(text)? } else { parse_units(text)? };
    i32::try_from(ms).map_err(|_| DurationError::TooLong)
}

/// Whether a text starts like a duration: a digit, and later a unit or a colon.
pub fn looks_like(text: &str) -> bool {
    let rest = text.trim_start_matches(|c: char| c.is_ascii_digit());
    rest.len() < text.len() && (rest.starts_with([':', 'h', 'm', 's']))
}

/// A number of seconds with a fraction as a duration: `5.5` gives `5s500ms`.
pub fn of_seconds(seconds: f64) -> Option<String> {
    let ms = (seconds * 1000.0).round();
    let fits = ms >= 1.0 && ms <= f64::from(i32::MAX);
    // The cast is exact: the range is checked, and the number has no fraction.
    #[allow(clippy::cast_possible_truncation)]
    fits.then(|| print(ms as i32))
}

/// The sentence about a text that is not a duration. `forms`: examples; a number with a fraction
/// gets its own text in whole units.
pub fn not_a_duration(text: &str, forms: &str) -> String {
    if let Some(right) = of_fraction(text) {
        return format!("`{text}` is not a duration: its numbers are whole: write {right}");
    }
    match without_unit(text) {
        Some([first, second]) => {
            format!("`{text}` is not a duration: it lacks its unit: write {first} or {second}")
        }
        None => format!("`{text}` is not a duration: write it as {forms}"),
    }
}

/// The two durations that a number without a unit can mean: `5` gives `5ms` and `5s`. Milliseconds
/// are whole, so `1.5` and `1,5` give the values in seconds and in minutes.
pub fn without_unit(text: &str) -> Option<[String; 2]> {
    if !text.starts_with(|c: char| c.is_ascii_digit()) || text.len() > 12 {
        return None;
    }
    if text.bytes().all(|b| b.is_ascii_digit()) {
        return Some([format!("{text}ms"), format!("{text}s")]);
    }
    Some([of_fraction(&format!("{text}s"))?, of_fraction(&format!("{text}m"))?])
}

/// A number with a fraction and one unit: `1.5s` gives `1s500ms`.
pub fn of_fraction(text: &str) -> Option<String> {
    let letters = text.find(|c: char| c.is_ascii_alphabetic())?;
    let (number, unit) = text.split_at(letters);
    let (_, ms) = UNITS.iter().find(|(name, _)| *name == unit)?;
    let plain = number.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'.' | b','));
    let number: f64 = number.replace(',', ".").parse().ok().filter(|_| plain)?;
    let whole = u32::try_from(*ms).ok()?;
    of_seconds(number * f64::from(whole) / 1000.0)
}

/// The text with its units in descending order (`2s5m` gives `5m2s`); `None` if a unit occurs
/// twice.
pub fn in_order(text: &str) -> Option<String> {
    let mut parts: Vec<(usize, &str)> = Vec::new();
    let mut rest = text;
    while !rest.is_empty() {
        let (_, behind) = split_digits(rest).ok()?;
        let letters = behind.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(behind.len());
        let unit = UNITS.iter().position(|(name, _)| *name == &behind[..letters])?;
        parts.push((unit, &rest[..rest.len() - behind.len() + letters]));
        rest = &behind[letters..];
    }
    parts.sort_by_key(|(unit, _)| *unit);
    let text: String = parts.iter().map(|(_, part)| *part).collect();
    parse(&text).is_ok().then_some(text)
}

fn parse_units(text: &str) -> Result<u64, DurationError> {
    let mut rest = text;
    let mut total = 0u64;
    let mut next_unit = 0;
    while !rest.is_empty() {
        let (number, behind) = split_digits(rest)?;
        let letters = behind.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(behind.len());
        let (unit, tail) = behind.split_at(letters);
        let at = UNITS.iter().position(|(name, _)| *name == unit).ok_or(DurationError::Form)?;
        if at < next_unit {
            return Err(DurationError::Order);
        }
        next_unit = at + 1;
        total = add(total, number, UNITS[at].1)?;
        rest = tail;
    }
    if next_unit == 0 { Err(DurationError::Form) } else { Ok(total) }
}

fn parse_vendor(text: &str) -> Result<u64, DurationError> {
    let fields: Vec<&str> = text.split(':').collect();
    if fields.len() != UNITS.len() {
        return Err(DurationError::Form);
    }
    let mut total = 0u64;
    for (field, (_, ms)) in fields.iter().zip(UNITS) {
        let (number, rest) = split_digits(field)?;
        if !rest.is_empty() {
            return Err(DurationError::Form);
        }
        total = add(total, number, ms)?;
    }
    Ok(total)
}

fn split_digits(text: &str) -> Result<(u64, &str), DurationError> {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    if end == 0 {
        return Err(DurationError::Form);
    }
    let number = text[..end].parse().map_err(|_| DurationError::TooLong)?;
    Ok((number, &text[end..]))
}

fn add(total: u64, number: u64, ms: u64) -> Result<u64, DurationError> {
    let part = number.checked_mul(ms).ok_or(DurationError::TooLong)?;
    total.checked_add(part).ok_or(DurationError::TooLong)
}

/// Prints milliseconds in the shortest form that [`parse`] reads back: `1m30s`, `250ms`, `0ms`.
pub fn print(ms: i32) -> String {
    let mut rest = u64::from(ms.max(0).unsigned_abs());
    let mut text = String::new();
    for (name, unit) in UNITS {
        if rest >= unit {
            text.push_str(&format!("{}{name}", rest / unit));
            rest %= unit;
        }
    }
    if text.is_empty() { "0ms".to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_without_a_unit_is_suggested_in_two_units() {
        let given = |text: &str| without_unit(text).map(|both| both.join(" "));
        assert_eq!(given("5").as_deref(), Some("5ms 5s"));
        assert_eq!(given("1,5").as_deref(), Some("1s500ms 1m30s"));
        assert_eq!(given("1.5").as_deref(), Some("1s500ms 1m30s"));
        for text in ["", "x", "1,5s", "1,5,2", "-5", "9999999999999"] {
            assert_eq!(given(text), None, "{text}");
        }
    }

    #[test]
    fn durations_are_read_in_both_notations() {
        for (text, ms) in [
            ("250ms", 250),
            ("2s", 2_000),
            ("1m30s", 90_000),
            ("1h2m3s4ms", 3_723_004),
            ("97s", 97_000),
            ("00:01:37:000", 97_000),
            ("596:31:23:647", i32::MAX),
            ("0ms", 0),
        ] {
            assert_eq!(parse(text), Ok(ms), "{text}");
        }
    }

    #[test]
    fn each_wrong_duration_gives_its_own_error() {
        for (text, error) in [
            ("", DurationError::Form),
            ("5", DurationError::Form),
            ("ms", DurationError::Form),
            ("5 s", DurationError::Form),
            ("5us", DurationError::Form),
            ("1:2:3", DurationError::Form),
            ("1s2m", DurationError::Order),
            ("1s2s", DurationError::Order),
            ("596:31:23:648", DurationError::TooLong),
            ("99999999999999999999h", DurationError::TooLong),
        ] {
            assert_eq!(parse(text), Err(error), "{text}");
        }
    }

    #[test]
    fn misplaced_units_are_sorted() {
        assert_eq!(in_order("2s5m").as_deref(), Some("5m2s"));
        assert_eq!(in_order("5ms1h2s").as_deref(), Some("1h2s5ms"));
        assert_eq!(in_order("2s2s"), None);
        assert_eq!(in_order("2s5"), None);
    }

    #[test]
    fn printed_durations_parse_to_the_same_value() {
        for ms in [0, 1, 999, 1_000, 61_001, 3_600_000, i32::MAX] {
            assert_eq!(parse(&print(ms)), Ok(ms));
        }
    }
}
