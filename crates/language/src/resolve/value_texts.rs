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

/// A value with its text, for people: `1 (dosing)`, or `12` without a text.
pub fn with_text(value: impl Display, text: Option<&str>) -> String {
    match text {
        Some(text) => format!("{value} ({text})"),
        None => value.to_string(),
    }
}
