//! `lost-fraction`: a constant with a fraction is stored in a word of whole numbers.
//!
//! It is legal: the word stores the number truncated towards zero. But an author who writes a
//! fraction wants to keep it, and forgot that the target holds none. Reported if all other numbers
//! are whole, so that the fraction never affects the result: MOVE, FILL and MATH of a constant, ADD
//! and SUB of a constant and a whole number.
//!
//! Passes:
//!
//! ```toml
//! do = ["MOVE 2.5 to=R7"]
//! ```
//!
//! Fails:
//!
//! ```toml
//! do = ["MOVE 2.5 to=D7"]
//! ```

use crate::source::finding::{Code, Finding};
use crate::source::fix::text;
use rungd_engine::isa::Address;

use super::context::{Context, ProgramInstruction};
use super::stored::storing;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    findings.extend(context.instructions().filter_map(|placed| judge(context, placed)));
}

fn judge(context: &Context, placed: &ProgramInstruction) -> Option<Finding> {
    let stored = storing(placed.instruction)?;
    let fraction = stored.fraction?;
    let word = stored.to.first().filter(|word| !word.is_real())?;
    let (low, high) = word.numbers();
    // For a number beyond the word's range, the finding of `constant_saturates` is more precise.
    if stored.range.low > high || stored.range.high < low {
        return None;
    }
    let (said, name) = (context.say(Address::Word(word)), placed.name());
    let whole = fraction.trunc() + 0.0;
    let message = format!("{said} holds whole numbers: `{name}` drops the fraction of {fraction}");
    let help = format!("store it in an R word; if it is meant, write `{whole}`");
    let finding = Finding::new(Code::LostFraction, stored.place, message);
    let whole = text(whole.to_string()).same();
    Some(finding.label("the fraction is never stored").help(help).fix(whole))
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn fractions_stored_in_integer_targets_are_reported() {
        check(
            r#"
            [tags]
            recipe = { at = "D100", count = 5 }
            half = { value = 0.5 }

            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["MOVE 2.5 to=D7", "MOVE 2.0 to=D7", "MOVE 2.5 to=R7"] },
              { when = ["X0"], do = ["ADD D1 1.5 to=D2", "SUB 1.5 R1 to=D3", "SUB 1.5 1 to=D3"] },
              { when = ["X0"], do = ["FILL 1.5 to=D0..D3", "FILL half to=recipe"] },
              { when = ["X0"], do = ["FILL 1.5 to=R0..R3", "FILL 2 to=D0..D3"] },
              { when = ["X0"], do = ["MOVE -1.5 to=recipe[D50]", "MATH D4 = -2.5"] },
              { when = ["X0"], do = ["MATH D5 = D6 * 2.5", "MATH recipe[D50] = 1.5"] },
              { when = ["X0"], do = ["MATH R5 = 2.5", "MATH C0 = 0.5", "MOVE 70000.5 to=V9"] },
            ]
            "#,
            expect![[r#"
                8:30 lost-fraction
                  `D7` holds whole numbers: `MOVE` drops the fraction of 2.5
                    store it in an R word; if it is meant, write `2`
                9:32 lost-fraction
                  `D2` holds whole numbers: `ADD` drops the fraction of 1.5
                    store it in an R word; if it is meant, write `1`
                9:73 lost-fraction
                  `D3` holds whole numbers: `SUB` drops the fraction of 1.5
                    store it in an R word; if it is meant, write `1`
                10:30 lost-fraction
                  `D0` holds whole numbers: `FILL` drops the fraction of 1.5
                    store it in an R word; if it is meant, write `1`
                10:52 lost-fraction
                  `recipe[0]` (D100) holds whole numbers: `FILL` drops the fraction of 0.5
                    store it in an R word; if it is meant, write `0`
                12:30 lost-fraction
                  `recipe[0]` (D100) holds whole numbers: `MOVE` drops the fraction of
                  -1.5
                    store it in an R word; if it is meant, write `-1`
                12:58 lost-fraction
                  `D4` holds whole numbers: `MATH` drops the fraction of -2.5
                    store it in an R word; if it is meant, write `-2`
                13:52 lost-fraction
                  `recipe[0]` (D100) holds whole numbers: `MATH` drops the fraction of 1.5
                    store it in an R word; if it is meant, write `1`
                14:64 constant-saturates
                  `V9` holds 0 to 65535: `MOVE` stores 65535
                    a D word holds more; if it is meant, write `MOVE 65535 to=V9`
            "#]],
        );
    }
}
