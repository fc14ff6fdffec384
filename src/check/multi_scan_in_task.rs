//! `multi-scan-in-task`: an instruction that works over several scans, in a task that runs once.
//!
//! A run-once task executes once and terminates, so a timer never gets to time and a counter is
//! reset behind every run. `FirstScan` and `LastScan` run once by nature. An ENTASK without `every`
//! starts its task at once, and is left out.
//!
//! Passes:
//!
//! ```toml
//! rung = [ { when = ["$On"], do = ["ENTASK Report every=1s"] } ]
//! ```
//!
//! Fails, with a timer in `Report`:
//!
//! ```toml
//! rung = [ { when = ["X0"], do = ["ENTASK Report"] } ]
//! ```

use std::collections::BTreeMap;

use crate::isa::{BlockId, Mnemonic};
use crate::resolve::program::BlockKind;
use crate::source::finding::{Code, Finding};
use crate::source::span::Span;

use super::context::{Context, Placed};
use super::entask_conflict::is_recurrent;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let mut run_once: BTreeMap<BlockId, Span> = BTreeMap::new();
    for entask in context.of(&[Mnemonic::Entask]).filter(|p| !is_recurrent(p)) {
        if let Some((task, _)) = entask.target_block() {
            run_once.entry(task).or_insert(entask.instruction.span);
        }
    }
    for placed in context.instructions.iter().filter(|p| works_over_scans(p)) {
        let block = placed.place.block;
        let started = match block.kind {
            BlockKind::FirstScan | BlockKind::LastScan => None,
            BlockKind::Task if run_once.contains_key(&block.id) => run_once.get(&block.id),
            _ => continue,
        };
        findings.push(finding(placed, started.copied()));
    }
}

fn works_over_scans(placed: &Placed) -> bool {
    placed.mnemonic().spec().multi_scan
        && (placed.mnemonic() != Mnemonic::Entask || is_recurrent(placed))
}

fn finding(placed: &Placed, started: Option<Span>) -> Finding {
    let task = &placed.place.block.name;
    let message = format!(
        "{} works over several scans, but task `{task}` executes once and terminates",
        placed.name()
    );
    let finding = Finding::new(Code::MultiScanInTask, placed.instruction.span, message)
        .label("executes once a run");
    match started {
        Some(span) => finding.related(span, "run once from here").help(format!(
            "move it to a program, or run the task at an interval: `ENTASK {task} every=100ms`"
        )),
        None => finding.help("move it to a program, such as `Main`"),
    }
}
