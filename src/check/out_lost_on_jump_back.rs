//! `out-lost-on-jump-back`: a jump to an earlier stage drops a bit that both stages drive.
//!
//! In the scan after the jump the earlier stage executes first and drives the bit; then the left
//! stage's turn comes, and its termination turns the bit OFF: the output drops for one scan. The
//! same holds for stages that SGCONVRG leaves, and for a bit that the target SETs, where the one
//! scan may be for good. A jump to a later stage terminates first, and is silent.
//!
//! Passes: the stages hold no OUT; a program behind them drives the bit.
//!
//! ```toml
//! rung = [ { when = ["Day.Green | Day.Amber"], do = ["OUT Y0"] } ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! [[program.stage]]
//! name = "Green"
//! rung = [
//!   { when = ["$On"], do = ["OUT Y0"] },
//!   { when = ["X0"], do = ["JMP Amber"] },
//! ]
//!
//! [[program.stage]]
//! name = "Amber"
//! rung = [
//!   { when = ["$On"], do = ["OUT Y0"] },
//!   { when = ["X1"], do = ["JMP Green"] },
//! ]
//! ```

use std::collections::{BTreeMap, BTreeSet};

use crate::isa::{Address, Bit, Mnemonic, StageId};
use crate::resolve::program::Block;
use crate::source::finding::{Code, Finding};

use super::context::{Context, Placed};
use super::names::list;

type BitsByStage = BTreeMap<StageId, BTreeSet<Bit>>;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let driven = bits_by_stage(context, |placed| placed.driven().map(|(bit, _)| bit));
    let set = bits_by_stage(context, |placed| {
        placed.bit().map(|(bit, _)| bit).filter(|_| placed.mnemonic() == Mnemonic::Set)
    });
    let nothing = BTreeSet::new();
    let of = |stages: &BitsByStage, stage| stages.get(&stage).unwrap_or(&nothing).clone();
    for jump in context.of(&[Mnemonic::Jmp, Mnemonic::Sgdivrg, Mnemonic::Sgconvrg]) {
        for (left, target) in jumps_back(context, jump) {
            let there = &of(&driven, target) | &of(&set, target);
            let lost: Vec<Bit> = of(&driven, left).intersection(&there).copied().collect();
            if !lost.is_empty() {
                findings.push(finding(context, jump, (left, target), &lost));
            }
        }
    }
}

fn bits_by_stage(context: &Context, bit: impl Fn(&Placed) -> Option<Bit>) -> BitsByStage {
    let mut stages = BitsByStage::new();
    for placed in &context.instructions {
        if let (Some(stage), Some(bit)) = (placed.place.stage, bit(placed)) {
            stages.entry(stage.id).or_default().insert(bit);
        }
    }
    stages
}

/// The pairs (left, target) of which the left one terminates behind the target's execution, in
/// the same scan.
fn jumps_back(context: &Context, jump: &Placed) -> Vec<(StageId, StageId)> {
    let at = |stage: StageId| context.program.stages[stage.0 as usize].1;
    let here = jump.place.stage.map(|stage| stage.id);
    let left: Vec<StageId> = match jump.mnemonic() {
        Mnemonic::Sgconvrg => jump.stages("stage").collect(),
        _ => here.into_iter().collect(),
    };
    // What comes behind the jump in the file has its turn in this scan, the rest in the next.
    let this_scan = |stage: StageId| here.is_none_or(|here| at(stage) > at(here));
    let targets: Vec<StageId> = jump.stages_entered().collect();
    let pairs = left.iter().flat_map(|l| targets.iter().map(move |t| (*l, *t)));
    pairs.filter(|(l, t)| at(*l) > at(*t) && this_scan(*l) == this_scan(*t)).collect()
}

fn finding(
    context: &Context,
    jump: &Placed,
    (left, target): (StageId, StageId),
    lost: &[Bit],
) -> Finding {
    let names: Vec<String> = lost.iter().map(|bit| context.say_bit(*bit)).collect();
    let (left_name, target_name) =
        (&context.program.stage(left).name, &context.program.stage(target).name);
    let message = format!(
        "this jump back turns {} OFF for a scan: stage `{left_name}` terminates behind stage \
         `{target_name}`, which drives {} too",
        list(&names),
        if lost.len() == 1 { "it" } else { "them" },
    );
    let mut finding = Finding::new(Code::OutLostOnJumpBack, jump.instruction.span, message)
        .label(format!("`{target_name}` comes before `{left_name}`"))
        .help(help(context, jump.place.block, lost));
    for placed in &context.instructions {
        let driven = placed.driven().filter(|(bit, _)| lost.contains(bit));
        let stage = placed.place.stage.filter(|stage| [left, target].contains(&stage.id));
        if let (Some((_, span)), Some(_)) = (driven, stage) {
            finding = finding.related(span, "driven here");
        }
    }
    finding
}

/// A program to paste: it drives the bits from the stages' bits.
fn help(context: &Context, block: &Block, lost: &[Bit]) -> String {
    let mut name = format!("{}Outputs", block.name);
    while context.program.blocks.iter().any(|b| b.name == name) {
        name.push('2');
    }
    let bits: Vec<String> = lost.iter().map(|b| context.name(Address::Bit(*b))).collect();
    let mut text = format!(
        "take {} out of the stages of `{}`, and drive {} in a program behind it:\n\
         [[program]]\nname = \"{name}\"\nautostart = true\nrung = [",
        list(&bits.iter().map(|bit| format!("`{bit}`")).collect::<Vec<_>>()),
        block.name,
        if lost.len() == 1 { "it" } else { "them" },
    );
    for (bit, bit_name) in lost.iter().zip(&bits) {
        let when = condition(context, block, *bit);
        text.push_str(&format!("\n  {{ when = [\"{when}\"], do = [\"OUT {bit_name}\"] }},"));
    }
    text.push_str("\n]");
    text
}

