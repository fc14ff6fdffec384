//! `subroutine-rungs`: CALLs multiply the rungs of a scan beyond any use.
//!
//! The number of rungs that a scan executes, as if every rung's power were ON and every Stage
//! executed, is a product over the CALLs: ten CALLs of a subroutine with ten CALLs each execute the
//! innermost rungs a hundred times.
//!
//! Passes: `CALL Dose` at ten places. Fails: eight levels of subroutines with ten CALLs each.

use std::collections::BTreeMap;

use crate::resolve::calls::SubroutineCall;
use crate::source::finding::{Code, Finding};
use rungd_engine::isa::BlockId;

use super::context::Context;
use super::subroutine_nesting::CallTree;

/// The number of rungs that a scan may execute.
const RUNGS_MAX: u64 = 10_000_000;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let tree = CallTree::of(context);
    let program = context.program;
    let mut sizes: BTreeMap<BlockId, u64> = BTreeMap::new();
    let size = |sizes: &BTreeMap<BlockId, u64>, call: &SubroutineCall| {
        sizes.get(&call.subroutine).copied().unwrap_or(0)
    };
    for id in &tree.upwards {
        let own = program.block(*id).rungs.len() as u64;
        let inner = tree.calls(*id).iter().map(|call| size(&sizes, call));
        sizes.insert(*id, inner.fold(own, u64::saturating_add));
    }
    let blocks = || program.blocks.iter().filter(|block| !block.is_subroutine());
    let own = blocks().map(|block| {
        let stages = block.stages.iter().map(|stage| stage.rungs.len());
        (block.rungs.len() + stages.sum::<usize>()) as u64
    });
    let calls = || blocks().flat_map(|block| tree.calls(block.id));
    let all = own.chain(calls().map(|call| size(&sizes, call))).fold(0, u64::saturating_add);
    if all <= RUNGS_MAX {
        return;
    }
    let largest = calls().rev().max_by_key(|call| size(&sizes, call));
    findings.extend(largest.map(|call| {
        let name = &program.block(call.subroutine).name;
        let message = format!("CALLs let a scan execute up to {all} rungs, more than {RUNGS_MAX}");
        Finding::new(Code::SubroutineRungs, call.span, message)
            .label(format!("up to {} rungs from here", size(&sizes, call)))
            .help(format!("call `{name}`, and what it calls, at fewer places"))
    }));
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};

    use crate::check::testing::check;

    fn levels(rungs: usize, expected: Expect) {
        let call = |to: &str| format!("{{ when = [\"X0\"], do = [\"{to}\"] }}, ");
        let block = |kind: &str, name: &str, rungs: String| {
            format!("[[{kind}]]\nname = \"{name}\"\nrung = [ {rungs} ]\n")
        };
        let ladder = [
            block("program", "Main", call("CALL A").repeat(100)),
            block("subroutine", "A", call("CALL B").repeat(100)),
            block("subroutine", "B", call("SET C0").repeat(rungs)),
        ];
        check(&ladder.concat(), expected);
    }

    #[test]
    fn ten_million_rungs_in_a_scan_pass_and_more_fail() {
        // 100 of Main, 100 x 100 of A, 10,000 x 998 of B.
        levels(
            998,
            expect![[r#"
            9:38 set-never-reset
              `C0` is SET, and nothing ever turns it OFF
                `RST C0` in a rung with its condition, or `OUT C0` if the bit is to
                follow this rung
        "#]],
        );
        levels(
            1000,
            expect![[r#"
            3:34 subroutine-rungs
              CALLs let a scan execute up to 10010100 rungs, more than 10000000
                call `A`, and what it calls, at fewer places
            9:38 set-never-reset
              `C0` is SET, and nothing ever turns it OFF
                `RST C0` in a rung with its condition, or `OUT C0` if the bit is to
                follow this rung
        "#]],
        );
    }
}
