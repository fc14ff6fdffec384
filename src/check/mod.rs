//! The rules over the resolved program: what every name alone cannot tell.
//!
//! The loader calls [`check`] when the resolver gave a program, and [`silence`] over all findings
//! of the load. One rule a file; each header shows what passes and what fails. A rule only reads,
//! says what is wrong where, and what to write instead; it does not stop at another rule's finding.

use crate::resolve::program::Program;
use crate::resolve::range::Range;
use crate::source::finding::Finding;

mod bare_timer_value;
mod block_never_started;
mod block_rule;
mod built_in_task;
mod conditions;
mod constant_compare;
mod context;
mod duplicate_out;
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

const RULES: &[Rule] = &[
    owned_twice::check,
    reset_without_owner::check,
    sensaphone_preset::check,
    jump_outside_stage::check,
    built_in_task::check,
    block_rule::check,
    entask_conflict::check,
    duplicate_out::check,
    out_elsewhere::check,
    out_lost_on_jump_back::check,
    stage_never_entered::check,
    block_never_started::check,
    set_never_reset::check,
    multi_scan_in_task::check,
    task_starts_itself::check,
    constant_compare::check,
    bare_timer_value::check,
    mixed_and_or::check,
    retained_but_reset::check,
    unused_tag::check,
];

/// All findings of the rules, in order of place; `retained` is what the controller file retains.
pub fn check(program: &Program, retained: &[Range]) -> Vec<Finding> {
    let context = context::Context::new(program, retained);
    let mut findings = Vec::new();
    for rule in RULES {
        rule(&context, &mut findings);
    }
    findings.sort_by_key(|finding| (finding.span.file, finding.span.start, finding.code));
    findings
}
