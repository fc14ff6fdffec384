//! Addresses of IEC 61131-3, as `%IX0.0`, as those of rungd.

use super::types::IecType;

/// Most words of the memory of `%MW` that keep their numbers.
const WORDS_MAX: u64 = 2048;

/// The address of rungd for one of IEC 61131-3: bits, and words of `%MW`.
pub(super) fn address(text: &str, kind: IecType) -> Option<String> {
    let text = text.trim().to_uppercase();
    let rest = text.strip_prefix('%')?;
    let area = rest.get(..1)?;
    let rest = &rest[1..];
    let size = rest.get(..1).filter(|size| size.chars().all(char::is_alphabetic)).unwrap_or("X");
    let digits = rest.trim_start_matches(char::is_alphabetic);
    match (size, kind) {
        ("X", IecType::Bool) => {
            let (byte, bit) = digits.split_once('.').unwrap_or(("0", digits));
            let (byte, bit) = (byte.parse::<u64>().ok()?, bit.parse::<u64>().ok()?);
            let at = byte.checked_mul(8)?.checked_add(bit).filter(|at| *at < 2048 && bit < 8)?;
            let space = match area {
                "I" => "X",
                "Q" => "Y",
                "M" => "C",
                _ => return None,
            };
            Some(format!("{space}{at}"))
        }
        ("W", IecType::Whole { bits: 16, .. }) if area == "M" => {
            digits.parse::<u64>().ok().filter(|at| *at < WORDS_MAX).map(|at| format!("D{at}"))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_of_bits_count_on_over_bytes() {
        let bit = |text| address(text, IecType::Bool);
        assert_eq!(bit("%IX0.0").as_deref(), Some("X0"));
        assert_eq!(bit("%QX2.7").as_deref(), Some("Y23"));
        assert_eq!(bit("%MX1.1").as_deref(), Some("C9"));
        assert_eq!(bit("%I1.1").as_deref(), Some("X9"));
        assert_eq!(bit("%IX0.8"), None);
        assert_eq!(bit("%IX999.0"), None);
        assert_eq!(address("%MW12", crate::plcopen::types::INT).as_deref(), Some("D12"));
        assert_eq!(address("%QW12", crate::plcopen::types::INT), None);
        assert_eq!(bit("%"), None);
        assert_eq!(bit("%Ä0.0"), None);
    }
}
