//! `block-never-started`: no instruction that can execute starts this program or task.
//!
//! `Main`, programs with `autostart = true` and the built-in tasks run from the start; RUN, RESTART
//! and ENTASK start further blocks. A block with a RUN, RESTART or ENTASK only in itself, or only
//! in blocks that are never started, is never started either.
//!
//! Passes:
//!
//! ```toml
//! [[program]]
//! name = "Main"
//! rung = [ { when = ["X0"], do = ["RUN Drain"] } ]
//!
//! [[program]]
//! name = "Drain"
//! rung = [ { when = ["X1"], do = ["OUT Y0"] } ]
//! ```
//!
//! Fails: the same without the RUN.

use std::collections::BTreeSet;

use crate::resolve::program::{Block, BlockKind, Program};
use crate::source::finding::{Code, Finding};
use rungd_engine::isa::{BlockId, OperandRole};

use super::context::Context;
use super::names::list;
use super::reach::{reached, sources};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let starts =
        context.instructions().filter(|p| p.instruction.acting_role() != Some(OperandRole::Stops));
    let edges: Vec<(Option<BlockId>, BlockId)> = starts
        .filter_map(|p| Some((Some(p.place.block.id), p.instruction.target_block()?.value)))
        .collect();
    let blocks = &context.program.blocks;
    let roots = blocks.iter().filter(|b| runs_at_start(b)).map(|b| b.id);
    let reached = reached(roots, &edges);
    let sources = sources(&edges);
    let never = blocks.iter().filter(|block| !block.is_subroutine());
    let never = never.filter(|block| !reached.contains(&block.id));
    findings.extend(never.map(|block| finding(context.program, block, sources.get(&block.id))));
}

fn runs_at_start(block: &Block) -> bool {
    block.autostart || block.is_main() || block.kind.is_built_in()
}

fn finding(program: &Program, block: &Block, sources: Option<&BTreeSet<BlockId>>) -> Finding {
    let name = &block.name;
    let others = sources.into_iter().flatten().filter(|from| **from != block.id);
    let from: Vec<String> = others.map(|from| format!("`{}`", program.block(*from).name)).collect();
    let (starters, start) = match block.kind {
        BlockKind::Program => ("RUN or RESTART", format!("`RUN {name}`, or `autostart = true`")),
        BlockKind::Task
        | BlockKind::FirstScan
        | BlockKind::TopOfScan
        | BlockKind::BottomOfScan
        | BlockKind::LastScan
        | BlockKind::Subroutine => {
            ("ENTASK", format!("`ENTASK {name}`, or `ENTASK {name} every=1s`"))
        }
    };
    let (why, help) = match from.as_slice() {
        [] if sources.is_some_and(|from| from.contains(&block.id)) => {
            (format!("the only {starters} of it is in its own rungs"), start)
        }
        [] => (format!("there is no {starters} of it"), start),
        _ => {
            let from = list(&from);
            (format!("it would be started only by {from}, which is never started either"), start)
        }
    };
    let help = format!("start it in a block that runs: {help}");
    let message = format!("{} `{name}` is never started: {why}", block.kind.word());
    Finding::new(Code::BlockNeverStarted, block.span, message).label("never runs").help(help)
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn programs_and_tasks_that_nothing_starts_are_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["RUN A"] } ]

            [[program]]
            name = "A"
            rung = [ { when = ["X1"], do = ["ENTASK T"] } ]

            [[program]]
            name = "Auto"
            autostart = true
            rung = [ { when = ["X1"], do = ["RESTART Again"] } ]

            [[program]]
            name = "Again"
            rung = [ { when = ["X1"], do = ["OUT Y0"] } ]

            [[program]]
            name = "Never"
            rung = [ { when = ["X1"], do = ["RUN Behind"] } ]

            [[program]]
            name = "Behind"
            rung = [ { when = ["X1"], do = ["RESTART Behind"] } ]

            [[program]]
            name = "Self"
            rung = [ { when = ["X1"], do = ["RUN Self"] } ]

            [[task]]
            name = "T"
            rung = [ { when = ["X1"], do = ["OUT Y1"] } ]

            [[task]]
            name = "NoEntask"
            rung = [ { when = ["X1"], do = ["OUT Y2"] } ]

            [[task]]
            name = "TopOfScan"
            rung = [ { when = ["X1"], do = ["OUT Y3"] } ]
            "#,
            expect![[r#"
                19:9 block-never-started
                  program `Never` is never started: there is no RUN or RESTART of it
                    start it in a block that runs: `RUN Never`, or `autostart = true`
                23:9 block-never-started
                  program `Behind` is never started: it would be started only by `Never`,
                  which is never started either
                    start it in a block that runs: `RUN Behind`, or `autostart = true`
                27:9 block-never-started
                  program `Self` is never started: the only RUN or RESTART of it is in its
                  own rungs
                    start it in a block that runs: `RUN Self`, or `autostart = true`
                35:9 block-never-started
                  task `NoEntask` is never started: there is no ENTASK of it
                    start it in a block that runs: `ENTASK NoEntask`, or `ENTASK NoEntask
                    every=1s`
            "#]],
        );
    }
}
