//! `task-starts-itself`: a task contains the ENTASK that names it.
//!
//! The ENTASK executes only while the task is already running. Then a run-once ENTASK has no
//! effect, and a recurrent ENTASK ends with the task that it should enable.
//!
//! Passes:
//!
//! ```toml
//! [[program]]
//! name = "Main"
//! rung = [ { when = ["X0"], do = ["ENTASK Report"] } ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! [[task]]
//! name = "Report"
//! rung = [ { when = ["X0"], do = ["ENTASK Report"] } ]
//! ```

use crate::source::finding::{Code, Finding};
use rungd_engine::isa::OperandRole;

use super::context::{Context, ProgramInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for placed in context.instructions() {
        let enabled = placed.instruction.operand_with(OperandRole::Enables).map(|task| task.value);
        if enabled == Some(placed.place.block.id) {
            findings.push(finding(placed));
        }
    }
}

fn finding(entask: &ProgramInstruction) -> Finding {
    let task = &entask.place.block.name;
    let effect = if entask.instruction.is_recurrent() {
        "it can only be enabled while it runs"
    } else {
        "`ENTASK` of a task that runs has no effect"
    };
    Finding::new(
        Code::TaskStartsItself,
        entask.instruction.span,
        format!("task `{task}` starts itself: {effect}"),
    )
    .label("in the task itself")
    .help(format!("to run it again and again, in `Main`: `ENTASK {task} every=1s`"))
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn tasks_that_enable_themselves_are_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["ENTASK A"] } ]

            [[task]]
            name = "A"
            rung = [ { when = ["X1"], do = ["ENTASK A"] } ]

            [[task]]
            name = "B"
            rung = [ { when = ["X1"], do = ["ENTASK B every=1s"] } ]
            "#,
            expect![[r#"
                7:34 task-starts-itself
                  task `A` starts itself: `ENTASK` of a task that runs has no effect
                    to run it again and again, in `Main`: `ENTASK A every=1s`
                10:9 block-never-started
                  task `B` is never started: the only ENTASK of it is in its own rungs
                    start it in a block that runs: `ENTASK B`, or `ENTASK B every=1s`
                11:34 task-starts-itself
                  task `B` starts itself: it can only be enabled while it runs
                    to run it again and again, in `Main`: `ENTASK B every=1s`
            "#]],
        );
    }
}
