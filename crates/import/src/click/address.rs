//! The parts of an address of a CLICK: `DS12`.

/// The name of the bank and the number of an address.
///
/// # Errors
/// It has no number.
pub(super) fn bank_and_number(text: &str) -> Result<(&str, u32), String> {
    let digits = text.find(|c: char| c.is_ascii_digit()).unwrap_or(text.len());
    let (bank, number) = text.split_at(digits);
    let number = number.parse().map_err(|_| format!("the operand `{text}`"))?;
    Ok((bank, number))
}

/// The addresses of `C1` or `C1..C4`; at least one.
///
/// # Errors
/// It is no range, or one of more than 256 addresses.
pub(super) fn addresses(text: &str) -> Result<Vec<String>, String> {
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    let (bank, from) = bank_and_number(first.trim())?;
    let (other, to) = bank_and_number(last.trim())?;
    if bank != other || to < from || to - from > 255 {
        return Err(format!("the range `{text}`"));
    }
    Ok((from..=to).map(|number| format!("{bank}{number}")).collect())
}
