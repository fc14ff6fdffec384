//! `constant-compare`: a compare with the same result in every scan.
//!
//! It compares two constants, a location with itself, or a location with a constant at or beyond
//! the limits of its range. The range is the range of the memory (V 0..65535, D the whole of i32),
//! not a tag's `min` and `max`: a compare may guard against values beyond these. A word of the time
//! of day has its own range (`$Hour` 0..23). That range applies only to a number in the compare
//! itself. A named constant or a template's argument is a setting, which may be at a limit. So two
//! constants in a template are not judged: one of them is a parameter, and the template checks it.
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

use crate::resolve::layers::Layers;
use crate::resolve::program::{Comparison, Contact, Value};
use crate::source::finding::{Code, Finding};
use crate::source::fix::text;
use crate::source::span::Span;
use rungd_engine::isa::status::{clock_range, dst};
use rungd_engine::isa::{Address, Word, WordSpace};

use super::context::Context;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for contact in context.contacts() {
        let Contact::Compare(left, comparison, right, span) = contact else { continue };
        let of_constants = left.constant().is_some() && right.constant().is_some();
        if of_constants && Layers::is_layered(*span) {
            continue;
        }
        let compare = ValueCompare { left: *left, comparison: *comparison, right: *right };
        let judged = judge(context, *left, *comparison, *right)
            .or_else(|| judge_clock(context, compare, *span));
        let Some(ConstantResult { always, why }) = judged else { continue };
        let (word, bit) = if always { ("true", "$On") } else { ("false", "$Off") };
        let message =
            format!("`{}` is always {word}: {why}", context.program.names.contact(contact));
        findings.push(
            Finding::new(Code::ConstantCompare, *span, message)
                .label(format!("always {word}"))
                .help(format!("{}; if it is meant, write `{bit}`", remedy(*left, *right)))
                .fix(text(bit).same()),
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
        (Value::Word(word), _) | (_, Value::Word(word)) if clock(word).is_some() => {
            clock_words(word)
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

/// A compare with the same result in every scan.
struct ConstantResult {
    /// The result.
    always: bool,
    /// The reason.
    why: String,
}

/// The constant result of the compare, and the reason.
fn judge(
    context: &Context,
    left: Value,
    comparison: Comparison,
    right: Value,
) -> Option<ConstantResult> {
    match (left.constant(), left, right.constant(), right) {
        (Some(a), _, Some(b), _) => {
            let always = holds(a, comparison, b);
            Some(ConstantResult { always, why: "both sides are constants".to_owned() })
        }
        (_, Value::Word(a), _, Value::Word(b)) if a == b => {
            let always = holds(0.0, comparison, 0.0);
            Some(ConstantResult { always, why: "both sides are the same location".to_owned() })
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

/// A compare of two values.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct ValueCompare {
    pub left: Value,
    pub comparison: Comparison,
    pub right: Value,
}

/// As [`judge`], for a word of the time of day and a number in the compare itself.
fn judge_clock(
    context: &Context,
    ValueCompare { left, comparison, right }: ValueCompare,
    span: Span,
) -> Option<ConstantResult> {
    let (word, comparison, constant) = match (left, right) {
        (Value::Word(word), Value::Const(number, _)) => (word, comparison, number),
        (Value::Const(number, _), Value::Word(word)) => (word, mirrored(comparison), number),
        _ => return None,
    };
    let (low, high) = clock(word)?;
    let names_it = !context.program.names.constants.within(span).is_empty();
    if names_it || Layers::is_layered(span) {
        return None;
    }
    let always = constant_result(low.into(), high.into(), comparison, constant.into())?;
    let said = context.name(Address::Word(word));
    Some(ConstantResult { always, why: format!("`{said}` is {low} to {high}") })
}

/// The range of a word of the time of day.
fn clock(word: Word) -> Option<(i32, i32)> {
    match word {
        Word::Space(WordSpace::Dst, number) => clock_range(number),
        Word::Space(..) | Word::Acc(_) | Word::Pre(_) => None,
    }
}

/// The meaning of the lowest and highest value of a word of the time of day.
fn clock_words(word: Word) -> &'static str {
    match word {
        Word::Space(WordSpace::Dst, dst::MONTH) => "1 is January, 12 is December",
        Word::Space(WordSpace::Dst, dst::WEEKDAY) => "1 is Monday, 7 is Sunday",
        Word::Space(WordSpace::Dst, dst::HOUR) => "midnight is hour 0",
        Word::Space(..) | Word::Acc(_) | Word::Pre(_) => {
            "compare with a number within these limits"
        }
    }
}

/// The constant result of comparing a word with a constant. The word has any value from `low` to
/// `high`.
fn constant_result(low: f64, high: f64, comparison: Comparison, constant: f64) -> Option<bool> {
    match comparison {
        Comparison::Eq | Comparison::Ne if (low..=high).contains(&constant) => None,
        Comparison::Eq => Some(false),
        Comparison::Ne => Some(true),
        // The result is constant if it is the same at both ends of the range.
        Comparison::Lt | Comparison::Le | Comparison::Gt | Comparison::Ge => {
            let at_low = holds(low, comparison, constant);
            (at_low == holds(high, comparison, constant)).then_some(at_low)
        }
    }
}

fn judge_range(
    context: &Context,
    word: Word,
    comparison: Comparison,
    constant: f64,
) -> Option<ConstantResult> {
    let (low, high) = word.numbers();
    let held = (low..=high).contains(&constant) && (word.is_real() || constant.fract() == 0.0);
    let always = match comparison {
        // No word is equal to a constant that it cannot hold: one beyond its range, or a fraction.
        Comparison::Eq | Comparison::Ne if !held => Some(comparison == Comparison::Ne),
        Comparison::Eq
        | Comparison::Ne
        | Comparison::Lt
        | Comparison::Le
        | Comparison::Gt
        | Comparison::Ge => constant_result(low, high, comparison, constant),
    }?;
    let said = context.say(Address::Word(word));
    let (low, high) = word.range();
    let whole = if constant.fract() == 0.0 { "" } else { "whole numbers, " };
    let why = format!("{said} holds {whole}{} to {}", word.text(low), word.text(high));
    Some(ConstantResult { always, why })
}

/// Whether a compare of two numbers is true.
pub(super) fn holds(a: f64, comparison: Comparison, b: f64) -> bool {
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
pub(super) fn mirrored(comparison: Comparison) -> Comparison {
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

    use crate::check::testing::{check, check_main};

    #[test]
    fn compares_beyond_the_range_of_the_memory_are_reported() {
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
    fn compares_beyond_the_ranges_of_the_time_of_day_are_reported() {
        check(
            r#"
            [tags]
            from = { value = 0 }
            to = { value = 24 }

            [[program]]
            name = "Main"
            rung = [
              { when = ["$Hour > 25", "$Hour >= 0", "24 > $Hour", "$Hour < 23"], do = ["OUT Y0"] },
              { when = ["$Weekday == 0", "$Weekday != 8", "$Weekday == 7"], do = ["OUT Y1"] },
              { when = ["$Month == 0", "$Day == 32", "$Minute >= 60"], do = ["OUT Y2"] },
              { when = ["$Second == 59.5", "$Second != 60", "$Year > 1"], do = ["OUT Y3"] },
              { when = ["$Hour >= from", "$Hour < to"], do = ["OUT Y4"] },
            ]
            "#,
            expect![[r#"
                8:12 constant-compare
                  `$Hour > 25` is always false: `$Hour` is 0 to 23
                    midnight is hour 0; if it is meant, write `$Off`
                8:26 constant-compare
                  `$Hour >= 0` is always true: `$Hour` is 0 to 23
                    midnight is hour 0; if it is meant, write `$On`
                8:40 constant-compare
                  `24 > $Hour` is always true: `$Hour` is 0 to 23
                    midnight is hour 0; if it is meant, write `$On`
                9:12 constant-compare
                  `$Weekday == 0` is always false: `$Weekday` is 1 to 7
                    1 is Monday, 7 is Sunday; if it is meant, write `$Off`
                9:29 constant-compare
                  `$Weekday != 8` is always true: `$Weekday` is 1 to 7
                    1 is Monday, 7 is Sunday; if it is meant, write `$On`
                10:12 constant-compare
                  `$Month == 0` is always false: `$Month` is 1 to 12
                    1 is January, 12 is December; if it is meant, write `$Off`
                10:27 constant-compare
                  `$Day == 32` is always false: `$Day` is 1 to 31
                    compare with a number within these limits; if it is meant, write `$Off`
                10:41 constant-compare
                  `$Minute >= 60` is always false: `$Minute` is 0 to 59
                    compare with a number within these limits; if it is meant, write `$Off`
                11:12 constant-compare
                  `$Second == 59.5` is always false: `$Second` holds whole numbers,
                  -2147483648 to 2147483647
                    compare with a whole number, or name an R word; if it is meant, write
                    `$Off`
                11:31 constant-compare
                  `$Second != 60` is always true: `$Second` is 0 to 59
                    compare with a number within these limits; if it is meant, write `$On`
            "#]],
        );
    }

    #[test]
    fn compares_of_two_constants_or_of_a_location_with_itself_are_reported() {
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
