//! `subroutine-never-called`: no CALL in a program or task leads to this subroutine.
//!
//! A CALL in a subroutine that nothing calls does not count.
//!
//! Passes:
//!
//! ```toml
//! [[program]]
//! name = "Main"
//! rung = [ { when = ["X0"], do = ["CALL Dose"] } ]
//!
//! [[subroutine]]
//! name = "Dose"
//! rung = [ { when = ["X1"], do = ["OUT Y0"] } ]
//! ```
//!
//! Fails: the same without the CALL.

use crate::source::finding::{Code, Finding};

use super::context::Context;
use super::names::list;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let program = context.program;
    let called = program.called_subroutines();
    for block in program.blocks.iter().filter(|block| block.is_subroutine()) {
        if called.contains(&block.id) {
            continue;
        }
        let callers = program.calls().filter(|call| call.subroutine == block.id);
        let mut from: Vec<String> = callers
            .filter(|call| call.part.block.id != block.id)
            .map(|call| format!("`{}`", call.part.block.name))
            .collect();
        from.dedup();
        let why = match from.as_slice() {
            [] => "there is no CALL of it".to_owned(),
            _ => format!("only {} would call it, which is never called either", list(&from)),
        };
        let message = format!("subroutine `{}` is never called: {why}", block.name);
        findings.push(
            Finding::new(Code::SubroutineNeverCalled, block.span, message)
                .label("never executes")
                .help(format!("execute it in a block that runs: `CALL {}`", block.name)),
        );
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn subroutines_that_no_block_calls_are_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["CALL A"] } ]

            [[subroutine]]
            name = "A"
            rung = [ { when = ["X1"], do = ["CALL B"] } ]

            [[subroutine]]
            name = "B"
            rung = [ { when = ["X1"], do = ["OUT Y0"] } ]

            [[subroutine]]
            name = "C"
            rung = [ { when = ["X1"], do = ["CALL D"] } ]

            [[subroutine]]
            name = "D"
            rung = [ { when = ["X1"], do = ["OUT Y1"] } ]
            "#,
            expect![[r#"
                14:9 subroutine-never-called
                  subroutine `C` is never called: there is no CALL of it
                    execute it in a block that runs: `CALL C`
                18:9 subroutine-never-called
                  subroutine `D` is never called: only `C` would call it, which is never
                  called either
                    execute it in a block that runs: `CALL D`
            "#]],
        );
    }
}
