//! The functions of numbers as expressions and compares of rungd; used by `functions`.

use super::formula::IecFormula;
use super::memory::LocatedPlace;
use super::types::IecType;
use crate::condition::{RungCondition, TouchedPlace};

/// What a function gives.
pub(super) enum FunctionResult {
    Power(RungCondition),
    Number(FunctionCalculation),
    /// The place of a function of the file.
    Place(LocatedPlace),
}

/// A calculation.
pub(super) struct FunctionCalculation {
    pub(super) kind: IecType,
    /// The expressions, each with `@` for the result of the one before it.
    pub(super) texts: Vec<String>,
    pub(super) reads: Vec<TouchedPlace>,
    /// Whether the expression is a bit, which only MATH makes a number of.
    pub(super) is_bit: bool,
    /// Without it nothing is assigned: a divisor that is not 0.
    pub(super) guard: Option<RungCondition>,
}

/// Whether a condition is one bit.
pub(super) fn is_plain(power: &RungCondition) -> bool {
    matches!(power, RungCondition::Bit { text, .. } if !text.contains('('))
}

/// Whether a text is a literal or a place.
pub(super) fn literal_or_place(text: &str) -> bool {
    let begins = text.trim_start_matches('-');
    begins.chars().all(|c| c.is_ascii_alphanumeric() || "_.[]$".contains(c))
}

/// Whether a function compares.
pub(super) fn is_compare(name: &str) -> bool {
    compare_operator(name).is_some()
}

fn compare_operator(name: &str) -> Option<&'static str> {
    match name {
        "GT" => Some(">"),
        "GE" => Some(">="),
        "EQ" => Some("=="),
        "NE" => Some("!="),
        "LE" => Some("<="),
        "LT" => Some("<"),
        _ => None,
    }
}

/// A compare of several values, each with the next.
pub(super) fn compared(name: &str, values: &[IecFormula]) -> Option<RungCondition> {
    let operator = compare_operator(name)?;
    if values.len() < 2 || (name == "NE" && values.len() > 2) {
        return None;
    }
    let pair = |pair: &[IecFormula]| {
        let reads = [pair[0].reads.clone(), pair[1].reads.clone()].concat();
        RungCondition::compare(&pair[0].text, operator, &pair[1].text, reads)
    };
    // Of two literals there is nothing to compare at run time, and rungd refuses them.
    if values.iter().all(|value| value.reads.is_empty()) {
        return None;
    }
    Some(RungCondition::all(values.windows(2).map(pair)))
}

/// The expressions of a function of numbers.
///
/// # Errors
/// There is no such function for values of this type.
pub(super) fn calculated(
    name: &str,
    kind: IecType,
    values: &[IecFormula],
) -> Result<Vec<String>, String> {
    let refused = || Err(format!("the function {name} of {} values", values.len()));
    let is_whole = matches!(kind, IecType::Whole { .. });
    let operator = match name {
        "ADD" => "+",
        "SUB" => "-",
        "MUL" => "*",
        "DIV" => "/",
        "MOD" if is_whole => "%",
        "AND" if is_whole => "&",
        "OR" if is_whole => "|",
        "XOR" if is_whole => "^",
        _ => return one_text(name, kind, values).map(|text| vec![text]),
    };
    let is_extensible = matches!(name, "ADD" | "MUL" | "AND" | "OR" | "XOR");
    let [first, second, rest @ ..] = values else { return refused() };
    if (!rest.is_empty() && !is_extensible)
        || (kind == IecType::Time && !matches!(name, "ADD" | "SUB"))
    {
        return refused();
    }
    let is_logic = matches!(operator, "&" | "|" | "^");
    let cut = |text: String| if is_logic { text } else { kind.cut(&text) };
    let mut texts = vec![cut(format!("{} {operator} {}", first.operand(), second.operand()))];
    texts.extend(rest.iter().map(|next| cut(format!("@ {operator} {}", next.operand()))));
    Ok(texts)
}

/// The expression of a function that is one of rungd, too.
fn one_text(name: &str, kind: IecType, values: &[IecFormula]) -> Result<String, String> {
    let texts: Vec<&str> = values.iter().map(|value| value.text.as_str()).collect();
    let is_whole = matches!(kind, IecType::Whole { .. });
    match (name, &texts[..]) {
        ("MOVE", [one]) => Ok((*one).to_owned()),
        ("ABS", [one]) if is_whole => Ok(kind.cut(&format!("abs({one})"))),
        ("ABS", [one]) if kind == IecType::Real => Ok(format!("abs({one})")),
        ("SQRT", [one]) if kind == IecType::Real => Ok(format!("sqrt({one})")),
        ("NOT", [_]) if is_whole => Ok(kind.cut(&format!("~{}", values[0].operand()))),
        ("MIN" | "MAX", [_, _, ..]) => Ok(format!("{}({})", name.to_lowercase(), texts.join(", "))),
        ("LIMIT", [low, value, high]) => {
            Ok(format!("if({value} > {low}, if({value} < {high}, {value}, {high}), {low})"))
        }
        _ => Err(format!("the function {name}")),
    }
}
