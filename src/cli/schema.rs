//! `rungd schema`: JSON Schema (draft 2020-12) of a ladder file or a controller file, for editors
//! and for programs that write such files.
//!
//! Keys and types are what the readers ask for ([`crate::source::shape`]), their meanings stand in
//! [`crate::source::keys`]. What a schema cannot say (that an address exists, that a rung's
//! legs are its instruction's) remains `rungd check`'s.

use std::io::Write;

use anyhow::Result;
use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};

use super::exit::Exit;
use crate::controller;
use crate::source::keys::{self, Key};
use crate::source::ladder;
use crate::source::shape::{Form, Shape};

/// Prints the JSON Schema of a kind of file
#[derive(Args, Debug)]
pub struct SchemaArgs {
    /// The kind of file
    #[arg(value_name = "KIND")]
    kind: FileKind,
}

/// A kind of file that a schema describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FileKind {
    /// A ladder file
    Ladder,
    /// A controller file
    Controller,
}

/// As `isa::duration` reads it.
const DURATION: &str = "^([0-9]+h)?([0-9]+m)?([0-9]+s)?([0-9]+ms)?$|^[0-9]+(:[0-9]+){3}$";

/// Prints the schema.
///
/// # Errors
/// Standard output cannot be written.
pub fn schema(args: &SchemaArgs) -> Result<Exit> {
    let text = serde_json::to_string_pretty(&of(args.kind))?;
    writeln!(std::io::stdout().lock(), "{text}")?;
    Ok(Exit::Ok)
}

/// The schema of a kind of file.
pub fn of(kind: FileKind) -> Value {
    let (shape, words, title) = match kind {
        FileKind::Ladder => (ladder::shape(), keys::LADDER, "A ladder file of rungd"),
        FileKind::Controller => {
            (controller::shape(), keys::CONTROLLER, "A controller file of rungd")
        }
    };
    let mut writer = Writer { words, places: Map::new() };
    let mut schema = writer.table(&shape);
    schema.insert("$schema".to_owned(), json!("https://json-schema.org/draft/2020-12/schema"));
    schema.insert("title".to_owned(), json!(title));
    schema.insert("$defs".to_owned(), Value::Object(writer.places));
    Value::Object(schema)
}

struct Writer {
    words: &'static [Key],
    /// The tables that can stand in several places, by name.
    places: Map<String, Value>,
}

impl Writer {
    fn table(&mut self, shape: &Shape) -> Map<String, Value> {
        let noted = shape.noted();
        let mut properties = Map::new();
        for (key, form) in &noted.keys {
            if let Some(value) = self.value(noted.place, key, form) {
                properties.insert((*key).to_owned(), value);
            }
        }
        let others = noted.others.as_ref().and_then(|form| self.value(noted.place, "*", form));
        let mut schema = Map::new();
        schema.insert("type".to_owned(), json!("object"));
        schema.insert("additionalProperties".to_owned(), others.unwrap_or(json!(false)));
        if !properties.is_empty() {
            schema.insert("properties".to_owned(), Value::Object(properties));
        }
        if !noted.required.is_empty() {
            schema.insert("required".to_owned(), json!(noted.required));
        }
        for (_, more) in keys::TOGETHER.iter().filter(|(place, _)| *place == noted.place) {
            add(&mut schema, more);
        }
        schema
    }

    /// The schema of a key's value; `None` where the reader knows the key only to refuse it.
    fn value(&mut self, place: &str, key: &str, form: &Form) -> Option<Value> {
        let word = self.words.iter().find(|word| word.place == place && word.key == key);
        let more = word.map_or("", |word| word.more);
        if more == "false" {
            return None;
        }
        let mut schema = self.form(form);
        if let Some(word) = word {
            schema.insert("description".to_owned(), json!(word.doc));
        }
        add(&mut schema, more);
        Some(Value::Object(schema))
    }

    fn form(&mut self, form: &Form) -> Map<String, Value> {
        let value = match form {
            Form::Any => json!({}),
            Form::Text => json!({ "type": "string" }),
            Form::Flag => json!({ "type": "boolean" }),
            Form::Integer(from, to) => {
                json!({ "type": "integer", "minimum": from, "maximum": to })
            }
            Form::Integers(from, to) => {
                let item = json!({ "type": "integer", "minimum": from, "maximum": to });
                json!({ "type": "array", "items": item })
            }
            Form::Duration => json!({ "type": "string", "pattern": DURATION, "minLength": 1 }),
            Form::Constant => json!({ "type": ["integer", "string", "boolean"] }),
            Form::Texts => json!({ "type": "array", "items": { "type": "string" } }),
            Form::Table(shape) => return self.table(shape),
            Form::Tables(shape) => json!({ "type": "array", "items": self.place(shape) }),
        };
        value.as_object().cloned().unwrap_or_default()
    }

