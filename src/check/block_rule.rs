//! `block-rule`: which block may end itself, and which may be started and stopped how.
//!
//! EXIT ends the program it stands in, never `Main` or a task; RUN and RESTART start programs,
//! ENTASK starts tasks, and nothing of this names `Main`. Built-in tasks are `built-in-task`.
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

use crate::isa::Mnemonic;
use crate::resolve::program::{Block, BlockKind};
use crate::source::finding::{Code, Finding};

use super::context::{Context, Placed, is_built_in, is_main};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut push = |placed: &Placed, (message, label, help): (String, &str, String)| {
        let finding = Finding::new(Code::BlockRule, placed.instruction.span, message);
        findings.push(finding.label(label).help(help));
    };
    for placed in &context.instructions {
        let target = placed.target_block().map(|(id, _)| context.program.block(id));
        let wrong = match (placed.mnemonic(), target) {
            (Mnemonic::Exit, _) => exit(placed.place.block),
            (mnemonic, Some(block)) => start_or_stop(mnemonic, block),
            _ => None,
        };
        if let Some(words) = wrong {
            push(placed, words);
        }
    }
}

type Words = (String, &'static str, String);

fn exit(block: &Block) -> Option<Words> {
    let name = &block.name;
    if is_main(block) {
        let help = "to stop the controller in an orderly way: `STOP`\n\
                    what is to end by itself goes into a program of its own, and `Main` RUNs it";
        let message = "`EXIT` in `Main`, which always runs".to_owned();
        return Some((message, "`Main` never ends", help.to_owned()));
    }
    if block.kind == BlockKind::Program {
        return None;
    }
    let help = match block.kind {
        BlockKind::Task => format!("delete it, or end the task at once with `HALT {name}`"),
        _ => "delete it; a rung that must not execute gets a contact for it".to_owned(),
    };
    let message = format!("`EXIT` in task `{name}`: a task ends when its rungs have executed");
    Some((message, "EXIT ends programs only", help))
}

fn start_or_stop(mnemonic: Mnemonic, block: &Block) -> Option<Words> {
    if is_built_in(block.kind) {
        return None;
    }
    let name = &block.name;
    let instruction = mnemonic.spec().name;
    match (mnemonic, block.kind) {
        (_, BlockKind::Program) if is_main(block) => Some((
            format!("`{instruction}` of `Main`, which always runs"),
            "`Main` is not started or stopped",
            main_help(mnemonic).to_owned(),
        )),
        (Mnemonic::Run | Mnemonic::Restart, BlockKind::Task) => Some((
            format!("`{instruction}` starts programs, and `{name}` is a task"),
            "a task",
            format!("to run it once: `ENTASK {name}`; at an interval: `ENTASK {name} every=1s`"),
        )),
        (Mnemonic::Entask, BlockKind::Program) => Some((
            format!("`ENTASK` starts tasks, and `{name}` is a program"),
            "a program",
            format!("`RUN {name}`"),
        )),
        _ => None,
    }
}

fn main_help(mnemonic: Mnemonic) -> &'static str {
    match mnemonic {
        Mnemonic::Halt => "to stop the controller in an orderly way: `STOP`",
        Mnemonic::Restart => {
            "put what must start anew into a program of its own, and `RESTART` that one"
        }
        _ => "delete it: `Main` runs from the first scan on",
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn exit() {
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
                    what is to end by itself goes into a program of its own, and `Main` RUNs
                    it
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
    fn start_and_stop() {
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
                    put what must start anew into a program of its own, and `RESTART` that
                    one
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
