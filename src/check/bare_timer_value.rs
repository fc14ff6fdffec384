//! `bare-timer-value`: a timer's preset, an interval, or what a timer's `.Acc` is compared with,
//! given as an integer without a unit. 0 needs none.
//!
//! Passes:
//!
//! ```toml
//! rung = [ { when = ["X0"], do = ["TMR T0 preset=3s"] }, { when = ["T0.Acc > 1s"], do = ["OUT Y0"] } ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [ { when = ["X0"], do = ["TMR T0 preset=3000"] }, { when = ["T0.Acc > 1"], do = ["OUT Y0"] } ]
//! ```

use crate::isa::{Kind, Structure, Word, duration};
use crate::resolve::program::{Arg, ArgValue, Contact, Value, Written};
use crate::source::finding::{Code, Finding};

use super::context::{Context, Placed};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for placed in &context.instructions {
        for arg in &placed.instruction.args {
            let kind = placed.mnemonic().spec().operand(arg.name).map(|operand| operand.kind);
            if matches!(kind, Some(Kind::Duration | Kind::Interval)) {
                findings.extend(operand(placed, arg));
            }
        }
    }
    findings.extend(context.compares.iter().filter_map(|contact| compare(context, contact)));
}

fn operand(placed: &Placed, arg: &Arg) -> Option<Finding> {
    let ArgValue::Value(value) = arg.value else { return None };
    let number = bare(value)?;
    let key = arg.name;
    let message = format!("{key}={number} of {} has no unit: ms or s?", placed.name());
    let help = choice(number, |ms| format!("{key}={}", duration::print(ms)));
    Some(Finding::new(Code::BareTimerValue, arg.span, message).label("read as ms").help(help))
}

fn compare(context: &Context, contact: &Contact) -> Option<Finding> {
    let Contact::Compare(left, comparison, right, span) = contact else { return None };
    let timer = |value: &Value| matches!(value, Value::Word(Word::Acc(Structure::Timer(_))));
    let number = match (left, right) {
        (acc, value) | (value, acc) if timer(acc) => bare(*value)?,
        _ => return None,
    };
    let message = format!("`{}` compares a time with a number: ms or s?", context.contact(contact));
    let help = choice(number, |ms| {
        let timed = |value: &Value| match value {
            Value::Const(..) => Value::Const(ms, Written::Duration),
            word => *word,
        };
        context.contact(&Contact::Compare(timed(left), *comparison, timed(right), *span))
    });
    Some(Finding::new(Code::BareTimerValue, *span, message).label("read as ms").help(help))
}

/// A constant without a unit, but for 0 and what no duration can be.
fn bare(value: Value) -> Option<i32> {
    match value {
        Value::Const(number, Written::Integer) if number > 0 => Some(number),
        _ => None,
    }
}

/// Both readings, as they would be written.
fn choice(number: i32, write: impl Fn(i32) -> String) -> String {
    match number.checked_mul(1000) {
        Some(s) => format!("`{}`, as it is read now, or `{}`", write(number), write(s)),
        None => format!("`{}`", write(number)),
    }
}
