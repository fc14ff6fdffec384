//! The form of element documentation; for `import` and `export`.

use rungd_engine::isa::{Address, Space};

/// How the documentation begins, in a file of its own and in a program that is exported as text.
pub(super) const BEGIN: &str = "#BEGIN ELEMENT_DOC";
/// How it ends.
pub(super) const END: &str = "#END";
/// How the column of flags begins.
pub(super) const FLAGS: &str = "FLAGS";

/// Whether a text has the documentation of elements.
pub fn is_documentation(text: &str) -> bool {
    text.lines().any(begins)
}

/// Whether a line begins the documentation.
pub(super) fn begins(line: &str) -> bool {
    line.trim_start_matches('\u{feff}').trim() == BEGIN
}

/// What an element of rungd's name is in a Do-more, if it is another one there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OtherElement {
    /// One of the system's, which rungd has too, in other places.
    System,
    /// A word.
    Word,
}

/// What an element of rungd's name is in a Do-more, if it is another one there.
pub(super) fn other_element(address: Address) -> Option<OtherElement> {
    match Space::of(address.without_bit())?.0.name() {
        "ST" | "DST" => Some(OtherElement::System),
        "N" => Some(OtherElement::Word),
        _ => None,
    }
}

/// The name of a tag without a nickname: `x_0` for `X0`, `ct_1_acc` for `CT1.Acc`.
pub(super) fn plain_name(at: &str) -> String {
    let number = at.find(|c: char| c.is_ascii_digit()).unwrap_or(at.len());
    let (space, number) = at.split_at(number);
    format!("{space}_{}", number.replace('.', "_")).to_lowercase()
}
