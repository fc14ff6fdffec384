//! `subroutine-nesting`: a subroutine calls itself, or CALLs are nested too deeply.
//!
//! Passes:
//!
//! ```toml
//! [[subroutine]]
//! name = "Dose"
//! rung = [ { when = ["X0"], do = ["CALL Weigh"] } ]
//! ```
//!
//! Fails: the same with `CALL Dose`.

use std::collections::BTreeMap;

use crate::resolve::calls::SubroutineCall;
use crate::source::finding::{Code, Finding};
use rungd_engine::isa::BlockId;

use super::context::Context;
use super::names::list;

/// The number of subroutines that may be active at once.
const ACTIVE_MAX: u32 = 16;

/// The subroutines with their CALLs.
pub(super) struct CallTree<'a> {
    /// By the block or subroutine that contains them.
    pub calls: BTreeMap<BlockId, Vec<SubroutineCall<'a>>>,
    /// The subroutines that call no cycle, each after those that it calls.
    pub upwards: Vec<BlockId>,
    /// The subroutines that are in a cycle of CALLs, or call one.
    cyclic: Vec<BlockId>,
}

impl<'a> CallTree<'a> {
    pub fn of(context: &Context<'a>) -> CallTree<'a> {
        let program = context.program;
        let mut calls: BTreeMap<BlockId, Vec<SubroutineCall>> = BTreeMap::new();
        program.calls().for_each(|call| calls.entry(call.part.block.id).or_default().push(call));
        let mut callers: BTreeMap<BlockId, Vec<BlockId>> = BTreeMap::new();
        for (from, calls) in &calls {
            calls.iter().for_each(|call| callers.entry(call.subroutine).or_default().push(*from));
        }
        let count = |id: &BlockId| calls.get(id).map_or(0, Vec::len);
        let subroutines = program.blocks.iter().filter(|block| block.is_subroutine());
        let mut waiting: BTreeMap<BlockId, usize> =
            subroutines.map(|block| (block.id, count(&block.id))).collect();
        let ready = waiting.iter().filter(|(_, count)| **count == 0).map(|(id, _)| *id);
        let (mut open, mut upwards): (Vec<BlockId>, _) = (ready.collect(), Vec::new());
        while let Some(id) = open.pop() {
            waiting.remove(&id);
            upwards.push(id);
            for from in callers.get(&id).into_iter().flatten() {
                if let Some(count) = waiting.get_mut(from) {
                    *count -= 1;
                    open.extend((*count == 0).then_some(*from));
                }
            }
        }
        CallTree { calls, upwards, cyclic: waiting.into_keys().collect() }
    }

    /// The CALLs of a block or subroutine.
    pub fn calls(&self, id: BlockId) -> &[SubroutineCall<'a>] {
        self.calls.get(&id).map_or(&[], Vec::as_slice)
    }

    /// The cycles of CALLs, each once: one CALL behind the other.
    fn cycles(&self) -> Vec<Vec<SubroutineCall<'a>>> {
        let mut left: Vec<BlockId> = self.cyclic.clone();
        let mut cycles = Vec::new();
        while let Some(start) = left.first().copied() {
            let mut path: Vec<SubroutineCall> = Vec::new();
            let mut places: BTreeMap<BlockId, usize> = BTreeMap::new();
            let mut at = start;
            while !places.contains_key(&at) {
                places.insert(at, path.len());
                let next = self.calls(at).iter().find(|call| left.contains(&call.subroutine));
                let Some(call) = next else { break };
                path.push(*call);
                at = call.subroutine;
            }
            if let Some(from) = places.get(&at).filter(|from| **from < path.len()) {
                cycles.push(path[*from..].to_vec());
            }
            left.retain(|id| !places.contains_key(id));
        }
        cycles
    }
}

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let tree = CallTree::of(context);
    findings.extend(tree.cycles().iter().map(|cycle| recursion(context, cycle)));
    let mut depths: BTreeMap<BlockId, u32> = BTreeMap::new();
    for id in &tree.upwards {
        let depth = |call: &SubroutineCall| depths.get(&call.subroutine).copied().unwrap_or(0);
        let depth = 1 + tree.calls(*id).iter().map(depth).max().unwrap_or(0);
        depths.insert(*id, depth);
    }
    let blocks = context.program.blocks.iter().filter(|block| !block.is_subroutine());
    for call in blocks.flat_map(|block| tree.calls(block.id)) {
        let depth = depths.get(&call.subroutine).copied().unwrap_or(0);
        if depth > ACTIVE_MAX {
            findings.push(too_deep(context, call, depth));
        }
    }
}

