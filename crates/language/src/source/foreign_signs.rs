//! The signs and words of other notations that stand for operators: `×`, `≤`, `//`, `mod`.
//!
//! Called by the readers of contacts and of expressions for text that they cannot read, so that
//! both give the same help. Nothing here is accepted.

/// A sign or word of another notation, and the signs that mean the same in a contact and in a MATH.
#[derive(Clone, Copy)]
pub(super) struct ForeignSign {
    /// As it is written elsewhere.
    pub wrong: &'static str,
    /// The sign in a contact.
    pub contact: &'static str,
    /// The sign in a MATH.
    pub math: &'static str,
}

const fn sign(wrong: &'static str, contact: &'static str, math: &'static str) -> ForeignSign {
    ForeignSign { wrong, contact, math }
}

const SIGNS: [ForeignSign; 16] = [
    sign("&&", "&", "&&"),
    sign("||", "|", "||"),
    sign("<>", "!=", "!="),
    sign("=>", ">=", ">="),
    sign("=<", "<=", "<="),
    sign("//", "/", "/"),
    sign("×", "*", "*"),
    sign("·", "*", "*"),
    sign("÷", "/", "/"),
    sign("−", "-", "-"),
    sign("≤", "<=", "<="),
    sign("≥", ">=", ">="),
    sign("≠", "!=", "!="),
    sign("¬", "!", "!"),
    sign("∧", "&", "&&"),
    sign("∨", "|", "||"),
];

const WORDS: [ForeignSign; 6] = [
    sign("and", "&", "&&"),
    sign("or", "|", "||"),
    sign("not", "!", "!"),
    sign("xor", "!=", "^"),
    sign("mod", "%", "%"),
    sign("div", "/", "/"),
];

/// The sign of another notation at the beginning of a text.
pub(super) fn at_start(rest: &str) -> Option<ForeignSign> {
    if rest.starts_with(|first: char| first.is_ascii_alphanumeric()) {
        return None;
    }
    SIGNS.into_iter().find(|sign| rest.starts_with(sign.wrong))
}

/// The sign for a word, in any case, that is an operator elsewhere.
pub(super) fn of_word(word: &str) -> Option<ForeignSign> {
    WORDS.into_iter().find(|sign| sign.wrong.eq_ignore_ascii_case(word))
}
