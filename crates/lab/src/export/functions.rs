//! Calls of the functions of IEC 61131-3, and arithmetic that stays at the limits of a DINT, made
//! of them.
//!
//! No step of a saturating sum is beyond 32 bits: a side is limited before the other one is added.
//! Used by `instructions` and `library`.

use std::cmp::Ordering;

use super::literals::CallLiteral;
use super::project::{BlockCall, CallInput, CallSource, NetworkPower};

/// The largest DINT.
const MAX: i64 = i32::MAX as i64;
/// The least DINT.
const MIN: i64 = i32::MIN as i64;

/// A variable.
pub(super) fn variable(name: &str) -> CallSource {
    CallSource::Variable(name.to_owned())
}

/// A whole number.
pub(super) fn number(value: i64) -> CallSource {
    CallSource::Literal(CallLiteral::Whole(value))
}

/// A function of two values.
pub(super) fn of_two(name: &str, left: CallSource, right: CallSource) -> CallSource {
    CallSource::Call(call_of_two(name, left, right))
}

/// A call of a function of two values.
pub(super) fn call_of_two(name: &str, left: CallSource, right: CallSource) -> BlockCall {
    BlockCall::function(
        name,
        vec![CallInput { pin: "IN1", source: left }, CallInput { pin: "IN2", source: right }],
    )
}

/// The call whose result `OUT` is a value, while the power is ON.
pub(super) fn stored(source: CallSource, power: NetworkPower) -> BlockCall {
    let is_always = power == NetworkPower::Constant(true);
    match source {
        CallSource::Call(call) if is_always => call,
        source @ (CallSource::Call(_)
        | CallSource::Variable(_)
        | CallSource::Literal(_)
        | CallSource::Power(_)) => {
            let enable = CallInput { pin: "EN", source: CallSource::Power(power) };
            let enable = (!is_always).then_some(enable);
            let inputs = enable.into_iter().chain([CallInput { pin: "IN", source }]);
            BlockCall::function("MOVE", inputs.collect())
        }
    }
}

/// The second value while the power is ON, else the first.
pub(super) fn select(power: NetworkPower, off: CallSource, on: CallSource) -> CallSource {
    CallSource::Call(BlockCall::function(
        "SEL",
        vec![
            CallInput { pin: "G", source: CallSource::Power(power) },
            CallInput { pin: "IN0", source: off },
            CallInput { pin: "IN1", source: on },
        ],
    ))
}

/// A value within limits.
pub(super) fn limited(low: CallSource, value: CallSource, high: CallSource) -> CallSource {
    CallSource::Call(BlockCall::function(
        "LIMIT",
        vec![
            CallInput { pin: "MN", source: low },
            CallInput { pin: "IN", source: value },
            CallInput { pin: "MX", source: high },
        ],
    ))
}

/// Time added to an accumulator; it stays at the limit. The time is not negative.
pub(super) fn time_added(acc: CallSource, time: CallSource) -> CallSource {
    let most = of_two("SUB", number(MAX), time.clone());
    of_two("ADD", of_two("MIN", acc, most), time)
}

/// Time subtracted from an accumulator, down to 0 and no further. The time is not negative.
pub(super) fn time_taken(acc: CallSource, time: CallSource) -> CallSource {
    of_two("SUB", of_two("MAX", acc, time.clone()), time)
}

/// A value, or 0 if it is less.
pub(super) fn at_least_zero(value: CallSource) -> CallSource {
    match literal(&value) {
        Some(value) => number(value.max(0)),
        None => of_two("MAX", value, number(0)),
    }
}

/// The result of a compare, if both sides are constants.
pub(super) fn compared(name: &str, left: &CallSource, right: &CallSource) -> Option<bool> {
    let (CallSource::Literal(left), CallSource::Literal(right)) = (left, right) else {
        return None;
    };
    let order = match (*left, *right) {
        (CallLiteral::Whole(left), CallLiteral::Whole(right)) => Some(left.cmp(&right)),
        (left, right) => left.number()?.partial_cmp(&right.number()?),
    };
    Some(match name {
        "NE" => order != Some(Ordering::Equal),
        "EQ" => order == Some(Ordering::Equal),
        "LT" => order.is_some_and(Ordering::is_lt),
        "LE" => order.is_some_and(Ordering::is_le),
        "GT" => order.is_some_and(Ordering::is_gt),
        _ => order.is_some_and(Ordering::is_ge),
    })
}

/// The number of a literal.
pub(super) fn literal(source: &CallSource) -> Option<i64> {
    match source {
        CallSource::Literal(
            CallLiteral::Whole(number) | CallLiteral::TypedWhole { number, .. },
        ) => Some(*number),
        CallSource::Literal(_)
        | CallSource::Variable(_)
        | CallSource::Power(_)
        | CallSource::Call(_) => None,
    }
}

/// A sum that stays at the limits of a DINT.
pub(super) fn sum(left: CallSource, right: CallSource) -> CallSource {
    match (literal(&left), literal(&right)) {
        (Some(left), Some(right)) => number((left + right).clamp(MIN, MAX)),
        (_, Some(0)) => left,
        (_, Some(step)) if step > 0 => {
            of_two("ADD", of_two("MIN", left, number(MAX - step)), right)
        }
        (_, Some(step)) => of_two("ADD", of_two("MAX", left, number(MIN - step)), right),
        (Some(_), None) => sum(right, left),
        (None, None) => {
            let high = of_two("SUB", number(MAX), of_two("MAX", right.clone(), number(0)));
            let low = of_two("SUB", number(MIN), of_two("MIN", right.clone(), number(0)));
            of_two("ADD", of_two("MAX", of_two("MIN", left, high), low), right)
        }
    }
}

/// A difference that stays at the limits of a DINT.
pub(super) fn difference(left: CallSource, right: CallSource) -> CallSource {
    match (literal(&left), literal(&right)) {
        (Some(left), Some(right)) => number((left - right).clamp(MIN, MAX)),
        (_, Some(0)) => left,
        (_, Some(step)) if step > 0 => {
            of_two("SUB", of_two("MAX", left, number(MIN + step)), right)
        }
        (_, Some(step)) => of_two("SUB", of_two("MIN", left, number(MAX + step)), right),
        (Some(from), None) if from >= 0 => {
            of_two("SUB", left, of_two("MAX", right, number(from - MAX)))
        }
        (Some(from), None) => of_two("SUB", left, of_two("MIN", right, number(from - MIN))),
        (None, None) => {
            let low = of_two("ADD", number(MIN), of_two("MAX", right.clone(), number(0)));
            let high = of_two("ADD", number(MAX), of_two("MIN", right.clone(), number(0)));
            of_two("SUB", of_two("MAX", of_two("MIN", left, high), low), right)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_constants_are_compared_in_all_their_digits() {
        let [more, less] = [9_007_199_254_740_993, 9_007_199_254_740_992].map(number);
        for (name, wanted) in
            [("EQ", false), ("NE", true), ("LT", false), ("LE", false), ("GT", true), ("GE", true)]
        {
            assert_eq!(compared(name, &more, &less), Some(wanted), "{name}");
        }
        assert_eq!(compared("EQ", &more, &more), Some(true));
        let real = CallSource::Literal(CallLiteral::LongReal(0.5));
        assert_eq!(compared("LT", &real, &number(1)), Some(true));
    }
}
