//! `unknown-allow`: `allow` names something that is no warning.
//!
//! Passes:
//!
//! ```toml
//! allow = ["set-never-reset"]
//! ```
//!
//! Fails: `allow = ["set-never-rest"]`, and `allow = ["owned-twice"]`, which is an error.

use crate::source::finding::{Code, Finding, Severity, TABLE};
use crate::source::span::Span;

use super::context::Context;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let blocks = context.program.blocks.iter();
    let rungs = blocks.flat_map(|block| {
        block.rungs.iter().chain(block.stages.iter().flat_map(|stage| &stage.rungs))
    });
    let allows = context.program.allow.iter().chain(rungs.flat_map(|rung| &rung.allow));
    findings.extend(allows.filter_map(|(name, span)| judge(name, *span)));
}

fn judge(name: &str, span: Span) -> Option<Finding> {
    let (message, help) = match Code::from_name(name).map(Code::severity) {
        Some(Severity::Warning) => return None,
        Some(Severity::Error) => {
            (format!("`{name}` is an error, which cannot be allowed"), "delete it".to_owned())
        }
        None => (format!("there is no warning `{name}`"), nearest(name)),
    };
    Some(Finding::new(Code::UnknownAllow, span, message).label("no warning").help(help))
}

fn nearest(name: &str) -> String {
    let names = || TABLE.iter().filter(|row| row.severity == Severity::Warning).map(|row| row.name);
    match nearest_name(name, names()) {
        Some(near) => format!("`\"{near}\"`"),
        None => format!("the warnings are {}", names().collect::<Vec<_>>().join(", ")),
    }
}

fn nearest_name(_: &str, _: impl Iterator<Item = &'static str>) -> Option<&'static str> {
    None
}
