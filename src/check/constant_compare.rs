//! `constant-compare`: a compare that gives the same in every scan.
//!
//! Two constants, a location with itself, or a constant at or beyond the limits of what the
//! location can hold. The limits are those of the memory (V 0..65535, D the whole of i32), not a
//! tag's `min` and `max`: to guard against a value that should not come is no mistake.
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
    for contact in &context.compares {
        let Contact::Compare(left, comparison, right, span) = contact else { continue };
        let Some((always, why)) = judge(context, *left, *comparison, *right) else { continue };
        let (word, bit) = if always { ("true", "$On") } else { ("false", "$Off") };
        let message = format!("`{}` is always {word}: {why}", context.contact(contact));
        findings.push(
            Finding::new(Code::ConstantCompare, *span, message)
                .label(format!("always {word}"))
                .help(format!("compare with a value within the limits; if it is meant, `{bit}`")),
        );
    }
}

/// What the compare always gives, and why.
fn judge(
    context: &Context,
    left: Value,
    comparison: Comparison,
    right: Value,
) -> Option<(bool, String)> {
    match (left, right) {
        (Value::Const(a, _), Value::Const(b, _)) => {
            Some((holds(a, comparison, b), "both sides are constants".to_owned()))
        }
        (Value::Word(a), Value::Word(b)) if a == b => {
            Some((holds(0, comparison, 0), "both sides are the same location".to_owned()))
        }
        (Value::Word(word), Value::Const(constant, _)) => {
            judge_range(context, word, comparison, constant)
        }
        (Value::Const(constant, _), Value::Word(word)) => {
            judge_range(context, word, mirrored(comparison), constant)
        }
        (Value::Word(_), Value::Word(_)) => None,
    }
}

fn judge_range(
    context: &Context,
    word: Word,
    comparison: Comparison,
    constant: i32,
) -> Option<(bool, String)> {
    let (low, high) = word.range();
    let inside = (low..=high).contains(&constant);
    let always = match comparison {
        Comparison::Eq | Comparison::Ne if inside => None,
        Comparison::Eq => Some(false),
        Comparison::Ne => Some(true),
        // An order is constant if it holds at both ends alike.
        _ => {
            let at_low = holds(low, comparison, constant);
            (at_low == holds(high, comparison, constant)).then_some(at_low)
        }
    }?;
    let said = context.say(Address::Word(word));
    Some((always, format!("{said} holds {low} to {high}")))
}

fn holds(a: i32, comparison: Comparison, b: i32) -> bool {
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
        same => same,
    }
}
