//! `block-rule`: EXIT, RUN, RESTART, ENTASK or HALT acts on a block of the wrong kind.
//!
//! EXIT ends the program that contains it, but not `Main`, and not a task. RUN and RESTART start
//! programs, ENTASK starts tasks; none of these instructions may name `Main`. The rule
//! `built-in-task` covers built-in tasks, `subroutine-rule` subroutines.
//!
//! Passes:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["RUN Drain"] },
//!   { when = ["X1"], do = ["ENTASK Report"] },
//! ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["ENTASK Drain"] },
//!   { when = ["X1"], do = ["RUN Report"] },
//! ]
//! ```

use crate::resolve::program::{Block, BlockKind};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, Help, advise, possible, proposed};
pub use rungd_engine::isa::{Mnemonic, OperandRole};

use super::context::{Context, ProgramInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut push = |placed: &ProgramInstruction, (message, label, help): BlockWords| {
        let finding = Finding::new(Code::BlockRule, placed.instruction.span, message);
        findings.push(finding.label(label).help(help));
    };
    for placed in context.instructions() {
        let wrong = match placed.instruction.target_block() {
            None if placed.mnemonic() == Mnemonic::Exit => exit(placed.place.block),
            None => None,
            Some(block) => start_or_stop(placed, context.program.block(block.value)),
        };
        if let Some(words) = wrong {
            push(placed, words);
        }
    }
}

type BlockWords = (String, &'static str, Help);

fn exit(block: &Block) -> Option<BlockWords> {
    let name = &block.name;
    if block.is_main() {
        let help = stop().and("\nput rungs that end by themselves into a program that `Main` RUNs");
        let message = "`EXIT` in `Main`, which always runs".to_owned();
        return Some((message, "`Main` never ends", help));
    }
    let help = match block.kind {
        BlockKind::Task => format!("delete it, or end the task at once with `HALT {name}`").into(),
        BlockKind::Program | BlockKind::Subroutine => return None,
        BlockKind::FirstScan
        | BlockKind::TopOfScan
        | BlockKind::BottomOfScan
        | BlockKind::LastScan => {
            Help::from("delete it; a rung that must not execute gets a contact for it")
        }
    };
    let help = help.with(FixEdit::Delete);
    let message = format!("`EXIT` in task `{name}`: a task ends when its rungs have executed");
    Some((message, "EXIT ends programs only", help))
}

fn start_or_stop(placed: &ProgramInstruction, block: &Block) -> Option<BlockWords> {
    if block.kind.is_built_in() {
        return None;
    }
    let (name, instruction) = (&block.name, placed.name());
    if block.is_main() {
        return Some((
            format!("`{instruction}` of `Main`, which always runs"),
            "`Main` is not started or stopped",
            main_help(placed),
        ));
    }
    let role = placed.instruction.acting_role();
    if role == Some(OperandRole::Starts) && block.kind == BlockKind::Task {
        let ways = [format!("ENTASK {name}"), format!("ENTASK {name} every=1s")].map(possible);
        let help = advise("to run it once: `{}`; at an interval: `{}`", ways);
        let message = format!("`{instruction}` starts programs, and `{name}` is a task");
        return Some((message, "a task", help));
    }
    if role == Some(OperandRole::Enables) && block.kind == BlockKind::Program {
        let message = format!("`ENTASK` starts tasks, and `{name}` is a program");
        let help = advise("`{}`", [proposed(format!("RUN {name}"))]);
        return Some((message, "a program", help));
    }
    None
}

fn main_help(placed: &ProgramInstruction) -> Help {
    if placed.instruction.acting_role() == Some(OperandRole::Stops) {
        return stop();
    }
    if placed.mnemonic() == Mnemonic::Restart {
        return "put the rungs that must start again into a program of their own, and `RESTART` \
                that program"
            .into();
    }
    Help::from("delete it: `Main` runs from the first scan on").with(FixEdit::Delete)
}

fn stop() -> Help {
    advise("to stop the controller in an orderly way: `{}`", [possible("STOP")])
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn exit_is_reported_in_blocks_that_do_not_permit_it() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["RUN Drain", "ENTASK Report", "EXIT"] } ]

            [[program]]
            name = "Drain"
            rung = [ { when = ["X1"], do = ["EXIT"] } ]

            [[task]]
            name = "Report"
            rung = [ { when = ["X1"], do = ["EXIT"] } ]

            [[task]]
            name = "TopOfScan"
            rung = [ { when = ["X1"], do = ["EXIT"] } ]
            "#,
            expect![[r#"
                3:64 block-rule
                  `EXIT` in `Main`, which always runs
                    to stop the controller in an orderly way: `STOP`
                    put rungs that end by themselves into a program that `Main` RUNs
                11:34 block-rule
                  `EXIT` in task `Report`: a task ends when its rungs have executed
                    delete it, or end the task at once with `HALT Report`
                15:34 block-rule
                  `EXIT` in task `TopOfScan`: a task ends when its rungs have executed
                    delete it; a rung that must not execute gets a contact for it
            "#]],
        );
    }

    #[test]
    fn instructions_that_start_or_stop_the_wrong_kind_of_block_are_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["RUN Main", "RESTART Main", "HALT Main"] },
              { when = ["X0"], do = ["RUN Drain", "RESTART Drain", "HALT Drain", "ENTASK Drain"] },
              { when = ["X0"], do = ["RUN Report", "RESTART Report"] },
              { when = ["X0"], do = ["HALT Report", "ENTASK Report"] },
            ]

            [[program]]
            name = "Drain"
            rung = [ { when = ["X1"], do = ["HALT Drain"] } ]

            [[task]]
            name = "Report"
            rung = [ { when = ["X1"], do = ["HALT Report"] } ]
            "#,
            expect![[r#"
                4:25 block-rule
                  `RUN` of `Main`, which always runs
                    delete it: `Main` runs from the first scan on
                4:37 block-rule
                  `RESTART` of `Main`, which always runs
                    put the rungs that must start again into a program of their own, and
                    `RESTART` that program
                4:53 block-rule
                  `HALT` of `Main`, which always runs
                    to stop the controller in an orderly way: `STOP`
                5:69 block-rule
                  `ENTASK` starts tasks, and `Drain` is a program
                    `RUN Drain`
                6:25 block-rule
                  `RUN` starts programs, and `Report` is a task
                    to run it once: `ENTASK Report`; at an interval: `ENTASK Report
                    every=1s`
                6:39 block-rule
                  `RESTART` starts programs, and `Report` is a task
                    to run it once: `ENTASK Report`; at an interval: `ENTASK Report
                    every=1s`
            "#]],
        );
    }
}
