//! The rules over the resolved program as a whole.
//!
//! The loader calls [`check`] after the resolver has made a program, and [`silence()`] with all
//! findings of the load. Each rule has its own file; the file's header shows a ladder that passes
//! and a ladder that fails. A rule only reads the program and adds findings (the mistake, its
//! place, and the text to write instead). All rules run, even if other rules have findings.

pub use context::CheckInputs;
pub use outside_operands::OutsideOperands;
pub use outside_operands::OutsideRead;

use crate::resolve::program::Program;
use crate::source::finding::{Code, Finding};
use rungd_base::progress::LoadStep;

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
mod edge_in_clk;
mod entask_conflict;
mod implied;
mod input_named_twice;
mod input_unmapped;
mod jump_outside_stage;
mod limited_pack;
mod limited_word_bit;
mod lost_fraction;
mod mixed_and_or;
mod multi_scan_in_task;
mod names;
mod never_written;
mod never_written_outside;
mod out_elsewhere;
mod out_lost_on_jump_back;
mod outside_operands;
mod owned_twice;
mod reach;
mod reset_never_set;
mod reset_without_owner;
mod retained_but_reset;
mod runs_through;
mod scan_order;
mod self_reset_loses_time;
mod sensaphone_preset;
mod set_never_reset;
mod shared_history;
pub mod silence;
mod stage_never_entered;
mod stored;
mod subroutine_nesting;
mod subroutine_never_called;
mod subroutine_rule;
mod subroutine_rungs;
mod task_starts_itself;
#[cfg(test)]
mod testing;
mod unused_tag;
mod usage;
mod whole_word_over_out;
mod writers;

pub use silence::silence;

type CheckRule = fn(&context::Context, &mut Vec<Finding>);

/// The part of a program that a rule needs for correct findings.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum RuleNeeds {
    /// One contact or instruction by itself.
    Itself,
    /// The places of instructions. Parts that are left out of the program can hide findings, but
    /// cause no false findings.
    Place,
    /// The whole program: the rule reports that something is missing.
    Whole,
}

const RULES: &[(RuleNeeds, Code, CheckRule)] = &[
    (RuleNeeds::Place, Code::OwnedTwice, owned_twice::check),
    (RuleNeeds::Whole, Code::ResetWithoutOwner, reset_without_owner::check),
    (RuleNeeds::Place, Code::SensaphonePreset, sensaphone_preset::check_different),
    (RuleNeeds::Whole, Code::SensaphonePreset, sensaphone_preset::check_missing),
    (RuleNeeds::Place, Code::JumpOutsideStage, jump_outside_stage::check),
    (RuleNeeds::Itself, Code::BuiltInTask, built_in_task::check),
    (RuleNeeds::Place, Code::BlockRule, block_rule::check),
    (RuleNeeds::Place, Code::SubroutineRule, subroutine_rule::check),
    (RuleNeeds::Place, Code::SubroutineNesting, subroutine_nesting::check),
    (RuleNeeds::Place, Code::SubroutineRungs, subroutine_rungs::check),
    (RuleNeeds::Place, Code::EntaskConflict, entask_conflict::check),
    (RuleNeeds::Place, Code::DuplicateOut, duplicate_out::check),
    (RuleNeeds::Place, Code::LimitedWordBit, limited_word_bit::check),
    (RuleNeeds::Place, Code::OutElsewhere, out_elsewhere::check),
    (RuleNeeds::Place, Code::WholeWordOverOut, whole_word_over_out::check),
    (RuleNeeds::Place, Code::LimitedPack, limited_pack::check),
    (RuleNeeds::Whole, Code::OutLostOnJumpBack, out_lost_on_jump_back::check),
    (RuleNeeds::Whole, Code::RunsThrough, runs_through::check),
    (RuleNeeds::Whole, Code::StageNeverEntered, stage_never_entered::check),
    (RuleNeeds::Whole, Code::BlockNeverStarted, block_never_started::check),
    (RuleNeeds::Whole, Code::SubroutineNeverCalled, subroutine_never_called::check),
    (RuleNeeds::Place, Code::SharedHistory, shared_history::check),
    (RuleNeeds::Whole, Code::SetNeverReset, set_never_reset::check),
    (RuleNeeds::Whole, Code::ResetNeverSet, reset_never_set::check),
    (RuleNeeds::Whole, Code::NeverWritten, never_written::check),
    (RuleNeeds::Whole, Code::NeverWritten, never_written_outside::check),
    (RuleNeeds::Itself, Code::InputNamedTwice, input_named_twice::check),
    (RuleNeeds::Whole, Code::InputUnmapped, input_unmapped::check),
    (RuleNeeds::Whole, Code::MultiScanInTask, multi_scan_in_task::check),
    (RuleNeeds::Place, Code::TaskStartsItself, task_starts_itself::check),
    (RuleNeeds::Itself, Code::ConstantCompare, constant_compare::check),
    (RuleNeeds::Itself, Code::ConstantSaturates, constant_saturates::check),
    (RuleNeeds::Itself, Code::LostFraction, lost_fraction::check),
    (RuleNeeds::Itself, Code::BareTimerValue, bare_timer_value::check),
    (RuleNeeds::Itself, Code::DurationAsCount, duration_as_count::check),
    (RuleNeeds::Itself, Code::MixedAndOr, mixed_and_or::check),
    (RuleNeeds::Itself, Code::EdgeInClk, edge_in_clk::check),
    (RuleNeeds::Itself, Code::SelfResetLosesTime, self_reset_loses_time::check),
    (RuleNeeds::Place, Code::RetainedButReset, retained_but_reset::check),
    (RuleNeeds::Whole, Code::UnusedTag, unused_tag::check),
];

/// All findings of the rules, with places in files.
pub fn check(program: &Program, around: CheckInputs) -> Vec<Finding> {
    program.layers.placed_findings(check_whole(program, around))
}

/// All findings of the rules, in order of place. A place may be in a layer of the program.
pub fn check_whole(program: &Program, around: CheckInputs) -> Vec<Finding> {
    apply(program, around, RuleNeeds::Whole)
}

/// The correct findings for a program with parts left out because of mistakes. `misplaced`: headers
/// are misplaced, so places may differ from the intended ones. Then rules that need places do not
/// run.
pub fn check_partial(program: &Program, around: CheckInputs, misplaced: bool) -> Vec<Finding> {
    apply(program, around, if misplaced { RuleNeeds::Itself } else { RuleNeeds::Place })
}

fn apply(program: &Program, around: CheckInputs, most: RuleNeeds) -> Vec<Finding> {
    let context = context::Context::new(program, around, most == RuleNeeds::Whole);
    let mut findings = Vec::new();
    let rules = RULES.iter().filter(|(needs, ..)| *needs <= most);
    for (_, code, rule) in around.progress.during(rules) {
        around.progress.begin(LoadStep::Rule(code.name()));
        rule(&context, &mut findings);
    }
    findings.sort_by_key(|finding| (finding.span.file, finding.span.start, finding.code));
    findings
}