/// The stages that drive the bit, with the conditions of their OUTs where these can be told.
fn condition(context: &Context, block: &Block, bit: Bit) -> String {
    let drivers: Vec<&Placed> = context
        .instructions
        .iter()
        .filter(|p| p.place.block.id == block.id && p.place.stage.is_some())
        .filter(|p| p.driven().or_else(|| p.bit()).is_some_and(|(driven, _)| driven == bit))
        .collect();
    let outs = drivers.iter().all(|p| p.mnemonic() == Mnemonic::Out);
    let powers: Option<Vec<_>> =
        drivers.iter().map(|p| context.power_from_outside(&p.place)).collect();
    if let Some(when) = powers.filter(|_| outs).and_then(|powers| context.any_of(&powers)) {
        return when;
    }
    let mut stages: Vec<String> = Vec::new();
    for stage in drivers.iter().filter_map(|p| p.place.stage) {
        let name = context.name(Address::Bit(Bit::Stage(stage.id)));
        if !stages.contains(&name) {
            stages.push(name);
        }
    }
    stages.join(" | ")
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn the_help_is_a_program_to_paste() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["RUN Day"] } ]

            [[program]]
            name = "Day"

            [[program.stage]]
            name = "A"
            rung = [
              { when = ["$On"], do = ["OUT Y0", "OUT Y3"] },
              { when = ["X1"], do = ["OUT Y1", "JMP B"] },
            ]

            [[program.stage]]
            name = "B"
            rung = [
              { when = ["X3"], do = ["OUT Y0"] },
              { when = ["X2", "!X3"], do = ["OUT Y1", "JMP A"] },
            ]
            "#,
            expect![[r#"
                19:42 out-lost-on-jump-back
                  this jump back turns `Y0` and `Y1` OFF for a scan: stage `B` terminates
                  behind stage `A`, which drives them too
                    take `Y0` and `Y1` out of the stages of `Day`, and drive them in a
                    program behind it:
                    [[program]]
                    name = "DayOutputs"
                    autostart = true
                    rung = [
                            { when = ["Day.A | (Day.B & X3)"], do = ["OUT Y0"] },
                            { when = ["(Day.A & X1) | (Day.B & X2 & !X3)"], do = ["OUT Y1"] },
                    ]
            "#]],
        );
    }

    #[test]
    fn to_itself_to_a_later_one_and_without_a_common_bit() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["RUN Day"] } ]

            [[program]]
            name = "Day"

            [[program.stage]]
            name = "A"
            rung = [ { when = ["X1"], do = ["OUT Y0", "JMP A", "JMP B"] } ]

            [[program.stage]]
            name = "B"
            rung = [ { when = ["X2"], do = ["OUT Y0", "JMP C"] } ]

            [[program.stage]]
            name = "C"
            rung = [ { when = ["X3"], do = ["OUT Y2", "JMP A"] } ]
            "#,
            expect![[""]],
        );
    }

    #[test]
    fn diverge_converge_and_set() {
        check(
            r#"
            [[program]]
            name = "Main"
            rung = [ { when = ["X0"], do = ["RUN Day"] } ]

            [[program]]
            name = "Day"

            [[program.stage]]
            name = "A"
            rung = [ { when = ["X1"], do = ["SET Y0", "RST Y0", "SGDIVRG B C"] } ]

            [[program.stage]]
            name = "B"
            rung = [ { when = ["X2"], do = ["OUT Y1"] } ]

            [[program.stage]]
            name = "C"
            rung = [ { when = ["X3"], do = ["OUT Y0", "SGCONVRG B C to=A"] } ]

            [[program.stage]]
            name = "D"
            rung = [ { when = ["X3"], do = ["OUT Y1", "SGDIVRG B C"] } ]
            "#,
            expect![[r#"
                18:44 out-lost-on-jump-back
                  this jump back turns `Y0` OFF for a scan: stage `C` terminates behind
                  stage `A`, which drives it too
                    take `Y0` out of the stages of `Day`, and drive it in a program behind
                    it:
                    [[program]]
                    name = "DayOutputs"
                    autostart = true
                    rung = [
                            { when = ["Day.A | Day.C"], do = ["OUT Y0"] },
                    ]
                21:9 stage-never-entered
                  stage `D` of program `Day` is never entered: no JMP, SGSET, SGDIVRG or
                  SGCONVRG leads to it
                    enter it, from stage `C` say: `do = ["JMP D"]`
                22:44 out-lost-on-jump-back
                  this jump back turns `Y1` OFF for a scan: stage `D` terminates behind
                  stage `B`, which drives it too
                    take `Y1` out of the stages of `Day`, and drive it in a program behind
                    it:
                    [[program]]
                    name = "DayOutputs"
                    autostart = true
                    rung = [
                            { when = ["(Day.B & X2) | (Day.D & X3)"], do = ["OUT Y1"] },
                    ]
            "#]],
        );
    }
}
