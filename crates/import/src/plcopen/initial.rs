//! Initial values of PLCopen as those of tags.

use super::document::InitialValue;
use super::literals::{IecLiteral, literal, real};
use super::types::{IecType, VariableKind};

/// `initial` of a tag, as TOML; `None` if it is what a tag has anyway, or cannot be said.
pub(super) fn text(value: &InitialValue, kind: &VariableKind) -> Option<String> {
    match (kind, value) {
        (VariableKind::Plain(kind), InitialValue::Simple(text)) => {
            let text = plain(text, *kind)?;
            (!["0", "0.0", "false"].contains(&text.as_str())).then_some(text)
        }
        (VariableKind::Array { element, count, .. }, InitialValue::Array(values)) => {
            let value = |at: usize| match values.get(at) {
                Some(InitialValue::Simple(text)) => plain(text, *element),
                _ => plain("0", *element),
            };
            let values: Option<Vec<String>> = (0..*count as usize).map(value).collect();
            values.map(|values| format!("[{}]", values.join(", ")))
        }
        (VariableKind::Struct(fields), InitialValue::Struct(values)) => {
            let member = |value: &super::document::InitialMember| {
                let field = fields.iter().find(|field| field.name == value.name.to_lowercase())?;
                let InitialValue::Simple(text) = &value.value else { return None };
                Some(format!("{} = {}", field.field, plain(text, field.kind)?))
            };
            let values: Vec<String> = values.iter().filter_map(member).collect();
            (!values.is_empty()).then(|| format!("{{ {} }}", values.join(", ")))
        }
        _ => None,
    }
}

/// A value of an elementary type.
fn plain(text: &str, kind: IecType) -> Option<String> {
    Some(match (kind, literal(text)?) {
        (IecType::Bool, IecLiteral::Bool(is_on)) => is_on.to_string(),
        (IecType::Bool, IecLiteral::Whole(value)) => (value != 0).to_string(),
        (IecType::Whole { .. }, IecLiteral::Whole(value)) => {
            let [low, high] = kind.range();
            (low..=high).contains(&value).then(|| value.to_string())?
        }
        (IecType::Time, IecLiteral::Time { ms, .. }) => ms.to_string(),
        (IecType::Time, IecLiteral::Whole(value)) => value.to_string(),
        (IecType::Real, IecLiteral::Real(value)) => real(value),
        (IecType::Real, IecLiteral::Whole(value)) => real(value as f64),
        _ => return None,
    })
}
