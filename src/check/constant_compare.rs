//! `constant-compare`: a compare with the same result in every scan.
//!
//! It compares two constants, a location with itself, or a location with a constant at or beyond
//! the limits of its range. The range is that of the memory (V 0..65535, D the whole of i32), not a
//! tag's `min` and `max`: a compare may guard against values beyond these.
//!
//! Passes:
//!
//! ```toml
//! when = ["V0 > 0"]
//! ```
//!
//! Fails:
//!
//! ```toml
//! when = ["V0 >= 0"]
//! ```

use crate::isa::{Address, Word};
use crate::resolve::program::{Comparison, Contact, Value};
use crate::source::finding::{Code, Finding};

use super::context::Context;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for contact in &context.contacts {
        let Contact::Compare(left, comparison, right, span) = contact else { continue };
        let Some((always, why)) = judge(context, *left, *comparison, *right) else { continue };
        let (word, bit) = if always { ("true", "$On") } else { ("false", "$Off") };
        let message = format!("`{}` is always {word}: {why}", context.contact(contact));
        findings.push(
            Finding::new(Code::ConstantCompare, *span, message)
                .label(format!("always {word}"))
                .help(format!("{}; if it is meant, write `{bit}`", remedy(*left, *right))),
        );
    }
}

fn remedy(left: Value, right: Value) -> &'static str {
    match (left, right) {
        (Value::Word(_), Value::Word(_)) => "compare two different locations",
        (Value::Word(_), Value::Real(real)) | (Value::Real(real), Value::Word(_))
            if real.number().fract() != 0.0 =>
        {
            "compare with a whole number, or name an R word"
        }
        (Value::Word(word), _) | (_, Value::Word(word)) if word.range().0 == 0 => {
            "D words hold more, and numbers below 0"
        }
        (Value::Word(_), _) | (_, Value::Word(_)) => "compare with a number within these limits",
        (
            Value::Const(..) | Value::Real(_) | Value::Element(_),
            Value::Const(..) | Value::Real(_) | Value::Element(_),
        ) => "compare a location with a constant",
    }
}

/// The constant result of the compare, and the reason.
fn judge(
    context: &Context,
    left: Value,
    comparison: Comparison,
    right: Value,
) -> Option<(bool, String)> {
    match (constant(left), left, constant(right), right) {
        (Some(a), _, Some(b), _) => {
            Some((holds(a, comparison, b), "both sides are constants".to_owned()))
        }
        (_, Value::Word(a), _, Value::Word(b)) if a == b => {
            Some((holds(0.0, comparison, 0.0), "both sides are the same location".to_owned()))
        }
        (_, Value::Word(word), Some(constant), _) => {
            judge_range(context, word, comparison, constant)
        }
        (Some(constant), _, _, Value::Word(word)) => {
            judge_range(context, word, mirrored(comparison), constant)
        }
        _ => None,
    }
}

/// The number of a constant.
fn constant(value: Value) -> Option<f64> {
    match value {
        Value::Const(number, _) => Some(number.into()),
        Value::Real(real) => Some(real.into()),
        Value::Word(_) | Value::Element(_) => None,
    }
}

fn judge_range(
    context: &Context,
    word: Word,
    comparison: Comparison,
    constant: f64,
) -> Option<(bool, String)> {
    let (low, high) = word.numbers();
    let held = (low..=high).contains(&constant) && (word.is_real() || constant.fract() == 0.0);
    let always = match comparison {
        Comparison::Eq | Comparison::Ne if held => None,
        Comparison::Eq => Some(false),
        Comparison::Ne => Some(true),
        // An order is constant if it has the same result at both ends of the range.
        Comparison::Lt | Comparison::Le | Comparison::Gt | Comparison::Ge => {
            let at_low = holds(low, comparison, constant);
            (at_low == holds(high, comparison, constant)).then_some(at_low)
        }
    }?;
    let said = context.say(Address::Word(word));
    let (low, high) = word.range();
    let whole = if constant.fract() == 0.0 { "" } else { "whole numbers, " };
    let why = format!("{said} holds {whole}{} to {}", word.text(low), word.text(high));
    Some((always, why))
}

