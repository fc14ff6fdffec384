//! The reasons why operands differ between two programs: the answer of `rungd why` in both, at the
//! scan of the first difference.
//!
//! Called by `replay_ladder`. The past of the recorded program is the recording; the past of the
//! new program is made by executing it again.

use std::sync::Arc;

use super::compared::{Compared, Comparison, FirstDifference};
use rungd_history::observe::{At, Limits, Past, Subject};
use rungd_history::playback::{PlayableProgram, RecordedPast, TwinRun, subject};
use rungd_history::record::Recording;

/// The maximum number of operands that are explained: the operands that differ first.
const EXPLAINED_MAX: usize = 3;
/// The maximum number of sections (about a second each) of the new program's past that are kept.
const SECTIONS_MAX: usize = 60;

/// The reasons of the first differences; empty if nothing differs. The new program begins at the
/// base of section `first`, as in the comparison.
pub(super) fn reasons(
    recording: &Arc<Recording>,
    (first, new, mut again): (usize, &PlayableProgram, TwinRun),
    comparison: &Comparison,
) -> String {
    let mut differing: Vec<(&Compared, FirstDifference)> =
        comparison.operands.iter().filter_map(|o| Some((o, o.first?))).collect();
    differing.sort_by_key(|(_, first)| (first.scan.section, first.scan.number));
    let Some((_, earliest)) = differing.first() else { return String::new() };
    // The sections up to and including the one with the first difference.
    let last = earliest.scan.section;
    let from = recording.base_of(first).unwrap_or(first);
    let mut new_past = again.past(from..last + 1, SECTIONS_MAX);
    let old_subject = subject(recording.program(last)).ok();
    let new_subject = Subject::new(new.program.clone(), new.loaded.files.clone());
    let mut text = String::new();
    let in_it = differing.iter().filter(|(_, first)| first.scan.section == last);
    for (operand, first) in in_it.take(EXPLAINED_MAX) {
        let number = first.scan.number;
        let old = old_subject.as_ref().and_then(|subject| {
            let cell = subject.cell(&operand.name).ok()?;
            let mut past =
                RecordedPast::around(Arc::clone(recording), last, subject.code_for(cell));
            answer(subject, &mut past, operand, number)
        });
        let new = answer(&new_subject, &mut new_past, operand, number);
        for (side, answer) in [("old", old), ("new", new)] {
            if let Some(answer) = answer {
                text.push_str(&format!("\n{side} program, scan {number}:\n{answer}"));
            }
        }
    }
    if !text.is_empty() {
        text.push('\n');
    }
    text
}

/// The reason for the value of an operand at the end of a scan.
fn answer(
    subject: &Subject,
    past: &mut impl Past,
    operand: &Compared,
    number: u64,
) -> Option<String> {
    let cell = subject.cell(&operand.name).ok()?;
    let limits = Limits { change: false, ..Limits::default() };
    let answer = subject.why(past, cell, (At::Scan(number), limits)).ok()?;
    Some(answer.text().lines().map(|line| format!("  {line}\n")).collect())
}
