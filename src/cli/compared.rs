//! The report of `rungd replay --ladder`: one line for each operand that differs, and the operands
//! of its trace.
//!
//! `playback` compares; `replay_ladder` prints the report.

use super::recorded_trace::seconds;
use super::when::LocalClock;
use rungd_history::playback::{ComparedAs, ComparedOperand, ProgramComparison};
use rungd_lab::traces::trace::TracedOperand;
use rungd_language::source::wording::{counted, thousands};

/// The report: one line for each operand that differs, and the number of operands that differ.
pub(super) fn text(comparison: &ProgramComparison, clock: &LocalClock) -> String {
    let mut text: String =
        comparison.operands.iter().filter_map(|operand| line(operand, clock)).collect();
    let count = |wanted: ComparedAs, what: &str| {
        let compared_operands = || comparison.operands.iter().filter(|o| o.compared_as == wanted);
        let (all, differ) = (
            compared_operands().count() as u64,
            compared_operands().filter(|o| o.first.is_some()).count(),
        );
        (all > 0).then(|| format!("{} of {}", thousands(differ as u64), counted(all, what)))
    };
    let counts: Vec<String> = [
        count(ComparedAs::Output, "output"),
        count(ComparedAs::Alarm, "alarm"),
        count(ComparedAs::Watched, "watched operand"),
    ]
    .into_iter()
    .flatten()
    .collect();
    match counts.is_empty() {
        true => text.push_str("there is no output, alarm or watched operand to compare\n"),
        false => text.push_str(&format!("{} differ\n", counts.join(", "))),
    }
    text
}

/// `feeder (Y0): old ON, new OFF first at …; 4 times, 1.200 s in all`.
fn line(operand: &ComparedOperand, clock: &LocalClock) -> Option<String> {
    let (scan, [was, is]) = (operand.first?.scan, operand.first_texts()?);
    let kind = match operand.compared_as {
        ComparedAs::Alarm => "alarm ",
        ComparedAs::Output | ComparedAs::Watched => "",
    };
    Some(format!(
        "{kind}{}: old {was}, new {is} first at {} (scan {}); {}, {} and {} in all\n",
        operand.label,
        clock.text(scan.unix_ns),
        scan.number,
        counted(operand.times, "time"),
        seconds(operand.ns),
        counted(operand.scans, "scan"),
    ))
}

/// The operands of a trace: for each operand, first the old and then the new one.
pub(super) fn watched(
    comparison: &ProgramComparison,
    only_asked: bool,
) -> (Vec<usize>, Vec<TracedOperand>) {
    let all = comparison.operands.iter().enumerate();
    let chosen = all.filter(|(_, o)| !only_asked || o.compared_as == ComparedAs::Watched);
    let mut places = Vec::new();
    let mut watched = Vec::new();
    for (at, operand) in chosen {
        let Some(cell) = operand.cell() else { continue };
        for (side, place) in [("old", 2 * at), ("new", 2 * at + 1)] {
            let name = format!("{}@{side}", operand.name);
            watched.push(TracedOperand { name, cell, real: operand.real });
            places.push(place);
        }
    }
    (places, watched)
}
