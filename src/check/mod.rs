//! The rules over the resolved program as a whole.
//!
//! The loader calls [`check`] after the resolver has made a program, and [`silence`] with all
//! findings of the load. Each rule has its own file; the file's header shows a ladder that passes
//! and one that fails. A rule only reads the program and adds findings (the mistake, its place, and
//! the text to write instead). All rules run, whatever others find.
#![deny(clippy::wildcard_enum_match_arm)]

use crate::resolve::program::Program;
use crate::resolve::range::Range;
use crate::source::finding::Finding;

mod bare_timer_value;
mod block_never_started;
mod block_rule;
mod built_in_task;
mod conditions;
mod constant_compare;
mod constant_saturates;
mod context;
mod duplicate_out;
mod duration_as_count;
mod entask_conflict;
mod jump_outside_stage;
mod mixed_and_or;
mod multi_scan_in_task;
mod names;
mod out_elsewhere;
mod out_lost_on_jump_back;
mod owned_twice;
mod pages;
mod reach;
mod reset_without_owner;
mod retained_but_reset;
mod sensaphone_preset;
mod set_never_reset;
mod silence;
mod stage_never_entered;
mod task_starts_itself;
#[cfg(test)]
mod testing;
mod unused_tag;

pub use pages::{PAGES, page};
pub use silence::silence;

type Rule = fn(&context::Context, &mut Vec<Finding>);

/// The part of a program that a rule needs for correct findings.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Needs {
    /// One contact or instruction by itself.
    Itself,
    /// The places of instructions. Parts left out of the program hide findings, but cause no false
    /// ones.
    Place,
    /// The whole program: the rule reports that something is missing.
    Whole,
}

const RULES: &[(Needs, Rule)] = &[
    (Needs::Place, owned_twice::check),
    (Needs::Whole, reset_without_owner::check),
    (Needs::Place, sensaphone_preset::check_different),
    (Needs::Whole, sensaphone_preset::check_missing),
    (Needs::Place, jump_outside_stage::check),
    (Needs::Itself, built_in_task::check),
    (Needs::Place, block_rule::check),
    (Needs::Place, entask_conflict::check),
    (Needs::Place, duplicate_out::check),
    (Needs::Place, out_elsewhere::check),
    (Needs::Whole, out_lost_on_jump_back::check),
    (Needs::Whole, stage_never_entered::check),
    (Needs::Whole, block_never_started::check),
    (Needs::Whole, set_never_reset::check),
    (Needs::Whole, multi_scan_in_task::check),
    (Needs::Place, task_starts_itself::check),
    (Needs::Itself, constant_compare::check),
    (Needs::Itself, constant_saturates::check),
    (Needs::Itself, bare_timer_value::check),
    (Needs::Itself, duration_as_count::check),
    (Needs::Itself, mixed_and_or::check),
    (Needs::Place, retained_but_reset::check),
    (Needs::Whole, unused_tag::check),
];

/// All findings of the rules, in order of place; `retained` are the controller file's retained
/// ranges.
pub fn check(program: &Program, retained: &[Range]) -> Vec<Finding> {
    apply(program, retained, Needs::Whole)
}

/// The correct findings for a program with parts left out because of mistakes. `misplaced`: headers
/// are misplaced, so that places may not be the intended ones; rules that need places then do not
/// run.
pub fn check_partial(program: &Program, retained: &[Range], misplaced: bool) -> Vec<Finding> {
    apply(program, retained, if misplaced { Needs::Itself } else { Needs::Place })
}

fn apply(program: &Program, retained: &[Range], most: Needs) -> Vec<Finding> {
    let context = context::Context::new(program, retained, most == Needs::Whole);
    let mut findings = Vec::new();
    for (_, rule) in RULES.iter().filter(|(needs, _)| *needs <= most) {
        rule(&context, &mut findings);
    }
    findings.sort_by_key(|finding| (finding.span.file, finding.span.start, finding.code));
    findings
}
