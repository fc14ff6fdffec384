//! `rungd schema`: prints the JSON Schema (draft 2020-12) of a ladder file, a controller file or a
//! test file, for editors and for programs that write these files.
//!
//! Keys, their types and their explanations come from the readers of the files
//! ([`rungd_language::source::shape`]). Only `rungd check` finds mistakes that a schema cannot
//! express: an address that does not exist, a leg that the rung's instruction does not have.

use std::io::Write;

use anyhow::Result;
use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};

use super::exit::Exit;
use rungd_config::controller;
use rungd_lab::testing;
use rungd_language::source::key::{Key, KeyLimit};
use rungd_language::source::ladder;
use rungd_language::source::shape::{TableShape, ValueForm};

/// Prints the JSON Schema of a kind of file
#[derive(Args, Debug)]
pub struct SchemaArgs {
    /// The kind of file
    #[arg(value_name = "KIND")]
    kind: SchemaKind,
}

/// A kind of file that a schema describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SchemaKind {
    /// A ladder file
    Ladder,
    /// A controller file
    Controller,
    /// A test file
    Test,
    /// The file of an edge node
    #[cfg(feature = "fleet")]
    Edge,
    /// The file of an OPC UA server
    #[cfg(feature = "fleet")]
    Opcua,
}

/// The pattern of a duration, as in `isa::duration`.
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
pub fn of(kind: SchemaKind) -> Value {
    let (shape, title) = match kind {
        SchemaKind::Ladder => (ladder::shape(), "A ladder file of rungd"),
        SchemaKind::Controller => (controller::shape(), "A controller file of rungd"),
        SchemaKind::Test => (testing::shape(), "A test file of rungd"),
        #[cfg(feature = "fleet")]
        SchemaKind::Edge => (rungd_fleet::edge::shape(), "A file of an edge node of rungd"),
        #[cfg(feature = "fleet")]
        SchemaKind::Opcua => (rungd_fleet::opcua::shape(), "A file of an OPC UA server of rungd"),
    };
    let mut writer = SchemaWriter { places: Map::new() };
    let mut schema = writer.table(&shape);
    schema.insert("$schema".to_owned(), json!("https://json-schema.org/draft/2020-12/schema"));
    schema.insert("title".to_owned(), json!(title));
    schema.insert("$defs".to_owned(), Value::Object(writer.places));
    Value::Object(schema)
}

struct SchemaWriter {
    /// The tables that can occur in several places, by name.
    places: Map<String, Value>,
}

impl SchemaWriter {
    fn table(&mut self, shape: &TableShape) -> Map<String, Value> {
        let noted = shape.noted();
        let mut properties = Map::new();
        for (key, form) in &noted.keys {
            if let Some(value) = self.value(*key, form) {
                properties.insert(key.name.to_owned(), value);
            }
        }
        let others = noted.others.as_ref().and_then(|(any, form)| self.value(*any, form));
        let mut schema = Map::new();
        schema.insert("type".to_owned(), json!("object"));
        schema.insert("additionalProperties".to_owned(), others.unwrap_or(json!(false)));
        if !properties.is_empty() {
            schema.insert("properties".to_owned(), Value::Object(properties));
        }
        if !noted.required.is_empty() {
            schema.insert("required".to_owned(), json!(noted.required));
        }
        for more in &noted.together {
            add(&mut schema, more);
        }
        schema
    }

    /// The schema of a key's value; `None` if the reader always refuses the key.
    fn value(&mut self, key: Key, form: &ValueForm) -> Option<Value> {
        if let KeyLimit::Refused = key.limit {
            return None;
        }
        let mut schema = self.form(form);
        schema.insert("description".to_owned(), json!(key.doc));
        match key.limit {
            KeyLimit::None | KeyLimit::Refused => {}
            KeyLimit::Schema(more) => add(&mut schema, more),
        }
        Some(Value::Object(schema))
    }

