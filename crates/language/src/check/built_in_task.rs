//! `built-in-task`: an instruction starts or stops FirstScan, TopOfScan, BottomOfScan or LastScan.
//! Each of these tasks has a fixed time in the scan.
//!
//! Passes:
//!
//! ```toml
//! [[task]]
//! name = "FirstScan"
//! rung = [ { when = ["$On"], do = ["MOVE 12 to=D1"] } ]
//! ```
//!
//! Fails, anywhere:
//!
//! ```toml
//! rung = [ { when = ["X0"], do = ["ENTASK FirstScan"] } ]
//! ```

use crate::resolve::program::BlockKind;
use crate::source::finding::{Code, Finding};
use crate::source::fix::FixEdit;

use super::context::Context;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for placed in context.instructions() {
        let Some(target) = placed.instruction.target_block() else { continue };
        let block = context.program.block(target.value);
        if !block.kind.is_built_in() {
            continue;
        }
        let message = format!(
            "`{}` names `{}`, a built-in task: nothing starts or stops it",
            placed.name(),
            block.name
        );
        findings.push(
            Finding::new(Code::BuiltInTask, target.span, message)
                .label("built in")
                .help(format!("delete this: {}", executes(block.kind)))
                .fix(FixEdit::Delete),
        );
    }
}

fn executes(kind: BlockKind) -> &'static str {
    match kind {
        BlockKind::FirstScan => "`FirstScan` executes in the first scan by itself",
        BlockKind::TopOfScan => "`TopOfScan` executes in every scan, before all programs",
        BlockKind::BottomOfScan => "`BottomOfScan` executes in every scan, after all programs",
        BlockKind::LastScan => "`LastScan` executes in the last scan by itself",
        BlockKind::Program | BlockKind::Task | BlockKind::Subroutine => "it starts by itself",
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::{check, check_main};

    #[test]
    fn starting_or_stopping_a_built_in_task_is_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["ENTASK FirstScan", "HALT BottomOfScan"] },
              { when = ["X0"], do = ["RUN LastScan"] },
            ]

            [[task]]
            name = "FirstScan"
            rung = [ { when = ["$On"], do = ["MOVE 1 to=D0"] } ]

            [[task]]
            name = "BottomOfScan"
            rung = [ { when = ["$On"], do = ["ADD D0 1 to=D0"] } ]

            [[task]]
            name = "LastScan"
            rung = [ { when = ["$On"], do = ["MOVE 0 to=D0"] } ]
            "#,
            expect![[r#"
                4:32 built-in-task
                  `ENTASK` names `FirstScan`, a built-in task: nothing starts or stops it
                    delete this: `FirstScan` executes in the first scan by itself
                4:50 built-in-task
                  `HALT` names `BottomOfScan`, a built-in task: nothing starts or stops it
                    delete this: `BottomOfScan` executes in every scan, after all programs
                5:29 built-in-task
                  `RUN` names `LastScan`, a built-in task: nothing starts or stops it
                    delete this: `LastScan` executes in the last scan by itself
            "#]],
        );
    }

    #[test]
    fn starting_a_built_in_task_absent_from_the_ladder_is_reported() {
        check_main(
            r#"{ when = ["X0"], do = ["ENTASK TopOfScan"] }"#,
            expect![[r#"
            4:32 built-in-task
              `TopOfScan` is a built-in task: nothing starts or stops it
                delete this; a task of your own needs a different name
        "#]],
        );
    }
}
