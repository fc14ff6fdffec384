//! `out-lost-on-jump-back`: a jump to an earlier stage drops a bit that both stages drive.
//!
//! In the scan after the jump, the earlier stage executes first and drives the bit. Then the stage
//! that was left terminates and turns the bit OFF: the output drops for one scan. The same applies
//! to stages that SGCONVRG leaves, and to a bit that the target SETs; such a bit may stay OFF
//! permanently. With a jump to a later stage, the termination comes first, so nothing is lost and
//! nothing is reported.
//!
//! Passes: the stages contain no OUT; a program later in the file drives the bit.
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

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use crate::resolve::program::Block;
use crate::source::finding::{Code, Finding, RELATED_MAX};
use crate::source::span::Span;
pub use rungd_engine::isa::{Address, Bit, BlockId, Mnemonic, OperandRole, StageId};

use super::conditions::PLACES_MAX;
use super::context::{Context, ProgramInstruction};
use super::jump_outside_stage::is_jump;
use super::names::list;

/// Maximum number of bits in one finding: nobody would paste a longer help.
const LOST_MAX: usize = 16;
/// Maximum number of stages in a condition.
const STAGES_MAX: usize = 16;

/// The stage that a jump leaves, and the stage that it enters.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct StagePair {
    left: StageId,
    target: StageId,
}

/// The bits that a jump turns OFF for a scan.
struct LostBits<'l> {
    stages: StagePair,
    bits: &'l [Bit],
}

/// The bits that each stage writes, and the names that a help needs.
#[derive(Default)]
struct Stages<'a> {
    /// The bits that each stage drives, each with the first places that drive it.
    driven: BTreeMap<StageId, BTreeMap<Bit, Vec<Span>>>,
    /// The bits that each stage SETs.
    set: BTreeMap<StageId, BTreeSet<Bit>>,
    /// The bits that the stages of each block write.
    of_blocks: HashMap<(BlockId, Bit), BitOfStages<'a>>,
    /// The names of all blocks.
    block_names: HashSet<&'a str>,
}

/// The instructions in the stages of a block that write a bit. A list of all would be long for each
/// of many thousand helps, so it has only the first.
#[derive(Default)]
struct BitOfStages<'a> {
    /// The first drivers, one more than a condition has places.
    drivers: Vec<ProgramInstruction<'a>>,
    /// Whether one of the instructions is not an OUT.
    has_non_out: bool,
    /// The first stages that drive or SET the bit, as many as a condition names.
    stages: Vec<StageId>,
}

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let stages = Stages::of(context);
    let mut helps: HashMap<(BlockId, Vec<Bit>), String> = HashMap::new();
    let mut losses: HashMap<StagePair, Vec<Bit>> = HashMap::new();
    for jump in context.instructions() {
        for pair in context.progress.during(jumps_back(context, jump)) {
            let lost = losses.entry(pair).or_insert_with(|| stages.lost(pair));
            if !lost.is_empty() {
                let block = jump.place.block;
                let help = helps
                    .entry((block.id, lost.clone()))
                    .or_insert_with(|| help(context, &stages, block, lost));
                let lost = LostBits { stages: pair, bits: lost };
                findings.push(finding(context, &stages, jump, &lost).help(help.as_str()));
            }
        }
    }
}

