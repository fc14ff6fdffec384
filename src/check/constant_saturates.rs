//! `constant-saturates`: MOVE, ADD or SUB with a constant so large or small that the result never
//! fits the target.
//!
//! It is legal: a larger result becomes the target's largest number, a smaller one its smallest. A
//! tag's `min` and `max` narrow the range of its address. The author mostly has a different range
//! in mind. Only certain cases are reported: a sum passes if its other operand can bring it into
//! the range.
//!
//! Passes:
//!
//! ```toml
//! do = ["MOVE 70000 to=D0"]
//! ```
//!
//! Fails:
//!
//! ```toml
//! do = ["MOVE 70000 to=V0"]
//! ```

use crate::isa::{Address, Word};
use crate::resolve::instruction::{Source, WordPlace};
use crate::resolve::program::{Action, Value};
use crate::source::finding::{Code, Finding};

use super::context::{Context, Placed};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    findings.extend(context.instructions.iter().filter_map(|placed| judge(context, placed)));
}

fn judge(context: &Context, placed: &Placed) -> Option<Finding> {
    let Action::Store { source, to } = placed.action() else { return None };
    let WordPlace::Word(word) = to.value else { return None };
    // With two locations, no constant is at fault.
    let is_constant = |value| matches!(value, Value::Const(..) | Value::Real(_));
    let place = source.values().filter(|of| is_constant(of.value)).last()?.span;
    let (low, high) = match source {
        Source::Value(a) => range(a.value),
        Source::Sum(a, b) => {
            let ((a_low, a_high), (b_low, b_high)) = (range(a.value), range(b.value));
            (a_low + b_low, a_high + b_high)
        }
        Source::Difference(a, b) => {
            let ((a_low, a_high), (b_low, b_high)) = (range(a.value), range(b.value));
            (a_low - b_high, a_high - b_low)
        }
    };
    let limits = context.limits(word);
    let stored = if low > word.number(limits.max) {
        limits.max
    } else if high < word.number(limits.min) {
        limits.min
    } else {
        return None;
    };
    let [stored, least, most] = [stored, limits.min, limits.max].map(|cell| word.text(cell));
    let said = context.say(Address::Word(word));
    let name = context.name(Address::Word(word));
    let message = format!("{said} holds {least} to {most}: `{}` stores {stored}", placed.name());
    let finding = Finding::new(Code::ConstantSaturates, place, message).label("never stored whole");
    let meant = format!("if it is meant, write `MOVE {stored} to={name}`");
    let of_tag = limits.of_tag.filter(|_| word.range() != (limits.min, limits.max));
    Some(match of_tag {
        Some(tag) => finding
            .related(tag.span, "`min` and `max` are given here")
            .help(format!("give tag `{}` other limits; {meant}", tag.name)),
        None => finding.help(format!("a D word holds more; {meant}")),
    })
}

/// The least and greatest number of a value. Integers of 32 bits, and their sums, are exact here.
fn range(value: Value) -> (f64, f64) {
    match value {
        Value::Const(n, _) => (n.into(), n.into()),
        Value::Real(real) => (real.into(), real.into()),
        Value::Word(word) => word.numbers(),
        Value::Element(element) => element.array.first_word().map_or((0.0, 0.0), Word::numbers),
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::{check, check_main};

    #[test]
    fn the_limits_of_any_tag_of_the_address_count() {
        check(
            r#"
            [tags]
            size = { at = "D0", min = 1, max = 10 }
            also = { at = "D1" }
            more = { at = "D1", max = 5 }

            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["MOVE 10 to=size", "MOVE 50 to=size", "SUB 1 1 to=D0"] },
              { when = ["X0"], do = ["ADD size 1 to=size", "MOVE 6 to=also", "MOVE 5 to=more"] },
            ]
            "#,
            expect![[r#"
                9:49 constant-saturates
                  `size` (D0) holds 1 to 10: `MOVE` stores 10
                    give tag `size` other limits; if it is meant, write `MOVE 10 to=size`
                9:69 constant-saturates
                  `size` (D0) holds 1 to 10: `SUB` stores 1
                    give tag `size` other limits; if it is meant, write `MOVE 1 to=size`
                10:52 constant-saturates
                  `also` (D1) holds -2147483648 to 5: `MOVE` stores 5
                    give tag `more` other limits; if it is meant, write `MOVE 5 to=also`
            "#]],
        );
    }

    #[test]
    fn what_can_never_be_stored() {
        check_main(
            r#"
            { when = ["X0"], do = ["MOVE 65535 to=V0", "MOVE 65536 to=V0", "MOVE -1 to=V0"] },
            { when = ["X0"], do = ["MOVE 70000 to=D0", "ADD V0 1 to=V0", "SUB V0 1 to=V0"] },
            { when = ["X0"], do = ["ADD V0 65536 to=V1", "SUB 0 1 to=V1", "SUB V0 65536 to=V1"] },
            { when = ["X0"], do = ["ADD V0 V1 to=V2", "MOVE V0 to=N0.ACC", "CTU N0 preset=1"] },
            "#,
            expect![[r#"
                4:50 constant-saturates
                  `V0` holds 0 to 65535: `MOVE` stores 65535
                    a D word holds more; if it is meant, write `MOVE 65535 to=V0`
                4:70 constant-saturates
                  `V0` holds 0 to 65535: `MOVE` stores 0
                    a D word holds more; if it is meant, write `MOVE 0 to=V0`
                6:32 constant-saturates
                  `V1` holds 0 to 65535: `ADD` stores 65535
                    a D word holds more; if it is meant, write `MOVE 65535 to=V1`
                6:53 constant-saturates
                  `V1` holds 0 to 65535: `SUB` stores 0
                    a D word holds more; if it is meant, write `MOVE 0 to=V1`
                6:71 constant-saturates
                  `V1` holds 0 to 65535: `SUB` stores 0
                    a D word holds more; if it is meant, write `MOVE 0 to=V1`
            "#]],
        );
    }
}
