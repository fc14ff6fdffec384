//! The reasons why operands differ between two programs: the answer of `rungd why` in both, at the
//! scan of the first difference.
//!
//! Called by `replay_ladder`. The past of the recorded program is the recording; the past of the
//! new program is made by executing it again.

use std::sync::Arc;

use rungd_history::observe::{Limits, QuestionTime, Subject};
use rungd_history::playback::{
    self, ComparedOperand, FirstDifference, PlayableProgram, ProgramComparison, RecordedQuestion,
    TwinRun,
};
use rungd_history::record::Recording;

/// The maximum number of operands that are explained: the operands that differ first.
const EXPLAINED_MAX: usize = 3;
/// The maximum number of sections (about a second each) of the new program's past that are kept.
const SECTIONS_MAX: usize = 60;

/// The execution of the new program.
pub(super) struct NewProgramRun<'a> {
    /// The section at whose base the new program begins, as in the comparison.
    pub first: usize,
    pub new: &'a PlayableProgram,
    /// A run that has not begun.
    pub again: TwinRun<'a>,
}

/// The reasons of the first differences; empty if nothing differs.
pub(super) fn reasons(
    recording: &Arc<Recording>,
    NewProgramRun { first, new, mut again }: NewProgramRun,
    comparison: &ProgramComparison,
) -> String {
    let mut differing: Vec<(&ComparedOperand, FirstDifference)> =
        comparison.operands.iter().filter_map(|o| Some((o, o.first?))).collect();
    differing.sort_by_key(|(_, first)| (first.scan.section, first.scan.number));
    let Some((_, earliest)) = differing.first() else { return String::new() };
    // The sections up to and including the one with the first difference.
    let last = earliest.scan.section;
    let from = recording.base_of(first).unwrap_or(first);
    let mut new_past = again.past(from..last + 1, SECTIONS_MAX);
    let old_subject = playback::subject(recording.program(last)).ok();
    let new_subject = Subject::new(new.program.clone(), new.loaded.files.clone());
    let limits = Limits { change: false, ..Limits::default() };
    let mut text = String::new();
    let in_it = differing.iter().filter(|(_, first)| first.scan.section == last);
    for (operand, first) in in_it.take(EXPLAINED_MAX) {
        let (number, at) = (first.scan.number, QuestionTime::Scan(first.scan.number));
        let question = RecordedQuestion { section: last, at, limits };
        let old = old_subject.as_ref();
        let old = old.and_then(|old| playback::why(old, recording, &operand.name, question).ok());
        let new = new_subject.cell(&operand.name).ok();
        let new = new.and_then(|cell| new_subject.why(&mut new_past, cell, at, limits).ok());
        for (side, answer) in [("old", old), ("new", new)] {
            let Some(answer) = answer else { continue };
            text.push_str(&format!("\n{side} program, scan {number}:\n"));
            answer.text().lines().for_each(|line| text.push_str(&format!("  {line}\n")));
        }
    }
    if !text.is_empty() {
        text.push('\n');
    }
    text
}
