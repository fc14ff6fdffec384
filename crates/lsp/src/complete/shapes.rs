//! The keys that a table may have, and the words that a value may be. The readers define both.

use serde_json::Value;

use rungd_language::source::key::{Key, KeyLimit};
use rungd_language::source::shape::{TableShape, ValueForm};

/// The table at the end of a path from the root on.
pub(super) fn table(shape: &TableShape, path: &[&str]) -> Option<TableShape> {
    match path.is_empty() {
        true => Some(shape.clone()),
        false => shape.entry(path)?.1.below().cloned(),
    }
}

/// Whether the reader accepts a key.
pub(super) fn is_taken(key: &Key) -> bool {
    !matches!(key.limit, KeyLimit::Refused)
}

/// The words that a value may be.
pub(super) fn words(key: &Key, form: &ValueForm) -> Vec<String> {
    if let ValueForm::Words(words) = form {
        return words.iter().map(|word| (*word).to_owned()).collect();
    }
    match key.limit {
        KeyLimit::Schema(schema) => {
            let schema: Value = serde_json::from_str(schema).unwrap_or_default();
            let choices = schema["anyOf"].as_array().cloned().unwrap_or_default();
            let lists = choices.iter().chain([&schema]).filter_map(|one| one["enum"].as_array());
            let all = lists.flatten().cloned().chain([schema["const"].clone()]);
            all.filter_map(|word| Some(word.as_str()?.to_owned())).collect()
        }
        KeyLimit::None | KeyLimit::Refused => Vec::new(),
    }
}

/// The text after a key: as plain text, and as a snippet.
pub(super) fn skeleton(form: &ValueForm) -> (&'static str, &'static str) {
    match form {
        ValueForm::Text
        | ValueForm::Words(_)
        | ValueForm::Duration
        | ValueForm::Period
        | ValueForm::TextOrTexts => (" = ", " = \"$1\""),
        ValueForm::Texts => (" = ", " = [\"$1\"]"),
        ValueForm::Flag => (" = ", " = ${1|true,false|}"),
        ValueForm::Integers(..) => (" = ", " = [$1]"),
        ValueForm::Table(_) => (" = ", " = { $1 }"),
        ValueForm::Tables(_) => (" = ", " = [\n    { $1 },\n]"),
        ValueForm::Any
        | ValueForm::Integer(..)
        | ValueForm::Constant
        | ValueForm::Constants
        | ValueForm::Scalar
        | ValueForm::TextOrTable(_) => (" = ", " = $1"),
    }
}
