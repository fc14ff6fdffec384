//! `multi-scan-in-task`: an instruction that works over several scans, in a task that runs once.
//!
//! A run-once task executes once and terminates, so a timer never times, and a counter is reset
//! after every run. `FirstScan` and `LastScan` always run once. A run-once ENTASK in such a task is
//! not reported, because it needs only one execution to start its task. A subroutine is reported if
//! only such tasks execute it.
//!
//! Passes:
//!
//! ```toml
//! rung = [ { when = ["$On"], do = ["ENTASK Report every=1s"] } ]
//! ```
//!
//! Fails, with a timer in `Report`:
//!
//! ```toml
//! rung = [ { when = ["X0"], do = ["ENTASK Report"] } ]
//! ```

use std::collections::{BTreeMap, BTreeSet};

use crate::resolve::program::{Block, BlockKind};
use crate::source::finding::{Code, Finding};
use crate::source::span::Span;
use rungd_engine::isa::BlockId;

use super::context::{Context, ProgramInstruction};
use super::reach::reached;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut run_once: BTreeMap<BlockId, Span> = BTreeMap::new();
    for placed in context.instructions() {
        if let Some(task) =
            placed.instruction.target_block().filter(|_| placed.instruction.runs_once())
        {
            run_once.entry(task.value).or_insert(placed.instruction.span);
        }
    }
    let is_once = |block: &Block| match block.kind {
        BlockKind::FirstScan | BlockKind::LastScan => true,
        BlockKind::Task => run_once.contains_key(&block.id),
        BlockKind::Program
        | BlockKind::TopOfScan
        | BlockKind::BottomOfScan
        | BlockKind::Subroutine => false,
    };
    let of_tasks = called_once(context, is_once);
    for placed in context.instructions().filter(|p| works_over_scans(p)) {
        let block = placed.place.block;
        if is_once(block) {
            findings.push(finding(placed, run_once.get(&block.id).copied()));
        } else if of_tasks.contains(&block.id) {
            findings.push(finding_in_subroutine(placed));
        }
    }
}

/// The subroutines that run-once tasks alone execute.
fn called_once(context: &Context, is_once: impl Fn(&Block) -> bool) -> BTreeSet<BlockId> {
    let program = context.program;
    let calls: Vec<(Option<BlockId>, BlockId)> =
        program.calls().map(|call| (Some(call.part.block.id), call.subroutine)).collect();
    let from = |once: bool| {
        let callers = program.blocks.iter().filter(|block| !block.is_subroutine());
        let roots = callers.filter(|block| is_once(block) == once).map(|block| block.id);
        reached(roots, &calls)
    };
    from(true).difference(&from(false)).copied().collect()
}

fn finding_in_subroutine(placed: &ProgramInstruction) -> Finding {
    let subroutine = &placed.place.block.name;
    let message = format!(
        "`{}` works over several scans, but only tasks that execute once and terminate call \
         subroutine `{subroutine}`",
        placed.name()
    );
    Finding::new(Code::MultiScanInTask, placed.instruction.span, message)
        .label("executes once a run")
        .help(format!("`CALL {subroutine}` in a program, or run the task at an interval"))
}

fn works_over_scans(placed: &ProgramInstruction) -> bool {
    placed.mnemonic().spec().multi_scan && !placed.instruction.runs_once()
}

fn finding(placed: &ProgramInstruction, started: Option<Span>) -> Finding {
    let task = &placed.place.block.name;
    let message = format!(
        "`{}` works over several scans, but task `{task}` executes once and terminates",
        placed.name()
    );
    let finding = Finding::new(Code::MultiScanInTask, placed.instruction.span, message)
        .label("executes once a run");
    match started {
        Some(span) => finding.related(span, "run once from here").help(format!(
            "move it to a program, or run the task at an interval: `ENTASK {task} every=100ms`"
        )),
        None => finding.help("move it to a program, such as `Main`"),
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn multi_scan_instructions_are_reported_in_run_once_tasks_only() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["ENTASK Once", "ENTASK Often every=10ms"] },
              { when = ["X0"], do = ["TMR T9 preset=1s"] },
            ]

            [[task]]
            name = "Once"
            rung = [
              { when = ["X1"], do = ["TMR T0 preset=1s", "ENTASK Other", "ENTASK Third every=1s"] },
              { leg.up = ["X0"], leg.dn = ["X1"], do = ["UDCG CT0 up-preset=5"] },
            ]

            [[task]]
            name = "Often"
            rung = [ { when = ["X1"], do = ["TMR T1 preset=1s"] } ]

            [[task]]
            name = "Other"
            rung = [ { when = ["X1"], do = ["OUT Y0"] } ]

            [[task]]
            name = "Third"
            rung = [ { when = ["X1"], do = ["OUT Y1"] } ]

            [[task]]
            name = "FirstScan"
            rung = [ { when = ["X1"], do = ["TMR T2 preset=1s"] } ]

            [[task]]
            name = "TopOfScan"
            rung = [ { when = ["X1"], do = ["TMR T3 preset=1s"] } ]
            "#,
            expect![[r#"
                11:25 multi-scan-in-task
                  `TMR` works over several scans, but task `Once` executes once and
                  terminates
                    move it to a program, or run the task at an interval: `ENTASK Once
                    every=100ms`
                11:61 multi-scan-in-task
                  `ENTASK` works over several scans, but task `Once` executes once and
                  terminates
                    move it to a program, or run the task at an interval: `ENTASK Once
                    every=100ms`
                12:44 multi-scan-in-task
                  `UDCG` works over several scans, but task `Once` executes once and
                  terminates
                    move it to a program, or run the task at an interval: `ENTASK Once
                    every=100ms`
                29:34 multi-scan-in-task
                  `TMR` works over several scans, but task `FirstScan` executes once and
                  terminates
                    move it to a program, such as `Main`
            "#]],
        );
    }
}