fn recursion(context: &Context, cycle: &[SubroutineCall]) -> Finding {
    let name = |call: &SubroutineCall| format!("`{}`", context.program.block(call.subroutine).name);
    let (first, others) = (&cycle[cycle.len() - 1], &cycle[..cycle.len() - 1]);
    let through: Vec<String> = others.iter().map(name).collect();
    let message = match through.as_slice() {
        [] => format!("subroutine {} calls itself", name(first)),
        through => format!("subroutine {} calls itself through {}", name(first), list(through)),
    };
    let finding = Finding::new(Code::SubroutineNesting, first.span, message)
        .label("calls what is executing already")
        .help("a subroutine that calls itself would never end: a Stage repeats its rungs");
    others.iter().fold(finding, |finding, call| finding.related(call.span, "through this CALL"))
}

fn too_deep(context: &Context, call: &SubroutineCall, depth: u32) -> Finding {
    let name = &context.program.block(call.subroutine).name;
    let message = format!(
        "with `CALL {name}`, up to {depth} subroutines are active at once, more than {ACTIVE_MAX}"
    );
    Finding::new(Code::SubroutineNesting, call.span, message)
        .label("leads too deep")
        .help("let this block CALL the inner subroutines itself")
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;

    use expect_test::{Expect, expect};

    use crate::check::testing::check;

    #[test]
    fn subroutines_that_call_themselves_are_reported_once_a_cycle() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["CALL A", "CALL D"] } ]

            [[subroutine]]
            name = "A"
            rung = [ { when = ["X1"], do = ["CALL B"] } ]

            [[subroutine]]
            name = "B"
            rung = [ { when = ["X1"], do = ["CALL C"] } ]

            [[subroutine]]
            name = "C"
            rung = [ { when = ["X1"], do = ["CALL A"] } ]

            [[subroutine]]
            name = "D"
            rung = [ { when = ["X1"], do = ["CALL D", "CALL E"] } ]

            [[subroutine]]
            name = "E"
            "#,
            expect![[r#"
                15:34 subroutine-nesting
                  subroutine `A` calls itself through `B` and `C`
                    a subroutine that calls itself would never end: a Stage repeats its
                    rungs
                19:34 subroutine-nesting
                  subroutine `D` calls itself
                    a subroutine that calls itself would never end: a Stage repeats its
                    rungs
            "#]],
        );
    }

    fn nested(depth: usize, expected: Expect) {
        let mut ladder = "[[program]]\nname = \"Main\"\n".to_owned();
        ladder += "rung = [ { when = [\"X0\"], do = [\"CALL S1\"] } ]\n";
        for at in 1..=depth {
            let what = if at == depth { "OUT Y0".to_owned() } else { format!("CALL S{}", at + 1) };
            let rung = format!("{{ when = [\"X1\"], do = [\"{what}\"] }}");
            writeln!(ladder, "[[subroutine]]\nname = \"S{at}\"\nrung = [ {rung} ]")
                .expect("a string takes any text");
        }
        check(&ladder, expected);
    }

    #[test]
    fn sixteen_active_subroutines_pass_and_seventeen_fail() {
        nested(16, expect![[""]]);
        nested(
            17,
            expect![[r#"
            3:34 subroutine-nesting
              with `CALL S1`, up to 17 subroutines are active at once, more than 16
                let this block CALL the inner subroutines itself
        "#]],
        );
    }
}
