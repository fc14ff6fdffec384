//! `entask-conflict`: a task with a recurrent ENTASK has a second ENTASK. A task may have either
//! one recurrent ENTASK, or any number of run-once ENTASKs.
//!
//! Passes:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["ENTASK Report"] },
//!   { when = ["X1"], do = ["ENTASK Report"] },
//! ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [
//!   { when = ["$On"], do = ["ENTASK Report every=1m"] },
//!   { when = ["X1"], do = ["ENTASK Report"] },
//! ]
//! ```

use std::collections::BTreeMap;

use crate::source::finding::{Code, Finding};
use rungd_engine::isa::{BlockId, OperandRole};

use super::context::{Context, ProgramInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut enabled: BTreeMap<BlockId, Vec<&ProgramInstruction>> = BTreeMap::new();
    for placed in context.instructions() {
        if let Some(task) = placed.instruction.operand_with(OperandRole::Enables) {
            enabled.entry(task.value).or_default().push(placed);
        }
    }
    for (task, placed) in enabled {
        let Some(recurrent) = placed.iter().position(|p| p.instruction.is_recurrent()) else {
            continue;
        };
        let others = placed.iter().enumerate().filter(|(at, _)| *at != recurrent);
        let name = &context.program.block(task).name;
        let recurrent = placed[recurrent];
        findings.extend(others.map(|(_, other)| finding(context, name, recurrent, other)));
    }
}

fn finding(
    context: &Context,
    name: &str,
    recurrent: &ProgramInstruction,
    other: &ProgramInstruction,
) -> Finding {
    let (message, label, help) = if other.instruction.is_recurrent() {
        (
            format!("task `{name}` is enabled recurrently twice, here and in {}", recurrent.place),
            "second interval",
            joined(context, recurrent, other),
        )
    } else {
        (
            format!("task `{name}` is run once here, and recurrently in {}", recurrent.place),
            "run once",
            "keep one of the two, or give this one a task of its own".to_owned(),
        )
    };
    Finding::new(Code::EntaskConflict, other.instruction.span, message)
        .label(label)
        .related(recurrent.instruction.span, "recurrent here")
        .help(help)
}

/// The help: one ENTASK for both rungs, with its condition if the condition is known.
fn joined(context: &Context, recurrent: &ProgramInstruction, other: &ProgramInstruction) -> String {
    let same_element = recurrent.place.element() == other.place.element();
    let both = [recurrent, other].into_iter();
    match context.any_of(both.map(|p| context.power(&p.place).filter(|_| same_element))) {
        Some(when) => format!("keep one ENTASK, in a rung with `when = [\"{when}\"]`"),
        None => "keep one ENTASK, and bring both conditions to its rung".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn a_task_enabled_in_two_conflicting_ways_is_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["ENTASK A", "ENTASK A"] },
              { when = ["X0"], do = ["ENTASK B every=1s", "ENTASK B every=2s"] },
              { when = ["X0"], do = ["ENTASK C", "ENTASK C every=2s"] },
            ]

            [[task]]
            name = "A"
            rung = [ { when = ["X1"], do = ["OUT Y0"] } ]

            [[task]]
            name = "B"
            rung = [ { when = ["X1"], do = ["OUT Y1"] } ]

            [[task]]
            name = "C"
            rung = [ { when = ["X1"], do = ["OUT Y2"] } ]
            "#,
            expect![[r#"
                5:46 entask-conflict
                  task `B` is enabled recurrently twice, here and in program `Main`, rung
                  2
                    keep one ENTASK, in a rung with `when = ["X0"]`
                6:25 entask-conflict
                  task `C` is run once here, and recurrently in program `Main`, rung 3
                    keep one of the two, or give this one a task of its own
            "#]],
        );
    }
}
