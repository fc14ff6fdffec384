//! `edge-in-clk`: an edge contact in the `clk` leg of SR, or in the `up` or `dn` leg of UDCG.
//!
//! SR and UDCG themselves act at the rising edge of these legs, so an edge contact there is an edge
//! of an edge. They do not detect that the signal stays ON. In a termination pass the history of
//! the edge contact goes OFF, but the histories of SR and UDCG do not. All other instructions with
//! an edge of their own lose its history in the pass too.
//!
//! Passes:
//!
//! ```toml
//! { leg.data = ["X0"], leg.clk = ["X1"], leg.rst = ["X2"], do = ["SR C0..C7"] }
//! { leg.up = ["X0"], leg.dn = ["$Off"], do = ["UDCG CT0"] }
//! ```
//!
//! Fails:
//!
//! ```toml
//! { leg.data = ["X0"], leg.clk = ["rise(X1)"], leg.rst = ["X2"], do = ["SR C0..C7"] }
//! { leg.up = ["rise(X0)"], leg.dn = ["$Off"], do = ["UDCG CT0"] }
//! ```

use crate::resolve::program::{Contact, Edge};
use crate::source::finding::{Code, Finding};
use crate::source::fix::write;
pub use rungd_engine::isa::{LegName, Mnemonic};

use super::context::Context;

/// The instructions that keep the edge history of these legs in a termination pass.
const EDGE_LEGS: [(Mnemonic, &str, &[LegName]); 2] = [
    (Mnemonic::Sr, "SR shifts", &[LegName::Clk]),
    (Mnemonic::Udcg, "UDCG counts", &[LegName::Up, LegName::Dn]),
];

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for placed in context.instructions() {
        let mnemonic = placed.mnemonic();
        let Some((_, acts, legs)) =
            EDGE_LEGS.iter().find(|(own_mnemonic, ..)| *own_mnemonic == mnemonic)
        else {
            continue;
        };
        for leg in placed.place.rung.legs.iter().filter(|leg| legs.contains(&leg.name)) {
            let told = EdgeLeg { acts, leg: leg.name.key() };
            leg.contacts.iter().for_each(|contact| edges(context, told, contact, findings));
        }
    }
}

/// A leg that detects its edge itself.
#[derive(Clone, Copy)]
struct EdgeLeg {
    /// The instruction, and what it does at the edge.
    acts: &'static str,
    /// The name of the leg.
    leg: &'static str,
}

fn edges(context: &Context, told: EdgeLeg, contact: &Contact, findings: &mut Vec<Finding>) {
    match contact {
        Contact::Edge(edge, inner, span) => {
            let meant = match edge {
                Edge::Rise => context.program.names.contact(inner),
                Edge::Fall => context.program.names.contact(&Contact::Not(inner.clone(), *span)),
            };
            let message = format!("`{}` detects the edge itself", told.leg);
            findings.push(
                Finding::new(Code::EdgeInClk, *span, message)
                    .label("an edge of an edge")
                    .help(write(meant).and(&format!(": {} when that comes ON", told.acts))),
            );
        }
        Contact::Not(inner, _) => edges(context, told, inner, findings),
        Contact::All(parts, _) | Contact::Any(parts, _) => {
            parts.iter().for_each(|part| edges(context, told, part, findings));
        }
        Contact::Bit(..) | Contact::Element(..) | Contact::Compare(..) | Contact::Computed(..) => {}
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check_main;

    #[test]
    fn edges_anywhere_in_a_clk_leg_are_reported() {
        check_main(
            r#"
            { leg.clk = ["X1"], leg.data = ["rise(X0)"], leg.rst=["X2"], do=["SR C0..C7"] },
            { leg.clk = ["!(X4 & rise(X1))"], leg.data = ["X0"], leg.rst=["X2"], do=["SR C0..C1"] },
            { leg.clk = ["fall(X1 | X2)"], leg.data = ["X0"], leg.rst=["X2"], do=["SR C9..C8"] },
            "#,
            expect![[r#"
                5:22 edge-in-clk
                  `clk` detects the edge itself
                    write `X1`: SR shifts when that comes ON
                6:15 edge-in-clk
                  `clk` detects the edge itself
                    write `!(X1 | X2)`: SR shifts when that comes ON
            "#]],
        );
    }

    #[test]
    fn edges_in_the_legs_of_udcg_but_not_of_other_counters_are_reported() {
        check_main(
            r#"
            { leg.up = ["rise(X0)"], leg.dn = ["X3", "fall(X1)"], do = ["UDCG CT0"] },
            { leg.up = ["X0"], leg.dn = ["!X1"], do = ["UDCG CT1"] },
            { leg.up = ["rise(X0)"], leg.dn = ["rise(X1)"], leg.rst = ["X2"], do = ["UDC CT2"] },
            { leg.up = ["rise(X0)"], leg.rst = ["rise(X1)"], do = ["CNT CT3 preset=3"] },
            { when = ["rise(X0)"], do = ["CTU N0 preset=3"] },
            "#,
            expect![[r#"
                4:14 edge-in-clk
                  `up` detects the edge itself
                    write `X0`: UDCG counts when that comes ON
                4:43 edge-in-clk
                  `dn` detects the edge itself
                    write `!X1`: UDCG counts when that comes ON
            "#]],
        );
    }
}
