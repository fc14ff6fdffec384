//! `jump-outside-stage`: JMP or SGDIVRG outside a stage. They leave the stage that contains them.
//!
//! Passes: SGSET anywhere in the program.
//!
//! ```toml
//! [[program.stage]]
//! name = "Open"
//! rung = [ { when = ["X0"], do = ["JMP Close"] } ]
//! ```
//!
//! Fails: in the program's own rungs.
//!
//! ```toml
//! [[program]]
//! name = "Gate"
//! rung = [ { when = ["X0"], do = ["JMP Close"] } ]
//! ```

use crate::source::finding::{Code, Finding};
use crate::source::fix::{advise, pair};
use rungd_engine::isa::OperandRole;

use super::context::{Context, ProgramInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let all = context.instructions();
    let jumps = all.filter(|p| is_jump(p));
    findings.extend(jumps.filter(|p| p.place.stage.is_none()).map(|p| finding(context, p)));
}

/// Whether an instruction leaves its own Stage for others.
pub fn is_jump(placed: &ProgramInstruction) -> bool {
    placed.instruction.acting_role() == Some(OperandRole::Enters)
}

fn finding(context: &Context, jump: &ProgramInstruction) -> Finding {
    let block = jump.place.block;
    let message = format!(
        "`{}` leaves the stage of its rung, and this rung of program `{}` is in no stage",
        jump.name(),
        block.name
    );
    let sets: Vec<String> = jump
        .instruction
        .stages_entered()
        .map(|stage| format!("\"SGSET {}\"", context.program.stage(stage).name))
        .collect();
    Finding::new(Code::JumpOutsideStage, jump.instruction.span, message)
        .label("no stage to leave")
        .help(advise(
            "to turn a stage ON from here: `{}`; SGRST turns the others OFF",
            [pair(format!("do = [{}]", sets.join(", "))).possible()],
        ))
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn jumps_outside_of_stages_are_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["RUN Day"] } ]

            [[program]]
            name = "Day"
            rung = [
              { when = ["X1"], do = ["JMP B"] },
              { when = ["X2"], do = ["SGDIVRG A B", "SGSET A", "SGCONVRG A to=B"] },
            ]

            [[program.stage]]
            name = "A"
            rung = [ { when = ["X3"], do = ["SGDIVRG B"] } ]

            [[program.stage]]
            name = "B"
            rung = [ { when = ["X4"], do = ["JMP A"] } ]
            "#,
            expect![[r#"
                8:25 jump-outside-stage
                  `JMP` leaves the stage of its rung, and this rung of program `Day` is in
                  no stage
                    to turn a stage ON from here: `do = ["SGSET B"]`; SGRST turns the others
                    OFF
                9:25 jump-outside-stage
                  `SGDIVRG` leaves the stage of its rung, and this rung of program `Day`
                  is in no stage
                    to turn a stage ON from here: `do = ["SGSET A", "SGSET B"]`; SGRST turns
                    the others OFF
            "#]],
        );
    }
}