impl<'a> Stages<'a> {
    fn of(context: &Context<'a>) -> Stages<'a> {
        let names = context.program.blocks.iter().map(|block| block.name.as_str());
        let mut stages = Stages { block_names: names.collect(), ..Stages::default() };
        for placed in context.instructions() {
            let Some(stage) = placed.place.stage else { continue };
            if let Some(bit) = placed.instruction.driven() {
                let driven = stages.driven.entry(stage.id).or_default();
                driven.entry(bit.value).or_default().push(bit.span);
                stages.note(placed, stage.id, bit.value);
            } else if let Some(bit) = placed.instruction.operand_with(OperandRole::TurnsOn) {
                stages.set.entry(stage.id).or_default().insert(bit.value);
                stages.note(placed, stage.id, bit.value);
            }
        }
        for places in stages.driven.values_mut().flat_map(BTreeMap::values_mut) {
            places.sort_unstable();
            places.truncate(RELATED_MAX);
        }
        stages
    }

    /// Adds an instruction that drives or SETs a bit to those of its block.
    fn note(&mut self, placed: &ProgramInstruction<'a>, stage: StageId, bit: Bit) {
        let writes = self.of_blocks.entry((placed.place.block.id, bit)).or_default();
        writes.has_non_out |= placed.mnemonic() != Mnemonic::Out;
        if placed.instruction.driven().is_some() && writes.drivers.len() <= PLACES_MAX {
            writes.drivers.push(*placed);
        }
        if writes.stages.last() != Some(&stage) && writes.stages.len() < STAGES_MAX {
            writes.stages.push(stage);
        }
    }

    fn drives(&self, stage: StageId, bit: Bit) -> bool {
        self.driven.get(&stage).is_some_and(|bits| bits.contains_key(&bit))
    }

    fn sets(&self, stage: StageId, bit: Bit) -> bool {
        self.set.get(&stage).is_some_and(|bits| bits.contains(&bit))
    }

    /// The bits that the left stage drives and that the target drives or SETs. Goes through the
    /// bits of the stage that has fewer.
    fn lost(&self, StagePair { left, target }: StagePair) -> Vec<Bit> {
        let Some(bits) = self.driven.get(&left) else { return Vec::new() };
        let (driven, set) = (self.driven.get(&target), self.set.get(&target));
        if driven.map_or(0, BTreeMap::len) + set.map_or(0, BTreeSet::len) < bits.len() {
            let driven = driven.into_iter().flat_map(BTreeMap::keys);
            let written: BTreeSet<Bit> = driven.chain(set.into_iter().flatten()).copied().collect();
            return written
                .into_iter()
                .filter(|bit| bits.contains_key(bit))
                .take(LOST_MAX)
                .collect();
        }
        let bits = bits.keys().copied();
        bits.filter(|bit| self.drives(target, *bit) || self.sets(target, *bit))
            .take(LOST_MAX)
            .collect()
    }
}

/// The pairs (left, target) in which the left stage terminates after the target's execution in the
/// same scan.
fn jumps_back(context: &Context, jump: &ProgramInstruction) -> Vec<StagePair> {
    let at = |stage: StageId| context.program.stages[stage.0 as usize].1;
    let here = jump.place.stage.map(|stage| stage.id);
    let awaited = jump.instruction.operands_with(OperandRole::Awaits).map(|stage| stage.value);
    let own = here.into_iter().filter(|_| is_jump(jump));
    let left: Vec<StageId> = awaited.chain(own).collect();
    // Stages after the jump in the file have their turn in this scan, the others in the next
    // scan.
    let this_scan = |stage: StageId| here.is_none_or(|here| at(stage) > at(here));
    let targets: Vec<StageId> = jump.instruction.stages_entered().collect();
    let pairs = left
        .iter()
        .flat_map(|left| targets.iter().map(|target| StagePair { left: *left, target: *target }));
    let is_back = |pair: &StagePair| at(pair.left) > at(pair.target);
    let in_one_scan = |pair: &StagePair| this_scan(pair.left) == this_scan(pair.target);
    pairs.filter(|pair| is_back(pair) && in_one_scan(pair)).collect()
}

fn finding(
    context: &Context,
    stages: &Stages,
    jump: &ProgramInstruction,
    LostBits { stages: StagePair { left, target }, bits: lost }: &LostBits<'_>,
) -> Finding {
    let names: Vec<String> = lost.iter().map(|bit| context.say_bit(*bit)).collect();
    let (left_name, target_name) =
        (&context.program.stage(*left).name, &context.program.stage(*target).name);
    let message = format!(
        "this jump back turns {} OFF for a scan: stage `{left_name}` terminates after stage \
         `{target_name}`, which drives {} too",
        list(&names),
        if lost.len() == 1 { "it" } else { "them" },
    );
    let mut finding = Finding::new(Code::OutLostOnJumpBack, jump.instruction.span, message)
        .label(format!("`{target_name}` comes before `{left_name}`"));
    let driven = |stage: StageId, bit: &Bit| stages.driven.get(&stage)?.get(bit);
    for bit in *lost {
        let mut places: Vec<Span> =
            [left, target].into_iter().filter_map(|s| driven(*s, bit)).flatten().copied().collect();
        places.sort_unstable();
        for place in places {
            finding = finding.related(place, "driven here");
        }
    }
    finding
}

/// The help: a program to paste, which drives the bits from the bits of the stages.
fn help<'a>(context: &Context<'a>, stages: &Stages<'a>, block: &Block, lost: &[Bit]) -> String {
    let mut name = format!("{}Outputs", block.name);
    while stages.block_names.contains(name.as_str()) {
        name.push('2');
    }
    let bits: Vec<String> = lost.iter().map(|b| context.name(Address::Bit(*b))).collect();
    let mut text = format!(
        "take {} out of the stages of `{}`, and drive {} in a program after it:\n\
         [[program]]\nname = \"{name}\"\nautostart = true\nrung = [",
        list(&bits.iter().map(|bit| format!("`{bit}`")).collect::<Vec<_>>()),
        block.name,
        if lost.len() == 1 { "it" } else { "them" },
    );
    for (bit, bit_name) in lost.iter().zip(&bits) {
        let when = condition(context, stages, block, *bit);
        text.push_str(&format!("\n  {{ when = [\"{when}\"], do = [\"OUT {bit_name}\"] }},"));
    }
    text.push_str("\n]");
    text
}

/// The stages that turn the bit ON, with the conditions of their OUTs if they can be printed.
fn condition<'a>(context: &Context<'a>, stages: &Stages<'a>, block: &Block, bit: Bit) -> String {
    let Some(writes) = stages.of_blocks.get(&(block.id, bit)) else { return String::new() };
    let power = |placed: &ProgramInstruction<'a>| context.power_from_outside(&placed.place);
    let powers = writes.drivers.iter().map(|placed| power(placed).filter(|_| !writes.has_non_out));
    context.any_of(powers).unwrap_or_else(|| {
        let names = writes.stages.iter().map(|id| context.name(Address::Bit(Bit::Stage(*id))));
        names.collect::<Vec<_>>().join(" | ")
    })
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check;

    #[test]
    fn the_help_shows_a_rung_that_can_be_pasted() {
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
                  after stage `A`, which drives them too
                    take `Y0` and `Y1` out of the stages of `Day`, and drive them in a
                    program after it:
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
    fn jumps_to_the_same_stage_or_a_later_stage_are_not_reported() {
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
            rung = [ { when = ["X2"], do = ["OUT Y0", "EXIT"] } ]
            "#,
            expect![[""]],
        );
    }

    #[test]
    fn diverging_and_converging_jumps_back_are_reported() {
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
                  this jump back turns `Y0` OFF for a scan: stage `C` terminates after
                  stage `A`, which drives it too
                    take `Y0` out of the stages of `Day`, and drive it in a program after
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
                    enter it, for example from stage `C`: `do = ["JMP D"]`
                22:44 out-lost-on-jump-back
                  this jump back turns `Y1` OFF for a scan: stage `D` terminates after
                  stage `B`, which drives it too
                    take `Y1` out of the stages of `Day`, and drive it in a program after
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
