//! `mixed-and-or`: `&` and `|` side by side without parentheses.
//!
//! `&` binds tighter, but readers may not know that. The rule finds parentheses by the places: a
//! series in parentheses begins before its first contact.
//!
//! Passes:
//!
//! ```toml
//! when = ["X0 & (X1 | X2)"]
//! ```
//!
//! Fails:
//!
//! ```toml
//! when = ["X0 & X1 | X2"]
//! ```

use crate::resolve::program::Contact;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{advise, text};

use super::context::Context;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for contact in context.contacts() {
        let Contact::Any(parts, span) = contact else { continue };
        if !parts.iter().any(|part| is_bare_series(context, part)) {
            continue;
        }
        findings.push(
            Finding::new(Code::MixedAndOr, *span, "`&` and `|` are mixed without parentheses")
                .label("`&` binds tighter")
                .help(advise(
                    "as it is read now: `{}`",
                    [text(context.program.names.contact(contact)).same()],
                )),
        );
    }
}

fn is_bare_series(context: &Context, contact: &Contact) -> bool {
    let Contact::All(parts, span) = contact else { return false };
    let layers = &context.program.layers;
    parts.first().is_some_and(|part| layers.begin_together(part.span(), *span))
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check_main;

    #[test]
    fn mixed_and_and_or_without_parentheses_are_reported() {
        check_main(
            r#"
            { when = ["X0 & X1 | X2"], do = ["OUT Y0"] },
            { when = ["(X0 & X1) | X2", "X3 & (X4 | X5)"], do = ["OUT Y1"] },
            { when = ["X9", "X0 | (X1 | X2 & !X3 & D0 > 3)"], do = ["OUT Y2"] },
            { when = ["!((X0 | X1) & X2 | X3)"], do = ["OUT Y3"] },
            { when = ["((X0 | X1) & X2) | X3 | ((X4 & X5))"], do = ["OUT Y4"] },
            "#,
            expect![[r#"
                4:12 mixed-and-or
                  `&` and `|` are mixed without parentheses
                    as it is read now: `(X0 & X1) | X2`
                6:23 mixed-and-or
                  `&` and `|` are mixed without parentheses
                    as it is read now: `X1 | (X2 & !X3 & D0 > 3)`
                7:13 mixed-and-or
                  `&` and `|` are mixed without parentheses
                    as it is read now: `((X0 | X1) & X2) | X3`
            "#]],
        );
    }
}
