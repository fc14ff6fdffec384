//! The part of JSON Schema that `rungd schema` uses, and a conversion of TOML to JSON, so that
//! files are checked against the schemas on every machine. `tests/schema/check.py` does the same
//! with a validator from a different project.

use serde_json::{Map, Value, json};
use toml::de::{DeTable, DeValue};

/// Converts a TOML text to JSON.
pub fn json_of(text: &str) -> Value {
    let table = DeTable::parse(text).expect("TOML");
    of_table(table.get_ref())
}

fn of_table(table: &DeTable<'_>) -> Value {
    let entries = table.iter().map(|(key, value)| (key.get_ref().to_string(), of(value.get_ref())));
    Value::Object(entries.collect::<Map<_, _>>())
}

fn of(value: &DeValue<'_>) -> Value {
    match value {
        DeValue::String(text) => json!(text),
        DeValue::Integer(number) => {
            json!(i64::from_str_radix(number.as_str(), number.radix()).expect("an integer"))
        }
        DeValue::Float(number) => json!(number.as_str().parse::<f64>().expect("a number")),
        DeValue::Boolean(on) => json!(on),
        DeValue::Array(items) => items.iter().map(|item| of(item.get_ref())).collect(),
        DeValue::Table(table) => of_table(table),
        other => panic!("{other:?} stands in no file of rungd"),
    }
}

/// The errors that a schema finds in a value, each with its path.
pub fn wrong(root: &Value, schema: &Value, value: &Value, path: &str) -> Vec<String> {
    let Some(schema) = schema.as_object() else {
        return if schema == &json!(true) { Vec::new() } else { vec![format!("{path}: refused")] };
    };
    let mut found = Vec::new();
    for (keyword, rule) in schema {
        found.extend(by_keyword(root, SchemaRule { keyword, rule }, value, path));
    }
    if let Some(object) = value.as_object() {
        found.extend(in_object(root, schema, object, path));
    }
    found
}

/// A keyword of a schema with its value.
struct SchemaRule<'s> {
    keyword: &'s str,
    rule: &'s Value,
}

fn by_keyword(root: &Value, rule: SchemaRule, value: &Value, path: &str) -> Vec<String> {
    let SchemaRule { keyword, rule } = rule;
    let fits = |schema: &Value| wrong(root, schema, value, path).is_empty();
    let array = |rule: &Value| rule.as_array().cloned().unwrap_or_default();
    let number = |rule: &Value| rule.as_i64().expect("a number");
    let length = || value.as_str().map(|text| text.chars().count() as i64);
    let good = match keyword {
        "type" if rule.is_array() => array(rule).iter().any(|name| has_type(name, value)),
        "type" => has_type(rule, value),
        "const" => rule == value,
        "enum" => array(rule).contains(value),
        "minimum" => value.as_i64().is_none_or(|n| n >= number(rule)),
        "maximum" => value.as_i64().is_none_or(|n| n <= number(rule)),
        "minLength" => length().is_none_or(|n| n >= number(rule)),
        "maxLength" => length().is_none_or(|n| n <= number(rule)),
        "minItems" => value.as_array().is_none_or(|items| items.len() as i64 >= number(rule)),
        "minProperties" => value.as_object().is_none_or(|o| o.len() as i64 >= number(rule)),
        "required" => array(rule).iter().all(|key| value.get(key.as_str().unwrap()).is_some()),
        "oneOf" => array(rule).iter().filter(|schema| fits(schema)).count() == 1,
        "anyOf" => array(rule).iter().any(fits),
        "not" => !fits(rule),
        "items" => {
            let items = value.as_array().into_iter().flatten().enumerate();
            return items
                .flat_map(|(at, item)| wrong(root, rule, item, &format!("{path}[{at}]")))
                .collect();
        }
        "$ref" => {
            let name = rule.as_str().and_then(|name| name.strip_prefix("#/$defs/"));
            return wrong(root, &root["$defs"][name.expect("a name")], value, path);
        }
        // Patterns are checked only by the other validator. The names of properties are checked in
        // `in_object`.
        "properties" | "additionalProperties" | "propertyNames" | "pattern" => true,
        "$schema" | "$defs" | "title" | "description" | "default" => true,
        other => panic!("the schema has a keyword `{other}` that this does not know"),
    };
    if good { Vec::new() } else { vec![format!("{path}: {keyword} {rule}")] }
}

fn in_object(
    root: &Value,
    schema: &Map<String, Value>,
    object: &Map<String, Value>,
    path: &str,
) -> Vec<String> {
    let nothing = json!({});
    let others = schema.get("additionalProperties").unwrap_or(&nothing);
    let names = schema.get("propertyNames").unwrap_or(&nothing);
    let mut found = Vec::new();
    for (key, value) in object {
        let known = schema.get("properties").and_then(|known| known.get(key));
        let path = format!("{path}.{key}");
        found.extend(wrong(root, names, &json!(key), &path));
        found.extend(wrong(root, known.unwrap_or(others), value, &path));
    }
    found
}

fn has_type(name: &Value, value: &Value) -> bool {
    match name.as_str().expect("a type") {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "integer" => value.is_i64(),
        "number" => value.is_number(),
        "boolean" => value.is_boolean(),
        other => panic!("type {other}"),
    }
}
