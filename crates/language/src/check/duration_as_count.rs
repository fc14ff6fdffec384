//! `duration-as-count`: a counter's preset, or a value compared with its count, given as a
//! duration.
//!
//! A duration is a number of ms, so `preset=3s` counts to 3000. A unit means a time: the author
//! wants either a timer or a number without a unit. This rule is the opposite of
//! `bare_timer_value`.
//!
//! Passes:
//!
//! ```toml
//! rung = [
//!   { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=3"] },
//!   { when = ["X0"], do = ["TMR T0 preset=3s"] },
//! ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [ { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=3s"] } ]
//! ```

use crate::resolve::program::{ConstantForm, Contact, Value};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, text};
use crate::source::span::{Located, Span};
use rungd_engine::isa::{OperandKind, Structure, Word, duration};

use super::context::{Context, ProgramInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for placed in context.instructions().filter(|p| p.mnemonic().owns_structure()) {
        for (key, value) in placed.instruction.operands.of::<Value>() {
            let kind = placed.mnemonic().spec().operand(key).map(|operand| operand.kind);
            if matches!(kind, Some(OperandKind::Value(..))) {
                findings.extend(preset(placed, key, &value));
            }
        }
    }
    findings.extend(context.contacts().filter_map(|contact| compare(context, contact)));
}

fn preset(placed: &ProgramInstruction, key: &str, value: &Located<Value>) -> Option<Finding> {
    let ms = time(value.value)?;
    let (name, said) = (placed.name(), duration::print(ms));
    let message = format!("`{key}={said}` of `{name}` is a time, and `{name}` counts: {ms} counts");
    let right = format!("{key}={ms}");
    let help =
        format!("write a number of counts, `{right}` as it is read now; a timer takes a time");
    Some(finding(value.span, message, Help::from(help).with(text(right).same())))
}

fn compare(context: &Context, contact: &Contact) -> Option<Finding> {
    let Contact::Compare(left, comparison, right, span) = contact else { return None };
    let ms = match (left, right) {
        (count, value) | (value, count) if is_count(count) => time(*value)?,
        _ => return None,
    };
    let said = context.program.names.contact(contact);
    let message = format!("`{said}` compares a count with a time: {ms} counts");
    let bare = |value: &Value| match value {
        Value::Const(n, _) => Value::Const(*n, ConstantForm::Integer),
        Value::Real(_) | Value::Word(_) | Value::Element(_) => *value,
    };
    let right = context.program.names.contact(&Contact::Compare(
        bare(left),
        *comparison,
        bare(right),
        // Numbers, also in place of a name: at no place.
        Span::default(),
    ));
    let help = format!("write a number of counts, `{right}` as it is read now");
    Some(finding(*span, message, Help::from(help).with(text(right).same())))
}

fn finding(place: Span, message: String, help: Help) -> Finding {
    Finding::new(Code::DurationAsCount, place, message).label("read as a number").help(help)
}

fn is_count(value: &Value) -> bool {
    let counter = |structure: Structure| !matches!(structure, Structure::Timer(_));
    match value {
        Value::Word(Word::Acc(structure)) => counter(*structure),
        Value::Word(Word::Pre(_)) => true,
        Value::Word(Word::Space(..)) | Value::Element(_) | Value::Const(..) | Value::Real(_) => {
            false
        }
    }
}

/// A constant with a unit.
fn time(value: Value) -> Option<i32> {
    match value {
        Value::Const(ms, ConstantForm::Duration) => Some(ms),
        Value::Const(_, ConstantForm::Integer)
        | Value::Real(_)
        | Value::Word(_)
        | Value::Element(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn durations_in_presets_and_compares_of_counters_are_reported() {
        check(
            r#"
            [tags]
            pause = { value = "2s" }

            [[program]]
            name = "Main"
            rung = [
              { leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT CT0 preset=3s"] },
              { leg.up = ["X0"], leg.dn = ["X1"], do = ["UDCG CT1 up-preset=pause dn-preset=3"] },
              { when = ["X0"], do = ["CTU N0 preset=1s"] },
              { when = ["CT0.Acc > 3s", "2s == N0.ACC"], do = ["TMR T0 preset=3s"] },
              { when = ["T0.Acc > 3s", "CT0.Acc > D0"], do = ["TMR T1 preset=D0"] },
              { when = ["X1"], do = ["MOVE 3s to=D0"] },
            ]
            "#,
            expect![[r#"
                7:60 duration-as-count
                  `preset=3s` of `CNT` is a time, and `CNT` counts: 3000 counts
                    write a number of counts, `preset=3000` as it is read now; a timer takes
                    a time
                8:63 duration-as-count
                  `up-preset=2s` of `UDCG` is a time, and `UDCG` counts: 2000 counts
                    write a number of counts, `up-preset=2000` as it is read now; a timer
                    takes a time
                9:39 duration-as-count
                  `preset=1s` of `CTU` is a time, and `CTU` counts: 1000 counts
                    write a number of counts, `preset=1000` as it is read now; a timer takes
                    a time
                10:12 duration-as-count
                  `CT0.Acc > 3s` compares a count with a time: 3000 counts
                    write a number of counts, `CT0.Acc > 3000` as it is read now
                10:28 duration-as-count
                  `2s == N0.ACC` compares a count with a time: 2000 counts
                    write a number of counts, `2000 == N0.ACC` as it is read now
            "#]],
        );
    }
}
