//! `edge-in-clk`: an edge contact in the `clk` leg of SR.
//!
//! SR itself shifts at the rising edge of `clk`, so an edge contact there is an edge of an edge. SR
//! does not detect that the signal stays ON. In a termination pass the history of the edge contact
//! goes OFF, but the history of SR does not.
//!
//! Passes:
//!
//! ```toml
//! { leg.data = ["X0"], leg.clk = ["X1"], leg.rst = ["X2"], do = ["SR C0..C7"] }
//! ```
//!
//! Fails:
//!
//! ```toml
//! { leg.data = ["X0"], leg.clk = ["rise(X1)"], leg.rst = ["X2"], do = ["SR C0..C7"] }
//! ```

use crate::isa::{LegName, Mnemonic};
use crate::resolve::program::{Contact, Edge};
use crate::source::finding::{Code, Finding};

use super::context::Context;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for placed in context.instructions().filter(|p| p.mnemonic() == Mnemonic::Sr) {
        let clk = placed.place.rung.legs.iter().filter(|leg| leg.name == LegName::Clk);
        for contact in clk.flat_map(|leg| &leg.contacts) {
            edges(context, contact, findings);
        }
    }
}

fn edges(context: &Context, contact: &Contact, findings: &mut Vec<Finding>) {
    match contact {
        Contact::Edge(edge, inner, span) => {
            let inner = context.contact(inner);
            let meant = if *edge == Edge::Rise { inner } else { format!("!({inner})") };
            let message = "`clk` detects the edge itself";
            findings.push(
                Finding::new(Code::EdgeInClk, *span, message)
                    .label("an edge of an edge")
                    .help(format!("write `{meant}`: SR shifts when that comes ON")),
            );
        }
        Contact::Not(inner, _) => edges(context, inner, findings),
        Contact::All(parts, _) | Contact::Any(parts, _) => {
            parts.iter().for_each(|part| edges(context, part, findings));
        }
        Contact::Bit(..) | Contact::Element(..) | Contact::Compare(..) => {}
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check_main;

    #[test]
    fn edges_anywhere_in_clk() {
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
}
