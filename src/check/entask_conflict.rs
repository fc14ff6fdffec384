//! `entask-conflict`: a task is enabled recurrently by one ENTASK, or run once from anywhere.
//!
//! Passes:
//!
//! ```toml
//! rung = [ { when = ["X0"], do = ["ENTASK Report"] }, { when = ["X1"], do = ["ENTASK Report"] } ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [
//!   { when = ["$On"], do = ["ENTASK Report every=1m"] },
//!   { when = ["X1"], do = ["ENTASK Report"] },
//! ]
//! ```

use std::collections::BTreeMap;

use crate::isa::{BlockId, Mnemonic};
use crate::source::finding::{Code, Finding};

use super::context::{Context, Placed};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut enabled: BTreeMap<BlockId, Vec<&Placed>> = BTreeMap::new();
    for placed in context.of(&[Mnemonic::Entask]) {
        if let Some((task, _)) = placed.target_block() {
            enabled.entry(task).or_default().push(placed);
        }
    }
    for (task, placed) in enabled {
        let Some(recurrent) = placed.iter().position(|p| is_recurrent(p)) else { continue };
        let others = placed.iter().enumerate().filter(|(at, _)| *at != recurrent);
        let name = &context.program.block(task).name;
        findings.extend(others.map(|(_, other)| finding(name, placed[recurrent], other)));
    }
}

/// Whether an ENTASK has an interval.
pub fn is_recurrent(placed: &Placed) -> bool {
    placed.instruction.arg("every").is_some()
}

fn finding(name: &str, recurrent: &Placed, other: &Placed) -> Finding {
    let (message, label, help) = if is_recurrent(other) {
        (
            format!("task `{name}` is enabled recurrently twice, here and in {}", recurrent.place),
            "second interval",
            "keep one ENTASK, and bring both conditions to its rung: `when = [\"A | B\"]`",
        )
    } else {
        (
            format!("task `{name}` is run once here, and recurrently in {}", recurrent.place),
            "run once",
            "keep one of the two, or give this one a task of its own",
        )
    };
    Finding::new(Code::EntaskConflict, other.instruction.span, message)
        .label(label)
        .related(recurrent.instruction.span, "recurrent here")
        .help(help)
}
