//! `bare-timer-value`: a timer's preset, an interval, or a value compared with a timer's `.Acc`,
//! given as an integer without a unit. 0 needs no unit.
//!
//! Passes:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["TMR T0 preset=3s"] },
//!   { when = ["T0.Acc > 1s"], do = ["OUT Y0"] },
//! ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["TMR T0 preset=3000"] },
//!   { when = ["T0.Acc > 1"], do = ["OUT Y0"] },
//! ]
//! ```

use crate::resolve::program::{ConstantForm, Contact, Tag, Value};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, text};
use crate::source::span::{Located, Span};
use rungd_engine::isa::{OperandKind, Structure, Word, duration};

use super::context::{Context, ProgramInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for placed in context.instructions() {
        for (key, value) in placed.instruction.operands.of::<Value>() {
            let kind = placed.mnemonic().spec().operand(key).map(|operand| operand.kind);
            if matches!(kind, Some(OperandKind::Duration | OperandKind::Interval)) {
                findings.extend(operand(context, placed, key, value));
            }
        }
    }
    findings.extend(context.contacts().filter_map(|contact| compare(context, contact)));
}

/// The tag that names the constant at `place`.
fn tag<'a>(context: &Context<'a>, place: Span) -> Option<&'a Tag> {
    let named = context.program.names.constants.within(place).first()?;
    Some(&context.program.tags[named.tag])
}

/// The finding for a tag's value without a unit. Its place is the tag's value, because the author
/// must correct the value there.
fn in_tags(tag: &Tag, place: Span, message: String, number: i32) -> Finding {
    let name = &tag.name;
    let help = choice(number, |ms| format!("{name} = {{ value = \"{}\" }}", duration::print(ms)));
    Finding::new(Code::BareTimerValue, place, message)
        .label("read as ms")
        .related(tag.span, format!("{number} here"))
        .help(format!("give the tag its unit: {}", help.text))
}

fn operand(
    context: &Context,
    placed: &ProgramInstruction,
    key: &str,
    Located { value, span }: Located<Value>,
) -> Option<Finding> {
    let number = bare(value)?;
    if let Some(tag) = tag(context, span) {
        let (name, said) = (&tag.name, placed.name());
        let message = format!("`{key}={name}` of `{said}` is {number} without a unit: ms or s?");
        return Some(in_tags(tag, span, message, number));
    }
    let message = format!("`{key}={number}` of `{}` has no unit: ms or s?", placed.name());
    let help = match context.program.layers.is_given(span.file) {
        true => {
            let help = choice(number, |ms| format!("\"{}\"", duration::print(ms)));
            Help { text: format!("where the use gives it, write {}", help.text), ..help }
        }
        false => choice(number, |ms| format!("{key}={}", duration::print(ms))),
    };
    Some(Finding::new(Code::BareTimerValue, span, message).label("read as ms").help(help))
}

fn compare(context: &Context, contact: &Contact) -> Option<Finding> {
    let Contact::Compare(left, comparison, right, span) = contact else { return None };
    let timer = |value: &Value| matches!(value, Value::Word(Word::Acc(Structure::Timer(_))));
    let number = match (left, right) {
        (acc, value) | (value, acc) if timer(acc) => bare(*value)?,
        _ => return None,
    };
    let message = format!(
        "`{}` compares a time with a number: ms or s?",
        context.program.names.contact(contact)
    );
    if let Some(tag) = tag(context, *span) {
        return Some(in_tags(tag, *span, message, number));
    }
    let help = choice(number, |ms| {
        let timed = |value: &Value| match value {
            Value::Const(..) => Value::Const(ms, ConstantForm::Duration),
            other @ (Value::Real(_) | Value::Word(_) | Value::Element(_)) => *other,
        };
        context.program.names.contact(&Contact::Compare(
            timed(left),
            *comparison,
            timed(right),
            // Numbers, also in place of a name: at no place.
            Span::default(),
        ))
    });
    Some(Finding::new(Code::BareTimerValue, *span, message).label("read as ms").help(help))
}

