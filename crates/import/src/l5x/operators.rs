//! Operations of two formulas.
//!
//! Called by `expression` and `numbers`: which type the result has, how many bits it can need, and
//! what differs from Logix.

use super::formula::{DIVISION, LAST_BIT, LogixFormula, ValueType};

/// An operation of two formulas.
///
/// # Errors
/// The operation is not for values of this type.
pub(super) fn binary(
    operator: &str,
    left: LogixFormula,
    right: LogixFormula,
) -> Result<LogixFormula, String> {
    let is_real = left.value == ValueType::Real || right.value == ValueType::Real;
    let has_bool = left.value == ValueType::Bool || right.value == ValueType::Bool;
    let is_logic = matches!(operator, "&" | "|" | "^");
    if has_bool && !is_logic || (is_logic && is_real) {
        return Err(format!("`{operator}` between values of these types"));
    }
    if is_real {
        return Ok(real(operator, left.into_real(), right.into_real()));
    }
    let (left, right) = match operator {
        "+" | "-" if left.bits.max(right.bits) < 62 => (left, right),
        "*" if left.bits + right.bits <= 63 => (left, right),
        _ => (left.wrapped(), right.wrapped()),
    };
    let bits = match operator {
        "+" | "-" => left.bits.max(right.bits).max(32) + 1,
        "*" => left.bits + right.bits,
        "/" => 33,
        _ => 32,
    };
    let both_bool = left.value == ValueType::Bool && right.value == ValueType::Bool;
    let mut joined = join(operator, left, right);
    joined.bits = bits;
    joined.value = if both_bool { ValueType::Bool } else { ValueType::Whole };
    Ok(joined)
}

/// `&&` or `||` of two conditions.
///
/// # Errors
/// One of them is no condition.
pub(super) fn logical(
    operator: &str,
    left: LogixFormula,
    right: LogixFormula,
) -> Result<LogixFormula, String> {
    match (left.value, right.value) {
        (ValueType::Bool, ValueType::Bool) => binary(operator, left, right),
        _ => Err(format!("`{operator}{operator}` between numbers")),
    }
}

/// An operation of two REALs.
pub(super) fn real(operator: &str, left: LogixFormula, right: LogixFormula) -> LogixFormula {
    let mut joined = join(operator, left, right);
    joined.value = ValueType::Real;
    joined.real_operations += 1;
    if operator == "**" {
        joined.differences.push(LAST_BIT);
    }
    joined
}

/// Two formulas with an operator between them.
pub(super) fn join(operator: &str, left: LogixFormula, right: LogixFormula) -> LogixFormula {
    let mut differences = left.differences.clone();
    differences.extend(&right.differences);
    let divides = matches!(operator, "/" | "%");
    if divides && !(right.is_constant() && right.text.parse::<f64>().is_ok_and(|by| by != 0.0)) {
        differences.push(DIVISION);
    }
    let text = format!("{} {operator} {}", left.operand(), right.operand());
    LogixFormula {
        text,
        value: ValueType::Whole,
        bits: 32,
        reads: [left.reads, right.reads].concat(),
        is_atom: false,
        is_plain: false,
        real_operations: left.real_operations + right.real_operations,
        differences,
    }
}

/// A whole number as a REAL.
pub(super) fn in_reals(formula: LogixFormula) -> LogixFormula {
    LogixFormula {
        text: format!("toreal({})", formula.text),
        value: ValueType::Real,
        is_atom: true,
        is_plain: false,
        ..formula
    }
}
