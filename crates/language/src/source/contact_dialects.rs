//! Contacts in the form of other controllers: `XIC b`, `GRT(level,3)`, `LD a AND b`.
//!
//! Called by `contact_parser` and `contact_habits` for a text that is no contact. The help has the
//! whole text as a contact of rungd, with the author's own operands; an instruction in the place of
//! a contact (`GTS Fill`) moves to `do`. `isa::dialects` knows the mnemonics.

use super::finding::{Code, Finding};
use super::fix::moved_to_do;
use super::span::Span;
use rungd_engine::isa::dialects;

/// The longest text that is read.
const TEXT_MAX: usize = 200;

/// The finding for a text that begins with a contact of another controller, and has nothing else.
pub(super) fn foreign(text: &str, span: Span) -> Option<Finding> {
    let name = words(text).into_iter().next()?;
    let right = converted(text)?;
    let message = format!("`{name}` is a contact of other controllers");
    Some(Finding::new(Code::ContactSyntax, span, message).write(right))
}

/// The finding for an instruction of another controller in the place of a contact: `GTS Fill`,
/// `TON(t,5)`. A tag may have the same name; in small letters, it is more likely a tag.
pub(super) fn foreign_instruction(text: &str, span: Span) -> Option<Finding> {
    let words = words(text);
    let (name, operands) = words.split_first()?;
    let instead = dialects::instead_of(name)?;
    let is_capital = name.len() > 1 && name.chars().all(|c| c.is_ascii_uppercase() || c == '_');
    if !is_capital || text.contains(['&', '|']) {
        return None;
    }
    let message = format!("`{name}` is an instruction of other controllers");
    let help = match dialects::instruction(name, operands) {
        Some(right) => moved_to_do(&right),
        None => format!("for the `{name}` of other controllers: {instead}").into(),
    };
    Some(Finding::new(Code::ContactSyntax, span, message).help(help))
}

/// The contact of rungd for the contacts of another controller.
fn converted(text: &str) -> Option<String> {
    if text.len() > TEXT_MAX {
        return None;
    }
    let series = |text: &str| {
        let each = text.split('&').map(in_a_row).collect::<Option<Vec<String>>>()?;
        Some(each.join(" & "))
    };
    let parallel = text.split('|').map(series).collect::<Option<Vec<String>>>()?;
    Some(parallel.join(" | "))
}

/// Contacts one behind the other, from left to right: `LD a OR b AND c` is `(a | b) & c`.
fn in_a_row(text: &str) -> Option<String> {
    let words = words(text);
    let mut rest = words.as_slice();
    let mut row = String::new();
    let mut is_parallel = false;
    while let [name, behind @ ..] = rest {
        let (length, contact) = (1..=behind.len().min(3)).find_map(|length| {
            let operands = behind.get(..length).filter(|_| is_contact(name))?;
            let ends = behind.get(length).is_none_or(|next| is_contact(next));
            Some((length, dialects::contact(name, operands).filter(|_| ends)?))
        })?;
        match (row.is_empty(), dialects::is_parallel(name)) {
            (true, true) => return None,
            (true, false) => row = contact,
            (false, true) => {
                row = format!("{row} | {contact}");
                is_parallel = true;
            }
            (false, false) if is_parallel => {
                row = format!("({row}) & {contact}");
                is_parallel = false;
            }
            (false, false) => row = format!("{row} & {contact}"),
        }
        rest = &behind[length..];
    }
    (!row.is_empty()).then_some(row)
}

/// Whether a word is such a contact's mnemonic. In lower case, a short word is more likely a tag.
fn is_contact(word: &str) -> bool {
    let is_capital = !word.contains(|c: char| c.is_ascii_lowercase());
    let is_known = (1..=3).any(|count| dialects::contact(word, &["X0"; 3][..count]).is_some());
    is_known && (is_capital || word.len() > 2)
}

/// The words of a text, without the brackets and commas between them.
fn words(text: &str) -> Vec<&str> {
    let is_sign = |c: char| matches!(c, ' ' | '\t' | ',' | '(' | ')');
    text.split(is_sign).filter(|word| !word.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::converted;

    #[test]
    fn contacts_of_other_controllers_are_translated() {
        let pairs = [
            ("XIC b", Some("b")),
            ("xic b", Some("b")),
            ("XIC(a)XIO(b)", Some("a & !b")),
            ("XIC a XIO b", Some("a & !b")),
            ("XIC a | XIO b", Some("a | !b")),
            ("GRT(level,3)", Some("level > 3")),
            ("LIM 1 level 9", Some("level >= 1 & level <= 9")),
            ("LD a OR b ANDN c", Some("(a | b) & !c")),
            ("LD a AND b OR c", Some("a & b | c")),
            ("AND b", Some("b")),
            ("UN b", Some("!b")),
            ("R_TRIG b", Some("rise(b)")),
            ("OR b", None),
            ("XIC", None),
            ("on b", None),
            ("jam START", None),
            ("GRT D0", None),
            ("TON T0", None),
            ("b AND c", None),
        ];
        for (text, wanted) in pairs {
            assert_eq!(converted(text).as_deref(), wanted, "{text}");
        }
    }
}
