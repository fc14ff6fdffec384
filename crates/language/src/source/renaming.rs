//! Other names for a thing whose name cannot stand: the fixes of findings about names.
//!
//! Called where names are declared, here and for the controller file. A name here is only proposed;
//! its author knows a better one, so each fix is one of several.

use super::fix::{Fix, possible};

/// The letters that names write with several, and accented ones.
const PLAIN: [(&str, &str); 12] = [
    ("äÄ", "ae"),
    ("öÖ", "oe"),
    ("üÜ", "ue"),
    ("ß", "ss"),
    ("àáâãåÀÁÂÃÅ", "a"),
    ("èéêëÈÉÊË", "e"),
    ("ìíîïÌÍÎÏ", "i"),
    ("òóôõøÒÓÔÕØ", "o"),
    ("ùúûÙÚÛ", "u"),
    ("çÇ", "c"),
    ("ñÑ", "n"),
    ("ýÿÝ", "y"),
];

/// A name in the letters that names have: accents are written out, and any other sign is a `_`.
/// `what`: the word before a name that begins with no letter.
pub fn plain(name: &str, what: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        let known = PLAIN.iter().find(|(letters, _)| letters.contains(letter));
        match known {
            Some((_, plain)) => {
                let (first, rest) = plain.split_at(1);
                let first = match letter.is_uppercase() {
                    true => first.to_ascii_uppercase(),
                    false => first.to_owned(),
                };
                text.extend([&first, rest]);
            }
            None if letter.is_ascii_alphanumeric() => text.push(letter),
            None => text.push('_'),
        }
    }
    match text.starts_with(|first: char| first.is_ascii_alphabetic()) {
        true => text,
        false => format!("{what}_{text}"),
    }
}

/// The parts of a name in small letters, with `-` between them.
pub fn kebab(name: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        let begins_part = letter.is_ascii_uppercase() || !letter.is_ascii_alphanumeric();
        if begins_part && !text.is_empty() && !text.ends_with('-') {
            text.push('-');
        }
        if letter.is_ascii_alphanumeric() {
            text.push(letter.to_ascii_lowercase());
        }
    }
    text.trim_end_matches('-').to_owned()
}

/// A name for the first thing of a kind: `Program1`, `use1`.
pub(super) fn first_of(kind: &str) -> String {
    match kind.split_at_checked(1) {
        Some((first, rest))
            if ["program", "task", "subroutine", "stage", "template"].contains(&kind) =>
        {
            format!("{}{rest}1", first.to_ascii_uppercase())
        }
        _ => format!("{kind}1"),
    }
}

/// A number behind a name that is taken: the first that gives a free one. `joint`: the sign before
/// the number.
pub fn another(name: &str, joint: char, is_taken: impl Fn(&str) -> bool) -> Fix {
    let numbered = (2..100).map(|number| format!("{name}{joint}{number}"));
    possible(numbered.into_iter().find(|name| !is_taken(name)).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::fix::FixEdit;

    #[test]
    fn a_plain_name_has_letters_digits_and_underscores() {
        for (name, wanted) in [
            ("bin full", "bin_full"),
            ("bin-full", "bin_full"),
            ("Über", "Ueber"),
            ("größe", "groesse"),
            ("2nd", "tag_2nd"),
        ] {
            assert_eq!(plain(name, "tag"), wanted);
        }
    }

    #[test]
    fn a_name_in_kebab_case_has_parts_in_small_letters() {
        for (name, wanted) in [
            ("CountBottles", "count-bottles"),
            ("count bottles", "count-bottles"),
            ("Count_Bottles_", "count-bottles"),
            ("count--bottles", "count-bottles"),
        ] {
            assert_eq!(kebab(name), wanted);
        }
    }

    #[test]
    fn another_name_is_free() {
        let fix = another("fill", '-', |name| name == "fill-2");
        assert_eq!(fix.edits, [FixEdit::Write(None, "fill-3".to_owned())]);
    }
}