    /// A reference to the schema of a table that stands in arrays.
    fn place(&mut self, shape: &Shape) -> Value {
        let place = shape.noted().place;
        let name = place.trim_start_matches("a ").replace(' ', "-");
        let schema = Value::Object(self.table(shape));
        self.places.insert(name.clone(), schema);
        json!({ "$ref": format!("#/$defs/{name}") })
    }
}

/// Adds the keywords of a piece of schema.
fn add(schema: &mut Map<String, Value>, more: &str) {
    if let Ok(Value::Object(more)) = serde_json::from_str(more) {
        schema.extend(more);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::instruction::LegName;

    /// Every key of a shape, with the table that it stands in.
    fn keys_of(shape: &Shape, found: &mut Vec<(&'static str, &'static str)>) {
        let noted = shape.noted();
        let others = noted.others.iter().map(|form| ("*", form));
        let keys = noted.keys.iter().map(|(key, form)| (*key, form));
        for (key, form) in keys.chain(others) {
            if !found.contains(&(noted.place, key)) {
                found.push((noted.place, key));
            }
            if let Form::Table(below) | Form::Tables(below) = form {
                keys_of(below, found);
            }
        }
    }

    #[track_caller]
    fn agree(shape: &Shape, words: &[Key]) {
        let mut known = Vec::new();
        keys_of(shape, &mut known);
        let mut told: Vec<_> = words.iter().map(|word| (word.place, word.key)).collect();
        known.sort_unstable();
        told.sort_unstable();
        let untold: Vec<_> = known.iter().filter(|key| !told.contains(key)).collect();
        assert!(untold.is_empty(), "no row of source/keys.rs tells what these mean: {untold:?}");
        let stale: Vec<_> = told.iter().filter(|key| !known.contains(key)).collect();
        assert!(stale.is_empty(), "the reader does not know these rows: {stale:?}");
        assert!(told.windows(2).all(|pair| pair[0] != pair[1]), "a row stands twice");
    }

    #[test]
    fn every_key_that_a_reader_knows_is_explained() {
        agree(&ladder::shape(), keys::LADDER);
        agree(&controller::shape(), keys::CONTROLLER);
    }

    /// A value that the reader looks at in its own way has its types in `more`.
    #[test]
    fn every_value_has_a_type() {
        fn untyped(schema: &Value, path: &str, found: &mut Vec<String>) {
            for (key, value) in schema.as_object().into_iter().flatten() {
                let path = format!("{path}/{key}");
                let keywords = ["type", "$ref", "const", "enum", "oneOf", "anyOf"];
                if path.contains("properties/") && value.get("description").is_some() {
                    let typed = keywords.iter().any(|word| value.get(word).is_some());
                    found.extend((!typed).then(|| path.clone()));
                }
                untyped(value, &path, found);
            }
        }
        for kind in [FileKind::Ladder, FileKind::Controller] {
            let mut found = Vec::new();
            untyped(&of(kind), "", &mut found);
            assert!(found.is_empty(), "{found:?}");
        }
    }

    #[test]
    fn what_is_added_is_json() {
        let more = keys::LADDER.iter().chain(keys::CONTROLLER).map(|word| word.more);
        let together = keys::TOGETHER.iter().map(|(_, more)| *more);
        for text in more.chain(together).filter(|text| !text.is_empty()) {
            let parsed: Result<Value, _> = serde_json::from_str(text);
            assert!(parsed.is_ok(), "{text}: {parsed:?}");
        }
    }

    #[test]
    fn the_legs_are_those_of_the_instructions() {
        let schema = of(FileKind::Ladder);
        let legs = &schema["$defs"]["rung"]["properties"]["leg"]["propertyNames"]["enum"];
        let keys = [LegName::Up, LegName::Dn, LegName::Rst, LegName::En].map(LegName::key);
        assert_eq!(legs, &json!(keys));
    }
}