    fn form(&mut self, form: &ValueForm) -> Map<String, Value> {
        let value = match form {
            ValueForm::Any => json!({}),
            ValueForm::Text => json!({ "type": "string" }),
            ValueForm::Words(words) => json!({ "type": "string", "enum": words }),
            ValueForm::Flag => json!({ "type": "boolean" }),
            ValueForm::Integer(from, to) => {
                json!({ "type": "integer", "minimum": from, "maximum": to })
            }
            ValueForm::Integers(from, to) => {
                let item = json!({ "type": "integer", "minimum": from, "maximum": to });
                json!({ "type": "array", "items": item })
            }
            ValueForm::Duration => json!({ "type": "string", "pattern": DURATION, "minLength": 1 }),
            ValueForm::Period => {
                let pattern = format!("{DURATION}|^0*[1-9][0-9][0-9]+us$");
                json!({ "type": "string", "pattern": pattern, "minLength": 1 })
            }
            ValueForm::Constant => json!({ "type": ["number", "string", "boolean"] }),
            ValueForm::Constants => {
                let one = self.form(&ValueForm::Constant);
                let record = json!({ "type": "object", "additionalProperties": one });
                json!({ "anyOf": [
                    one,
                    { "type": "array", "items": one },
                    record,
                    { "type": "array", "items": record },
                ] })
            }
            ValueForm::Scalar => json!({ "type": ["string", "number"] }),
            ValueForm::TextOrTexts => json!({ "anyOf": [
                { "type": "string" },
                { "type": "array", "items": { "type": "string" } },
            ] }),
            ValueForm::TextOrTable(shape) => json!({ "anyOf": [
                { "type": "string" },
                self.place(shape),
            ] }),
            ValueForm::Texts => json!({ "type": "array", "items": { "type": "string" } }),
            ValueForm::Table(shape) => return self.table(shape),
            ValueForm::Tables(shape) => json!({ "type": "array", "items": self.place(shape) }),
        };
        value.as_object().cloned().unwrap_or_default()
    }

    /// A reference to the schema of a table that occurs in several places.
    fn place(&mut self, shape: &TableShape) -> Value {
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
    use rungd_engine::isa::instruction::LegName;

    /// If the reader itself checks the type of a value, the limit of the key contains the types.
    #[test]
    fn every_value_of_a_schema_has_a_type() {
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
        for kind in [SchemaKind::Ladder, SchemaKind::Controller, SchemaKind::Test] {
            let mut found = Vec::new();
            untyped(&of(kind), "", &mut found);
            assert!(found.is_empty(), "{found:?}");
        }
    }

    fn pieces(shape: &TableShape, found: &mut Vec<&'static str>) {
        let noted = shape.noted();
        found.extend(&noted.together);
        for (key, form) in noted.keys.iter().chain(&noted.others) {
            if let KeyLimit::Schema(piece) = key.limit {
                found.push(piece);
            }
            if let ValueForm::Table(below)
            | ValueForm::Tables(below)
            | ValueForm::TextOrTable(below) = form
            {
                pieces(below, found);
            }
        }
    }

    #[test]
    fn each_schema_fragment_is_valid_json() {
        let mut found = Vec::new();
        pieces(&ladder::shape(), &mut found);
        pieces(&controller::shape(), &mut found);
        pieces(&testing::shape(), &mut found);
        for text in found {
            let parsed: Result<Value, _> = serde_json::from_str(text);
            assert!(parsed.is_ok(), "{text}: {parsed:?}");
        }
    }

    #[test]
    fn the_schema_lists_the_legs_of_the_instructions() {
        let schema = of(SchemaKind::Ladder);
        let legs = &schema["$defs"]["rung"]["properties"]["leg"]["propertyNames"]["enum"];
        let keys = LegName::KEYED.map(LegName::key);
        assert_eq!(legs, &json!(keys));
    }
}
