//! `stage-never-entered`: no instruction that can execute enters this stage.
//!
//! The initial stage and the program's own rungs execute. JMP, SGSET, SGDIVRG and SGCONVRG enter
//! stages. A stage that is entered only from itself, or only from stages that are never entered, is
//! never entered either.
//!
//! Passes:
//!
//! ```toml
//! [[program.stage]]
//! name = "Open"
//! rung = [ { when = ["X0"], do = ["JMP Close"] } ]
//!
//! [[program.stage]]
//! name = "Close"
//! rung = [ { when = ["X1"], do = ["EXIT"] } ]
//! ```
//!
//! Fails: the same with `do = ["EXIT"]` in `Open`.

use std::collections::BTreeSet;

use crate::resolve::program::{Block, Stage};
use crate::source::finding::{Code, Finding};
use rungd_engine::isa::StageId;

use super::context::Context;
use super::names::list;
use super::reach::{reached, sources};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let edges = entries(context);
    let blocks = &context.program.blocks;
    let initial = blocks.iter().filter_map(|block| block.stages.first()).map(|stage| stage.id);
    let reached = reached(initial, &edges);
    let sources = sources(&edges);
    let from = |stage: &Stage| sources.get(&stage.id);
    for block in blocks {
        let never = block.stages.iter().enumerate().filter(|(_, s)| !reached.contains(&s.id));
        findings.extend(never.map(|(at, stage)| finding(context, block, at, from(stage))));
    }
}

/// The pairs (from, entered stage); `from` is `None` for a program's own rungs.
fn entries(context: &Context) -> Vec<(Option<StageId>, StageId)> {
    let pairs = context.instructions().flat_map(|p| {
        let from = p.place.stage.map(|stage| stage.id);
        p.instruction.stages_entered().map(move |to| (from, to))
    });
    pairs.collect()
}

fn finding(
    context: &Context,
    block: &Block,
    at: usize,
    sources: Option<&BTreeSet<StageId>>,
) -> Finding {
    let stage = &block.stages[at];
    let others = sources.into_iter().flatten().filter(|from| **from != stage.id);
    let from: Vec<String> =
        others.map(|from| format!("`{}`", context.program.stage(*from).name)).collect();
    let why = match from.as_slice() {
        [] => "no JMP, SGSET, SGDIVRG or SGCONVRG leads to it".to_owned(),
        _ => {
            format!("it would be entered only from {}, which is never entered either", list(&from))
        }
    };
    let before = &block.stages[at.saturating_sub(1)].name;
    let help = match from.as_slice() {
        [] => {
            format!("enter it, for example from stage `{before}`: `do = [\"JMP {}\"]`", stage.name)
        }
        _ => format!("enter {} from a stage that is entered", list(&from)),
    };
    let message =
        format!("stage `{}` of program `{}` is never entered: {why}", stage.name, block.name);
    Finding::new(Code::StageNeverEntered, stage.span, message).label("never ON").help(help)
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn stages_that_no_instruction_enters_are_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["RUN Day"] } ]

            [[program]]
            name = "Day"

            [[program.stage]]
            name = "A"
            rung = [ { when = ["X1"], do = ["JMP B"] } ]

            [[program.stage]]
            name = "B"
            rung = [ { when = ["X2"], do = ["EXIT"] } ]

            [[program.stage]]
            name = "Alone"
            rung = [ { when = ["X2"], do = ["JMP Alone", "JMP Behind"] } ]

            [[program.stage]]
            name = "Behind"
            rung = [ { when = ["X2"], do = ["JMP A"] } ]
            "#,
            expect![[r#"
                17:9 stage-never-entered
                  stage `Alone` of program `Day` is never entered: no JMP, SGSET, SGDIVRG
                  or SGCONVRG leads to it
                    enter it, for example from stage `B`: `do = ["JMP Alone"]`
                18:47 runs-through
                  `JMP Behind` runs through stage `Behind`: `JMP A` there is ON in the
                  same scan
                    let `Behind` wait for something that comes later; or let one edge make
                    one step: a bit that the step takes away,
                    `pulse = { type = "bit" }` under [tags], in `Main`
                    { when = ["X2"], do = ["PD pulse"] },
                    and here, as in every stage that waits for it,
                    { when = ["pulse"], do = ["RST pulse", "JMP Behind"] },
                21:9 stage-never-entered
                  stage `Behind` of program `Day` is never entered: it would be entered
                  only from `Alone`, which is never entered either
                    enter `Alone` from a stage that is entered
            "#]],
        );
    }

    #[test]
    fn stages_entered_by_any_jump_instruction_are_not_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["RUN Day"] } ]

            [[program]]
            name = "Day"

            rung = [ { when = ["X2"], do = ["SGSET B", "SGCONVRG B to=E"] } ]

            [[program.stage]]
            name = "A"
            rung = [ { when = ["X1"], do = ["SGDIVRG C D"] } ]

            [[program.stage]]
            name = "B"
            rung = [ { when = ["X2"], do = ["OUT Y0"] } ]

            [[program.stage]]
            name = "C"
            rung = [ { when = ["X2"], do = ["OUT Y1"] } ]

            [[program.stage]]
            name = "D"
            rung = [ { when = ["X2"], do = ["OUT Y2"] } ]

            [[program.stage]]
            name = "E"
            rung = [ { when = ["X2"], do = ["SGRST F"] } ]

            [[program.stage]]
            name = "F"
            rung = [ { when = ["X2"], do = ["OUT Y3"] } ]
            "#,
            expect![[r#"
                31:9 stage-never-entered
                  stage `F` of program `Day` is never entered: no JMP, SGSET, SGDIVRG or
                  SGCONVRG leads to it
                    enter it, for example from stage `E`: `do = ["JMP F"]`
            "#]],
        );
    }
}
