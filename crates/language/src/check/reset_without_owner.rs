//! `reset-without-owner`: RSTCT, RSTT or RES names a structure that no instruction owns.
//!
//! Passes:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["TMR T0 preset=3s"] },
//!   { when = ["X1"], do = ["RSTT T0"] },
//! ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["TMR T0 preset=3s"] },
//!   { when = ["X1"], do = ["RSTT T1"] },
//! ]
//! ```

use crate::source::finding::{Code, Finding};
use rungd_engine::isa::{OperandRole, Structure};

use super::context::{Context, ProgramInstruction};
use super::names::{list, owner_of};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for placed in context.instructions() {
        if let Some(structure) = placed.instruction.operand_with(OperandRole::Resets)
            && !context.is_owned(structure.value)
        {
            findings.push(finding(context, placed, structure.value));
        }
    }
}

fn finding(context: &Context, reset: &ProgramInstruction, structure: Structure) -> Finding {
    let said = context.say_structure(structure);
    let message = format!("`{}` resets {said}, which no instruction owns", reset.name());
    let add = owner_of(context, structure);
    let owned = context.owned_like(structure).take(4);
    let owned: Vec<String> = owned.map(|owned| context.say_structure(owned)).collect();
    let help = if owned.is_empty() {
        format!("add the instruction that it resets, such as {add}")
    } else {
        format!(
            "structures with an owner are {}; or add the instruction that it resets, such as {add}",
            list(&owned)
        )
    };
    Finding::new(Code::ResetWithoutOwner, reset.instruction.span, message)
        .label("nothing to reset")
        .help(help)
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check_main;

    #[test]
    fn resets_of_structures_without_an_owner_are_reported() {
        check_main(
            r#"
            { when = ["X0"], do = ["TMR T0 preset=3s"] },
            { when = ["X1"], do = ["RSTT T0", "RSTT T1"] },
            { when = ["X2"], do = ["RSTCT CT3", "RES N5"] },
            "#,
            expect![[r#"
                5:36 reset-without-owner
                  `RSTT` resets `T1`, which no instruction owns
                    structures with an owner are `T0`; or add the instruction that it
                    resets, such as `TMR T1 preset=1s`
                6:25 reset-without-owner
                  `RSTCT` resets `CT3`, which no instruction owns
                    add the instruction that it resets, such as `UDCG CT3`
                6:38 reset-without-owner
                  `RES` resets `N5`, which no instruction owns
                    add the instruction that it resets, such as `CTU N5 preset=1`
            "#]],
        );
    }
}