/// A constant without a unit; `None` for 0 and negative numbers.
fn bare(value: Value) -> Option<i32> {
    match value {
        Value::Const(number, ConstantForm::Integer) if number > 0 => Some(number),
        Value::Const(..) | Value::Real(_) | Value::Word(_) | Value::Element(_) => None,
    }
}

/// Both meanings of the number, as texts for the help.
fn choice(number: i32, write: impl Fn(i32) -> String) -> Help {
    let words = match number.checked_mul(1000) {
        Some(s) => format!("`{}`, as it is read now, or `{}`", write(number), write(s)),
        None => format!("`{}`", write(number)),
    };
    Help::from(words).with(text(write(number)).same())
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::{check, check_main};

    #[test]
    fn presets_and_intervals_without_a_unit_are_reported() {
        check(
            r#"
            [tags]
            bare = { value = 3000 }
            timed = { value = "3s" }

            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["TMR T0 preset=3000", "TMR T1 preset=3s"] },
              { when = ["X0"], do = ["TMR T2 preset=D0"] },
              { when = ["X0"], do = ["TMR T3 preset=0", "TMR T4 preset=bare"] },
              { when = ["X0"], do = ["TMR T5 preset=timed"] },
              { when = ["X0"], do = ["TMR T6 preset=3000000", "ENTASK Report every=10"] },
              { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=3000"] },
            ]

            [[task]]
            name = "Report"
            rung = [ { when = ["X1"], do = ["OUT Y0"] } ]
            "#,
            expect![[r#"
                8:39 bare-timer-value
                  `preset=3000` of `TMR` has no unit: ms or s?
                    `preset=3s`, as it is read now, or `preset=50m`
                10:58 bare-timer-value
                  `preset=bare` of `TMR` is 3000 without a unit: ms or s?
                    give the tag its unit: `bare = { value = "3s" }`, as it is read now, or
                    `bare = { value = "50m" }`
                12:39 bare-timer-value
                  `preset=3000000` of `TMR` has no unit: ms or s?
                    `preset=50m`
                12:70 bare-timer-value
                  `every=10` of `ENTASK` has no unit: ms or s?
                    `every=10ms`, as it is read now, or `every=10s`
            "#]],
        );
    }

    #[test]
    fn compares_of_a_timer_with_a_number_without_a_unit_are_reported() {
        check_main(
            r#"
            { when = ["T0.Acc > 500", "T0.Acc > 500ms"], do = ["OUT Y2"] },
            { when = ["T0.Acc == 0", "T0.Acc < D0"], do = ["OUT Y0"] },
            { when = ["500 <= T0.Acc", "CT0.Acc > 500"], do = ["OUT Y1"] },
            { when = ["X0"], do = ["TMR T0 preset=3s"] },
            { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=3000"] },
            "#,
            expect![[r#"
                4:12 bare-timer-value
                  `T0.Acc > 500` compares a time with a number: ms or s?
                    `T0.Acc > 500ms`, as it is read now, or `T0.Acc > 8m20s`
                6:12 bare-timer-value
                  `500 <= T0.Acc` compares a time with a number: ms or s?
                    `500ms <= T0.Acc`, as it is read now, or `8m20s <= T0.Acc`
            "#]],
        );
    }

    #[test]
    fn the_fix_changes_the_constant_where_the_tag_defines_it() {
        check(
            r#"
            [tags]
            long = { value = 3 }

            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["TMR T0 preset=long"] },
              { when = ["T0.Acc > long"], do = ["OUT Y0"] },
            ]
            "#,
            expect![[r#"
                7:39 bare-timer-value
                  `preset=long` of `TMR` is 3 without a unit: ms or s?
                    give the tag its unit: `long = { value = "3ms" }`, as it is read now, or
                    `long = { value = "3s" }`
                8:12 bare-timer-value
                  `T0.Acc > long` compares a time with a number: ms or s?
                    give the tag its unit: `long = { value = "3ms" }`, as it is read now, or
                    `long = { value = "3s" }`
            "#]],
        );
    }
}
