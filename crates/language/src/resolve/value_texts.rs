//! The texts of a tag's values, `texts = { 0 = "idle" }`: what a person reads beside the number.
//!
//! Made by `tag_texts` for each tag, and kept by [`super::name_book::NameBook`], which every part
//! that shows a value asks. No scan depends on them.

use std::collections::BTreeMap;
use std::fmt::{self, Display};

/// The texts of a tag's values, by the content of its cell.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ValueTexts {
    texts: BTreeMap<i32, String>,
}

impl ValueTexts {
    /// Adds the text of a value.
    pub(super) fn add(&mut self, value: i32, text: &str) {
        self.texts.insert(value, text.to_owned());
    }

    /// The text of a value.
    pub fn text(&self, content: i32) -> Option<&str> {
        self.texts.get(&content).map(String::as_str)
    }

    /// All values with a text, in the order of the values.
    pub fn iter(&self) -> impl Iterator<Item = (i32, &str)> {
        self.texts.iter().map(|(value, text)| (*value, text.as_str()))
    }
}

impl fmt::Display for ValueTexts {
    /// `0 = idle; 1 = dosing`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, (value, text)) in self.iter().enumerate() {
            let between = if at == 0 { "" } else { "; " };
            write!(f, "{between}{value} = {text}")?;
        }
        Ok(())
    }
}

/// The text of a value in the list that [`ValueTexts`] is displayed as: `dosing` for 1 in
/// `0 = idle; 1 = dosing`.
pub fn text_in_list(list: &str, content: i64) -> Option<&str> {
    // A text may contain `; `, but then no number and ` = ` follow.
    let is_entry =
        |rest: &str| rest.split_once(" = ").is_some_and(|(value, _)| value.parse::<i64>().is_ok());
    let mut entries = list;
    loop {
        let ends = entries.match_indices("; ").map(|(at, _)| at);
        let end = ends.into_iter().find(|at| is_entry(&entries[at + 2..]));
        let (value, text) = entries[..end.unwrap_or(entries.len())].split_once(" = ")?;
        if value.parse() == Ok(content) {
            return Some(text);
        }
        entries = &entries[end? + 2..];
    }
}

/// A value with its text, for people: `1 (dosing)`, or `12` without a text.
pub fn with_text(value: impl Display, text: Option<&str>) -> String {
    match text {
        Some(text) => format!("{value} ({text})"),
        None => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_of_a_value_is_found_in_the_list_of_all_texts() {
        let mut texts = ValueTexts::default();
        for (value, text) in [(-1, "off; waits"), (0, "a = b"), (7, "rinse; 2 times")] {
            texts.add(value, text);
        }
        let list = texts.to_string();
        for (value, text) in texts.iter() {
            assert_eq!(text_in_list(&list, value.into()), Some(text));
        }
        assert_eq!(text_in_list(&list, 2), None);
        assert_eq!(text_in_list("", 0), None);
        assert_eq!(text_in_list("no list; at all", 0), None);
    }
}
