//! Names that a ladder may no longer use, and the version that reserved them.
//!
//! A leaf module, read by `resolve` for the finding of a forbidden name. An old ladder with such a
//! tag passed the check of earlier versions; the finding explains to its author why it no longer
//! does. `docs/language.md`, *Old ladders*, has the same list.

/// The version that reserved the prefixes below.
const VERSION: &str = "0.2";

/// Mnemonics, by the version that reserved them.
const MNEMONICS: [(&str, &[&str]); 2] =
    [(VERSION, &["MATH", "COPY", "FILL", "SR"]), ("0.3", &["CALL", "RETURN", "PACK", "UNPACK"])];

/// Prefixes of addresses, in upper or lower case.
const PREFIXES: [&str; 1] = ["R"];

/// The version since which a mnemonic is forbidden; `None` if it is not in the list above.
pub fn mnemonic(name: &str) -> Option<&'static str> {
    let row = MNEMONICS.iter().find(|(_, names)| names.contains(&name));
    row.map(|(version, _)| *version)
}

/// The version since which a name that reads as an address is forbidden.
pub fn address(name: &str) -> Option<&'static str> {
    let prefix = name.trim_end_matches(|c: char| c.is_ascii_digit()).to_ascii_uppercase();
    PREFIXES.contains(&prefix.as_str()).then_some(VERSION)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_newer_names_have_a_version() {
        assert_eq!([address("R5"), address("r05")], [Some(VERSION); 2]);
        assert_eq!([address("T1"), address("MHR5"), mnemonic("CNT"), mnemonic("math")], [None; 4]);
        assert_eq!([mnemonic("MATH"), mnemonic("CALL")], [Some(VERSION), Some("0.3")]);
    }
}
