//! `retain-not-kept`: retentive memory is asked for, which this version does not keep.
//!
//! The language knows `[retain]`, so it is no error. To start cold without a word would be one, so
//! `rungd run` refuses; whoever checks a controller file learns of it here first.
//!
//! Passes:
//!
//! ```toml
//! ladder = ["ladder.toml"]
//! ```
//!
//! Fails:
//!
//! ```toml
//! ladder = ["ladder.toml"]
//!
//! [retain]
//! ranges = ["D0..D9"]
//! ```

use crate::source::finding::{Code, Finding};

use super::context::Context;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let Some(first) = context.retained.first() else { return };
    let message = "retentive memory is not kept across restarts by this version";
    findings.push(
        Finding::new(Code::RetainNotKept, first.span, message)
            .label("`rungd run` refuses to start with it")
            .help("take `[retain]` out to run without"),
    );
}
