//! `reset-never-set`: a bit is RST, and nothing turns it ON.
//!
//! Every other instruction that writes a bit can turn it ON. Bits that something outside the ladder
//! may write are not reported (`writers`).
//!
//! Passes:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["SET C0"] },
//!   { when = ["X1"], do = ["RST C0"] },
//! ]
//! ```
//!
//! Fails: the second rung alone.

use std::cell::LazyCell;
use std::collections::HashSet;

use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, possible};
use rungd_engine::isa::{Address, OperandRole};

use super::context::{Context, WriteEffect};
use super::usage::{whole_writes, writes};
use super::writers::is_writable;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let writes = writes(context);
    // Needed for bits of words alone.
    let whole = LazyCell::new(|| whole_writes(context));
    let mut seen = HashSet::new();
    for placed in context.instructions() {
        let Some(bit) = placed.instruction.operand_with(OperandRole::TurnsOff) else { continue };
        let address = Address::Bit(bit.value);
        let word = address.without_bit();
        let is_set = writes.get(&address) == Some(&WriteEffect::Any)
            || (word != address && whole.contains(&word));
        // One finding for each bit is enough, at the first RST.
        if is_set || is_writable(context, address) || !seen.insert(address) {
            continue;
        }
        let message = format!("{} is RST, and nothing ever turns it ON", context.say(address));
        let help = format!(
            "`SET {}` in a rung with its condition; or take the RST out",
            context.name(address)
        );
        let finding = Finding::new(Code::ResetNeverSet, bit.span, message);
        findings.push(finding.label("always OFF").help(help).fix(possible(FixEdit::Delete)));
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::{check, check_main};

    #[test]
    fn bits_that_no_instruction_turns_on_are_reported() {
        check_main(
            r#"
            { when = ["X0"], do = ["RST C0", "RST C1", "RST C2", "RST C3"] },
            { when = ["X0"], do = ["RST C4", "RST MC1", "RST Y0", "RST C5"] },
            { when = ["X1"], do = ["SET C0", "PONOFF C1", "OUT C2"] },
            { when = ["X2"], do = ["ONDTMR T0 preset=1s output=C3", "RST C4"] },
            { when = ["X2"], do = ["MATH C5 = $On"] },
            "#,
            expect![[r#"
                5:29 reset-never-set
                  `C4` is RST, and nothing ever turns it ON
                    `SET C4` in a rung with its condition; or take the RST out
                5:50 reset-never-set
                  `Y0` is RST, and nothing ever turns it ON
                    `SET Y0` in a rung with its condition; or take the RST out
            "#]],
        );
    }

    #[test]
    fn bits_that_an_acknowledgement_turns_on_are_not_reported() {
        check(
            r#"
            [tags]
            jam  = { at = "C0", alarm = "Jammed", ack = "quit" }
            quit = { type = "bit" }

            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["OUT jam"] }, { when = ["quit"], do = ["RST quit"] } ]
            "#,
            expect![[""]],
        );
    }

    #[test]
    fn bits_that_an_initial_value_or_a_device_turns_on_are_not_reported() {
        check(
            r#"
            [tags]
            meant = { at = "C0", initial = true }

            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["RST meant", "RST C1"] },
            ]
            "#,
            expect![[r#"
                7:42 reset-never-set
                  `C1` is RST, and nothing ever turns it ON
                    `SET C1` in a rung with its condition; or take the RST out
            "#]],
        );
    }
}
