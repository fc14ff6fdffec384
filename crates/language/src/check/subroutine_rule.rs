//! `subroutine-rule`: an instruction that has nothing to act on where it stands, because of a
//! subroutine.
//!
//! RETURN ends an execution of the subroutine that contains it. EXIT ends programs, and so does not
//! stand in a subroutine. CALL names a subroutine; RUN, RESTART, ENTASK and HALT name none.
//!
//! Passes:
//!
//! ```toml
//! [[subroutine]]
//! name = "Dose"
//! rung = [ { when = ["X0"], do = ["RETURN"] }, { when = ["X1"], do = ["OUT Y0"] } ]
//! ```
//!
//! Fails: the same with `EXIT`.

use crate::resolve::layers::Layers;
use crate::resolve::program::{Block, BlockKind};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, Help, advise, possible, proposed};
use rungd_engine::isa::{Mnemonic, OperandRole};

use super::context::{Context, ProgramInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for placed in context.instructions() {
        let block = placed.place.block;
        let finding = match (placed.mnemonic(), placed.instruction.target_block()) {
            // A template that nothing uses may be one for subroutines.
            (Mnemonic::Return, _) if Layers::is_layered(block.span) => None,
            (Mnemonic::Return, _) if !block.is_subroutine() => Some(returned(placed)),
            (Mnemonic::Exit, _) if block.is_subroutine() => Some(exited(placed)),
            (_, Some(target)) => acts(placed, context.program.block(target.value)),
            (_, None) => None,
        };
        findings.extend(finding);
    }
}

fn finding(placed: &ProgramInstruction, message: String) -> Finding {
    Finding::new(Code::SubroutineRule, placed.instruction.span, message)
}

fn returned(placed: &ProgramInstruction) -> Finding {
    let block = placed.place.block;
    let (kind, name) = (block.kind.word(), &block.name);
    let help = match block.kind {
        BlockKind::Program if !block.is_main() => {
            advise("to end the program: `{}`", [proposed("EXIT")])
        }
        BlockKind::Task => {
            advise("to end the task at once: `{}`", [proposed(format!("HALT {name}"))])
        }
        BlockKind::Program
        | BlockKind::FirstScan
        | BlockKind::TopOfScan
        | BlockKind::BottomOfScan
        | BlockKind::LastScan
        | BlockKind::Subroutine => {
            Help::from("put the rungs that it skips into a `[[subroutine]]`, and CALL that")
                .with(FixEdit::Delete)
        }
    };
    finding(placed, format!("`RETURN` in {kind} `{name}`: it ends executions of subroutines"))
        .label("no subroutine to leave")
        .help(help)
}

fn exited(placed: &ProgramInstruction) -> Finding {
    let name = &placed.place.block.name;
    finding(placed, format!("`EXIT` in subroutine `{name}`: it ends programs"))
        .label("EXIT ends programs only")
        .help(advise(
            "to end this execution: `{}`; to end a program: HALT of that program",
            [proposed("RETURN")],
        ))
}

/// The finding about an instruction that acts on a block.
fn acts(placed: &ProgramInstruction, target: &Block) -> Option<Finding> {
    let (name, kind) = (&target.name, target.kind.word());
    let is_call = placed.instruction.acting_role() == Some(OperandRole::Calls);
    // Other rules have built-in tasks and `Main`.
    if is_call == target.is_subroutine() || target.kind.is_built_in() || target.is_main() {
        return None;
    }
    if is_call {
        let instead = if target.kind == BlockKind::Program { "RUN" } else { "ENTASK" };
        let message = format!("`CALL` executes subroutines, and `{name}` is a {kind}");
        let help = advise("`{}`", [proposed(format!("{instead} {name}"))]);
        return Some(finding(placed, message).label(format!("a {kind}")).help(help));
    }
    let message =
        format!("`{}` of `{name}`, a subroutine: it runs only while a CALL is ON", placed.name());
    let help = if placed.instruction.acting_role() == Some(OperandRole::Stops) {
        Help::from("give the CALL a contact that goes OFF").with(FixEdit::Delete)
    } else {
        advise("to execute it: `{}`", [possible(format!("CALL {name}"))])
    };
    Some(finding(placed, message).label("a subroutine").help(help))
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn instructions_that_do_not_fit_subroutines_are_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["CALL Dose", "RUN Drain", "ENTASK Report"] },
              { when = ["X1"], do = ["RETURN"] },
              { when = ["X2"], do = ["CALL Drain", "CALL Report", "CALL Main"] },
              { when = ["X3"], do = ["RUN Dose", "HALT Dose"] },
            ]

            [[program]]
            name = "Drain"
            rung = [ { when = ["X1"], do = ["RETURN"] } ]

            [[task]]
            name = "Report"
            rung = [ { when = ["X1"], do = ["RETURN"] } ]

            [[subroutine]]
            name = "Dose"
            rung = [ { when = ["X1"], do = ["EXIT"] }, { when = ["X2"], do = ["RETURN"] } ]
            "#,
            expect![[r#"
                5:25 subroutine-rule
                  `RETURN` in program `Main`: it ends executions of subroutines
                    put the rungs that it skips into a `[[subroutine]]`, and CALL that
                6:25 subroutine-rule
                  `CALL` executes subroutines, and `Drain` is a program
                    `RUN Drain`
                6:39 subroutine-rule
                  `CALL` executes subroutines, and `Report` is a task
                    `ENTASK Report`
                6:54 block-rule
                  `CALL` of `Main`, which always runs
                    delete it: `Main` runs from the first scan on
                7:25 subroutine-rule
                  `RUN` of `Dose`, a subroutine: it runs only while a CALL is ON
                    to execute it: `CALL Dose`
                7:37 subroutine-rule
                  `HALT` of `Dose`, a subroutine: it runs only while a CALL is ON
                    give the CALL a contact that goes OFF
                12:34 subroutine-rule
                  `RETURN` in program `Drain`: it ends executions of subroutines
                    to end the program: `EXIT`
                16:34 subroutine-rule
                  `RETURN` in task `Report`: it ends executions of subroutines
                    to end the task at once: `HALT Report`
                20:34 subroutine-rule
                  `EXIT` in subroutine `Dose`: it ends programs
                    to end this execution: `RETURN`; to end a program: HALT of that program
            "#]],
        );
    }

    #[test]
    fn stages_are_not_switched_in_subroutines() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["CALL Dose"] } ]

            [[subroutine]]
            name = "Dose"
            rung = [ { when = ["X1"], do = ["SGSET A"] } ]
            "#,
            expect![[r#"
                7:40 unknown-stage
                  `Dose` has no stage `A`
                    a subroutine has no stages, and switches none: let it set a bit, and
                    jump where the stage is
            "#]],
        );
    }
}
