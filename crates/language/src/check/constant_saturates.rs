//! `constant-saturates`: MOVE, ADD, SUB or FILL with a constant so large or small that the result
//! never fits the target, or a MATH that consists of such a constant.
//!
//! It is legal: a result above the range becomes the target's largest number, a result below it the
//! smallest. A tag's `min` and `max` narrow the range of its address. Usually the author assumes a
//! different range. A sum is reported only if no value of its other operand brings it into the
//! range.
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

use crate::source::finding::{Code, Finding};
use crate::source::fix::text;
use rungd_engine::isa::{Address, Word};

use super::context::{Context, ProgramInstruction, WriteLimits};
use super::stored::{StoredRange, StoredWords, storing};

/// Maximum number of array elements that are looked at. Each of many thousand instructions may name
/// an array as long as memory; beyond this number, instructions with arrays have no findings.
const ELEMENTS_MAX: usize = 10_000_000;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut room = ELEMENTS_MAX;
    findings.extend(context.instructions().filter_map(|placed| judge(context, placed, &mut room)));
}

fn judge(context: &Context, placed: &ProgramInstruction, room: &mut usize) -> Option<Finding> {
    let storing = storing(placed.instruction)?;
    let word = storing.to.first()?;
    let limits = context.limits(word);
    // For an array, any element may be the target.
    let mut all = storing.to.each().map(|word| limit_of(word, context.limits(word), storing.range));
    let stored = all.next()??;
    *room = room.checked_sub(storing.to.count())?;
    if all.any(|stored| stored.is_none()) {
        return None;
    }
    let [stored, least, most] = [stored, limits.min, limits.max].map(|cell| word.text(cell));
    let said = context.say(Address::Word(word));
    let name = context.name(Address::Word(word));
    let message = format!("{said} holds {least} to {most}: `{}` stores {stored}", placed.name());
    let finding = Finding::new(Code::ConstantSaturates, storing.place, message)
        .label("never stored unchanged");
    let right = match storing.to {
        StoredWords::One(_) => format!("MOVE {stored} to={name}"),
        StoredWords::Of(_) => stored,
    };
    let meant = format!("if it is meant, write `{right}`");
    let of_tag = limits.of_tag.filter(|_| word.range() != (limits.min, limits.max));
    let finding = match of_tag {
        Some(tag) => finding
            .related(tag.span, "`min` and `max` are given here")
            .help(format!("give tag `{}` other limits; {meant}", tag.name)),
        None if word.range() == (i32::MIN, i32::MAX) => {
            finding.help(format!("an R word holds more; {meant}"))
        }
        None => finding.help(format!("a D word holds more; {meant}")),
    };
    let right = text(right).same();
    Some(finding.fix(match storing.to {
        StoredWords::One(_) => right.at(placed.instruction.span),
        StoredWords::Of(_) => right,
    }))
}

/// The limit that a word stores instead of the numbers of a range; `None` if one of them may fit.
fn limit_of(word: Word, limits: WriteLimits, range: StoredRange) -> Option<i32> {
    let StoredRange { low, high } = range;
    // A word of whole numbers stores a number without its fraction.
    let whole = |number: f64| if word.is_real() { number } else { number.trunc() };
    if whole(low) > word.number(limits.max) {
        return Some(limits.max);
    }
    (whole(high) < word.number(limits.min)).then_some(limits.min)
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::{check, check_main};

    #[test]
    fn the_limits_of_every_tag_of_an_address_apply() {
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
    fn array_limits_and_constant_expressions_are_checked() {
        check(
            r#"
            [tags]
            recipe = { at = "D100", count = 5, max = 10 }
            step = { at = "V50" }

            [[program]]
            name = "Main"
            rung = [
              { when = ["$On"], do = ["FILL 99999 to=V0..V3", "FILL 9 to=recipe"] },
              { when = ["$On"], do = ["FILL 11 to=recipe", "FILL 11 to=D99..D103"] },
              { when = ["$On"], do = ["FILL V9 to=V0..V3", "FILL 1 to=C0..C3"] },
              { when = ["X0"], do = ["MOVE -1 to=step", "MOVE 11 to=recipe[step]"] },
              { when = ["X0"], do = ["MATH V0 = -5", "MATH D0 = 4000000000.0", "MATH D1 = -4e9"] },
              { when = ["X0"], do = ["MATH V0 = -0.5 - 1.0", "MATH R0 = 4e9", "MATH C0 = 70000"] },
              { when = ["X0"], do = ["MATH recipe[step] = 11", "MATH V1 = 0xFFFFFFFF"] },
              { when = ["X0"], do = ["MOVE 3e9 to=D3"] },
            ]
            "#,
            expect![[r#"
                8:31 constant-saturates
                  `V0` holds 0 to 65535: `FILL` stores 65535
                    a D word holds more; if it is meant, write `65535`
                9:31 constant-saturates
                  `recipe[0]` (D100) holds -2147483648 to 10: `FILL` stores 10
                    give tag `recipe[0]` other limits; if it is meant, write `10`
                11:30 constant-saturates
                  `step` (V50) holds 0 to 65535: `MOVE` stores 0
                    a D word holds more; if it is meant, write `MOVE 0 to=step`
                11:49 constant-saturates
                  `recipe[0]` (D100) holds -2147483648 to 10: `MOVE` stores 10
                    give tag `recipe[0]` other limits; if it is meant, write `10`
                12:30 constant-saturates
                  `V0` holds 0 to 65535: `MATH` stores 0
                    a D word holds more; if it is meant, write `MOVE 0 to=V0`
                12:46 constant-saturates
                  `D0` holds -2147483648 to 2147483647: `MATH` stores 2147483647
                    an R word holds more; if it is meant, write `MOVE 2147483647 to=D0`
                12:72 constant-saturates
                  `D1` holds -2147483648 to 2147483647: `MATH` stores -2147483648
                    an R word holds more; if it is meant, write `MOVE -2147483648 to=D1`
                14:30 constant-saturates
                  `recipe[0]` (D100) holds -2147483648 to 10: `MATH` stores 10
                    give tag `recipe[0]` other limits; if it is meant, write `10`
                14:56 constant-saturates
                  `V1` holds 0 to 65535: `MATH` stores 0
                    a D word holds more; if it is meant, write `MOVE 0 to=V1`
                15:30 constant-saturates
                  `D3` holds -2147483648 to 2147483647: `MOVE` stores 2147483647
                    an R word holds more; if it is meant, write `MOVE 2147483647 to=D3`
            "#]],
        );
    }

    #[test]
    fn constants_that_the_target_can_never_hold_are_reported() {
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
