//! `shared-history`: a subroutine that is called at more than one place remembers something from
//! its last execution.
//!
//! An edge, a timer, a counter or an SR has one state, however many CALLs execute it: the second
//! CALL in a scan sees what the first one left. A template has a state for each use.
//!
//! Passes, called at two places:
//!
//! ```toml
//! [[subroutine]]
//! name = "Limit"
//! rung = [ { when = ["D0 > 100"], do = ["MOVE 100 to=D0"] } ]
//! ```
//!
//! Fails, called at two places: the same with `when = ["rise(X0)"]`.

use std::collections::BTreeMap;

use crate::resolve::program::{Block, Contact, Rung};
use crate::source::finding::{Code, Finding};
use crate::source::span::Span;
use rungd_engine::isa::{BlockId, Mnemonic};

use super::context::Context;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut calls: BTreeMap<BlockId, Vec<Span>> = BTreeMap::new();
    context
        .program
        .calls()
        .for_each(|call| calls.entry(call.subroutine).or_default().push(call.span));
    for (id, calls) in &calls {
        let block = context.program.block(*id);
        let ([_, _, ..], Some(state)) = (calls.as_slice(), state(block)) else { continue };
        findings.push(finding(block, calls, &state));
    }
}

/// A part that remembers something.
struct Remembering {
    span: Span,
    what: String,
}

/// The first part of a subroutine that remembers something from its last execution.
fn state(block: &Block) -> Option<Remembering> {
    block.rungs.iter().find_map(|rung| edge(rung).or_else(|| instruction(rung)))
}

fn edge(rung: &Rung) -> Option<Remembering> {
    let legs = rung.legs.iter().flat_map(|leg| &leg.contacts);
    let mut open: Vec<&Contact> =
        legs.chain(rung.branches.iter().flat_map(|branch| &branch.contacts)).collect();
    open.reverse();
    while let Some(contact) = open.pop() {
        match contact {
            Contact::Edge(_, _, span) => {
                return Some(Remembering { span: *span, what: "this edge".to_owned() });
            }
            Contact::Not(inner, _) => open.push(inner),
            Contact::All(parts, _) | Contact::Any(parts, _) => open.extend(parts.iter().rev()),
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => {}
        }
    }
    None
}

fn instruction(rung: &Rung) -> Option<Remembering> {
    let mut all = rung.instructions().map(|(_, instruction)| instruction);
    let found = all.find(|instruction| {
        let is_edge = matches!(
            instruction.mnemonic,
            Mnemonic::Pd | Mnemonic::Nd | Mnemonic::Ponoff | Mnemonic::Sr | Mnemonic::Restart
        );
        is_edge || instruction.owned().is_some() || instruction.runs_once()
    })?;
    let what = format!("`{}`", found.mnemonic.spec().name);
    Some(Remembering { span: found.span, what })
}

fn finding(block: &Block, calls: &[Span], state: &Remembering) -> Finding {
    let name = &block.name;
    let message = format!(
        "{} CALLs of subroutine `{name}` share one state of {}: each sees what the one before left",
        calls.len(),
        state.what
    );
    let finding = Finding::new(Code::SharedHistory, state.span, message)
        .label("one state for all CALLs")
        .help(format!(
            "make it a template, so that each use has a state of its own: `[[template]]` and \
             `use = \"{name}\"`"
        ));
    calls.iter().fold(finding, |finding, call| finding.related(*call, "called here"))
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn subroutines_with_a_state_that_two_places_call_are_reported() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["CALL Once", "CALL Edge", "CALL Time", "CALL Plain"] },
              { when = ["X1"], do = ["CALL Edge", "CALL Time", "CALL Plain"] },
            ]

            [[subroutine]]
            name = "Once"
            rung = [ { when = ["rise(X2)"], do = ["SET C0"] } ]

            [[subroutine]]
            name = "Edge"
            rung = [ { when = ["X3 | !(X4 & rise(X2))"], do = ["RST C0"] } ]

            [[subroutine]]
            name = "Time"
            rung = [ { when = ["X2"], do = ["OUT C1", "TMR T0 preset=1s"] } ]

            [[subroutine]]
            name = "Plain"
            rung = [ { when = ["D0 > 100"], do = ["MOVE 100 to=D0", "ENTASK Tell every=1s"] } ]

            [[task]]
            name = "Tell"
            rung = [ { when = ["X2"], do = ["OUT C2"] } ]
            "#,
            expect![[r#"
                14:33 shared-history
                  2 CALLs of subroutine `Edge` share one state of this edge: each sees
                  what the one before left
                    make it a template, so that each use has a state of its own:
                    `[[template]]` and `use = "Edge"`
                18:44 shared-history
                  2 CALLs of subroutine `Time` share one state of `TMR`: each sees what
                  the one before left
                    make it a template, so that each use has a state of its own:
                    `[[template]]` and `use = "Time"`
            "#]],
        );
    }
}
