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