fn holds(a: f64, comparison: Comparison, b: f64) -> bool {
    match comparison {
        Comparison::Eq => a == b,
        Comparison::Ne => a != b,
        Comparison::Lt => a < b,
        Comparison::Le => a <= b,
        Comparison::Gt => a > b,
        Comparison::Ge => a >= b,
    }
}

/// The same compare with its sides exchanged.
fn mirrored(comparison: Comparison) -> Comparison {
    match comparison {
        Comparison::Lt => Comparison::Gt,
        Comparison::Le => Comparison::Ge,
        Comparison::Gt => Comparison::Lt,
        Comparison::Ge => Comparison::Le,
        Comparison::Eq | Comparison::Ne => comparison,
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check_main;

    #[test]
    fn the_limits_of_the_memory() {
        check_main(
            r#"
            { when = ["V0 >= 0", "V0 > 0", "V0 <= 0", "V0 < 0"], do = ["OUT Y0"] },
            { when = ["V0 == -1", "V0 == 0", "V0 != 70000"], do = ["OUT Y4"] },
            { when = ["V0 <= 65535", "V0 < 65535", "65535 < MHR1", "0 <= MIR1"], do = ["OUT Y1"] },
            { when = ["D0 > 2147483647", "D0 >= 2147483647"], do = ["OUT Y2"] },
            { when = ["D0 >= -2147483648"], do = ["OUT Y5"] },
            { when = ["N0.ACC > 32767", "N0.PRE >= 32767"], do = ["OUT Y3"] },
            { when = ["X0"], do = ["CTU N0 preset=1"] },
            "#,
            expect![[r#"
                4:12 constant-compare
                  `V0 >= 0` is always true: `V0` holds 0 to 65535
                    D words hold more, and numbers below 0; if it is meant, write `$On`
                4:44 constant-compare
                  `V0 < 0` is always false: `V0` holds 0 to 65535
                    D words hold more, and numbers below 0; if it is meant, write `$Off`
                5:12 constant-compare
                  `V0 == -1` is always false: `V0` holds 0 to 65535
                    D words hold more, and numbers below 0; if it is meant, write `$Off`
                5:35 constant-compare
                  `V0 != 70000` is always true: `V0` holds 0 to 65535
                    D words hold more, and numbers below 0; if it is meant, write `$On`
                6:12 constant-compare
                  `V0 <= 65535` is always true: `V0` holds 0 to 65535
                    D words hold more, and numbers below 0; if it is meant, write `$On`
                6:41 constant-compare
                  `65535 < MHR1` is always false: `MHR1` holds 0 to 65535
                    D words hold more, and numbers below 0; if it is meant, write `$Off`
                6:57 constant-compare
                  `0 <= MIR1` is always true: `MIR1` holds 0 to 65535
                    D words hold more, and numbers below 0; if it is meant, write `$On`
                7:12 constant-compare
                  `D0 > 2147483647` is always false: `D0` holds -2147483648 to 2147483647
                    compare with a number within these limits; if it is meant, write `$Off`
                8:12 constant-compare
                  `D0 >= -2147483648` is always true: `D0` holds -2147483648 to 2147483647
                    compare with a number within these limits; if it is meant, write `$On`
                9:12 constant-compare
                  `N0.ACC > 32767` is always false: `N0.ACC` holds -32768 to 32767
                    compare with a number within these limits; if it is meant, write `$Off`
            "#]],
        );
    }

    #[test]
    fn constants_and_a_location_with_itself() {
        check_main(
            r#"
            { when = ["1 == 1", "2s < 1s", "D0 == D0", "D0 < D0", "D0 == D1"], do = ["OUT Y0"] },
            "#,
            expect![[r#"
                4:12 constant-compare
                  `1 == 1` is always true: both sides are constants
                    compare a location with a constant; if it is meant, write `$On`
                4:22 constant-compare
                  `2s < 1s` is always false: both sides are constants
                    compare a location with a constant; if it is meant, write `$Off`
                4:33 constant-compare
                  `D0 == D0` is always true: both sides are the same location
                    compare two different locations; if it is meant, write `$On`
                4:45 constant-compare
                  `D0 < D0` is always false: both sides are the same location
                    compare two different locations; if it is meant, write `$Off`
            "#]],
        );
    }
}
