//! `runs-through`: the condition that enters a Stage also leaves it, in the same scan.
//!
//! A Stage that is entered from an earlier Stage, or by RUN of its Program, executes in the same
//! scan, and the edge contacts in it begin with the history OFF: `rise(next)` is ON there as long
//! as `next` is ON. So one press passes through the Stage without a stop, and a level does too. The
//! rule reports only what is certain: every contact of the way out follows from the way in, and no
//! instruction that executes between writes what they read. A Stage whose way out is always ON is
//! left at once on purpose. A target earlier in the Program executes in the next scan; that is not
//! reported.
//!
//! Passes:
//!
//! ```toml
//! rung = [ { when = ["pulse"], do = ["RST pulse", "JMP S1"] } ]   # PD pulse in Main
//! ```
//!
//! Fails, if Stage S1 has `{ when = ["rise(X0)"], do = ["JMP S2"] }`:
//!
//! ```toml
//! rung = [ { when = ["rise(X0)"], do = ["JMP S1"] } ]
//! ```

use std::collections::HashMap;

use crate::resolve::program::{Contact, Stage};
use crate::source::finding::{Code, Finding};
pub use rungd_engine::isa::{Address, BlockId, Mnemonic, OperandRole, StageId};

use super::context::{Context, DrivingInstruction, ProgramInstruction};
use super::implied::{KnownStates, cases};
use super::jump_outside_stage::is_jump;
use super::scan_order::{Between, OrderedStep, ScanOrder};

/// The maximum number of ways out of a Stage that are tried for each way in.
const WAYS_OUT_MAX: usize = 64;

/// The maximum number of instructions between that may end the target's block.
const ENDS_MAX: usize = 64;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    if !context.program.blocks.iter().any(|block| !block.stages.is_empty()) {
        return;
    }
    let order = ScanOrder::of(context);
    let mut out: HashMap<StageId, Vec<&OrderedStep>> = HashMap::new();
    for step in &order.steps {
        if let Some(stage) = step.placed.place.stage.filter(|stage| leaves(&step.placed, stage)) {
            let ways = out.entry(stage.id).or_default();
            if ways.len() < WAYS_OUT_MAX {
                ways.push(step);
            }
        }
    }
    let rule = ThroughRule { context, order: &order };
    for way_in in context.progress.during(&order.steps) {
        let mut known = None;
        for target in rule.targets(way_in) {
            let Some(ways) = out.get(&target.id) else { continue };
            let known = known.get_or_insert_with(|| rule.known(way_in));
            let entry = StageEntry { way_in, target };
            let through = ways.iter().find(|way| rule.follows(known, entry, way));
            findings.extend(through.map(|way| rule.finding(entry, way)));
        }
    }
}

/// Whether an instruction leaves its own Stage for a different one.
fn leaves(placed: &ProgramInstruction, stage: &Stage) -> bool {
    is_jump(placed) && placed.instruction.stages_entered().all(|to| to != stage.id)
}

/// A Stage, and the instruction that turns it ON.
#[derive(Clone, Copy)]
struct StageEntry<'e, 'a> {
    way_in: &'e OrderedStep<'a>,
    target: &'a Stage,
}

struct ThroughRule<'r, 'a> {
    context: &'r Context<'a>,
    order: &'r ScanOrder<'a>,
}

impl<'a> ThroughRule<'_, 'a> {
    /// The Stages that an instruction turns ON and that then execute in the same scan.
    fn targets(&self, way_in: &OrderedStep<'a>) -> impl Iterator<Item = &'a Stage> {
        let program = self.context.program;
        let own = way_in.placed.place.stage.map(|stage| stage.id);
        let started = way_in.placed.instruction.operand_with::<BlockId>(OperandRole::Starts);
        let started = started.and_then(|block| program.block(block.value).stages.first());
        let entered = way_in.placed.instruction.stages_entered().map(|id| program.stage(id));
        let targets = entered.filter(move |stage| Some(stage.id) != own).chain(started);
        targets.filter(|stage| self.order.stage(stage.id).start >= way_in.rung.1)
    }

    /// What is known if the rung of an instruction is ON, one of the cases. None is known for a
    /// rung without a `when` leg.
    fn known(&self, way_in: &OrderedStep<'a>) -> Vec<KnownStates> {
        let power = self.context.power(&way_in.placed.place);
        power.map_or_else(Vec::new, |power| cases(&power.contacts))
    }

    /// Whether the way out is certainly ON if the way in is.
    fn follows(
        &self,
        known: &[KnownStates],
        entry: StageEntry<'_, 'a>,
        out: &OrderedStep<'a>,
    ) -> bool {
        let Some(power) = self.context.power(&out.placed.place) else { return false };
        let between = self.between(entry, out);
        let contacts = || power.contacts.iter().copied();
        let is_on = |facts: &KnownStates| facts.all(contacts(), &between) == Some(true);
        !is_on(&KnownStates::default())
            && !known.is_empty()
            && known.iter().all(|facts| is_on(facts) && !self.ends(facts, &between, out))
    }

    /// What executes between the contacts of the way in and those of the way out: up to the way
    /// out, and the rest of what may have its termination pass before the target executes.
    fn between(
        &self,
        StageEntry { way_in, target }: StageEntry<'_, 'a>,
        out: &OrderedStep,
    ) -> Between<'_, 'a> {
        let started = self.started(way_in);
        let end = match started {
            Some(block) => self.order.block(block).end,
            None => self.order.stage(target.id).end,
        };
        let until = if out.placed.place.branch.is_some() { out.at } else { out.rung.0 };
        let block = if started.is_some() { None } else { Some(way_in.placed.place.block.id) };
        let positions = [way_in.rung.0..until, out.rung.1..end];
        Between { order: self.order, positions, block }
    }

    /// The Program that an instruction starts.
    fn started(&self, way_in: &OrderedStep<'a>) -> Option<BlockId> {
        way_in.placed.instruction.target_block().map(|block| block.value)
    }

    /// Whether an instruction between certainly ends the block of the way out before it.
    fn ends(&self, facts: &KnownStates, between: &Between, out: &OrderedStep) -> bool {
        let block = out.placed.place.block.id;
        let ends = between.order.moves_of(block, &between.positions[0]);
        let may = ends.len() > ENDS_MAX;
        may || ends.iter().any(|at| {
            let steps = between.order.steps(*at..at + 1);
            steps.iter().filter(|step| ends_block(&step.placed, block)).any(|step| {
                let power = self.context.power(&step.placed.place);
                power.is_none_or(|power| {
                    facts.all(power.contacts.iter().copied(), between) == Some(true)
                })
            })
        })
    }

    fn finding(&self, entry: StageEntry<'_, 'a>, out: &OrderedStep<'a>) -> Finding {
        let StageEntry { way_in, target } = entry;
        let [enters, leaves] = [way_in, out].map(|step| self.said(&step.placed));
        let message = format!(
            "{enters} runs through stage `{}`: {leaves} there is ON in the same scan",
            target.name
        );
        Finding::new(Code::RunsThrough, way_in.placed.instruction.span, message)
            .label(format!("`{}` is left in the scan that enters it", target.name))
            .related(out.placed.instruction.span, "ON in the same scan")
            .help(self.help(entry, out))
    }

    /// An instruction as written.
    fn said(&self, placed: &ProgramInstruction) -> String {
        let program = self.context.program;
        let stages = placed.instruction.stages_entered().map(|id| program.stage(id).name.clone());
        let block = placed.instruction.target_block().map(|block| &program.block(block.value).name);
        let names: Vec<String> = stages.chain(block.cloned()).take(4).collect();
        format!("`{} {}`", placed.name(), names.join(" "))
    }

    fn help(&self, entry: StageEntry<'_, 'a>, out: &OrderedStep<'a>) -> String {
        let StageEntry { way_in, target } = entry;
        let (stage, enters) = (&target.name, self.said(&way_in.placed));
        let wait = format!("let `{stage}` wait for something that comes later");
        let Some(signal) = self.signal(out) else { return wait };
        if let Some(pulse) = self.pulse(out) {
            return format!(
                "{wait}; or let one pulse make one step, and take it away there:\n  \
                 {{ when = [\"{pulse}\"], do = [\"RST {pulse}\", \"{}\"] }},",
                enters.trim_matches('`')
            );
        }
        let mut pulse = "pulse".to_owned();
        while self.context.program.tags.iter().any(|tag| tag.name == pulse) {
            pulse.push('2');
        }
        format!(
            "{wait}; or let one edge make one step: a bit that the step takes away,\n\
             `{pulse} = {{ type = \"bit\" }}` under [tags], in `Main`\n  \
             {{ when = [\"{signal}\"], do = [\"PD {pulse}\"] }},\n\
             and here, as in every stage that waits for it,\n  \
             {{ when = [\"{pulse}\"], do = [\"RST {pulse}\", \"{}\"] }},",
            enters.trim_matches('`')
        )
    }

    /// The bit that the way out waits for, if it is ON for one scan only.
    fn pulse(&self, out: &OrderedStep<'a>) -> Option<String> {
        let power = self.context.power(&out.placed.place)?;
        let [Contact::Bit(bit, _)] = power.contacts.as_slice() else { return None };
        let drivers = self.context.drivers_of(*bit);
        let is_pulse = |driver: &DrivingInstruction| {
            matches!(driver.placed.mnemonic(), Mnemonic::Pd | Mnemonic::Nd)
        };
        drivers.iter().any(is_pulse).then(|| self.context.name(Address::Bit(*bit)))
    }

    /// The contacts that the way out waits for, without their edges.
    fn signal(&self, out: &OrderedStep<'a>) -> Option<String> {
        let power = self.context.power(&out.placed.place)?;
        match power.contacts.as_slice() {
            [Contact::Edge(_, inner, _)] => Some(self.context.program.names.contact(inner)),
            [one] => Some(self.context.program.names.contact(one)),
            _ => None,
        }
    }
}

/// Whether an instruction that names a block ends its execution. A RESTART from a different block
/// lets it begin anew.
fn ends_block(placed: &ProgramInstruction, block: BlockId) -> bool {
    let is_own = placed.place.block.id == block;
    match placed.instruction.target_block() {
        Some(_) if placed.mnemonic() == Mnemonic::Restart => is_own,
        // Something that moves the block stands in the subroutine.
        Some(_) if placed.instruction.called().is_some() => true,
        Some(_) => placed.instruction.acting_role() == Some(OperandRole::Stops),
        None => placed.mnemonic() == Mnemonic::Exit,
    }
}

#[cfg(test)]
mod tests {
    use crate::check::testing::{check_heads, check_only};
    use crate::source::finding::Code;
    use expect_test::{Expect, expect};

    /// A ladder of one Program with these Stages, each with its rungs; `main` has Main's rungs.
    fn stages(main: &str, stages: &[&str]) -> String {
        let mut ladder = format!("[[program]]\nname = \"Main\"\nrung = [ {main} ]\n");
        ladder.push_str("[[program]]\nname = \"Seq\"\n");
        for (at, rungs) in stages.iter().enumerate() {
            ladder.push_str(&format!("[[program.stage]]\nname = \"S{at}\"\nrung = [ {rungs} ]\n"));
        }
        ladder
    }

    fn advice(main: &str, of: &[&str], expected: Expect) {
        check_only(Code::RunsThrough, &stages(main, of), expected);
    }

    fn heads(main: &str, of: &[&str], expected: Expect) {
        check_heads(Code::RunsThrough, &stages(main, of), expected);
    }

    const RUN: &str = r#"{ when = ["$On"], do = ["RUN Seq", "OUT Y9"] }"#;

    #[test]
    fn one_edge_that_passes_several_stages_in_a_scan_is_reported() {
        advice(
            RUN,
            &[
                r#"{ when = ["rise(X0)"], do = ["JMP S1"] }"#,
                r#"{ when = ["$On"], do = ["OUT Y1"] }, { when = ["rise(X0)"], do = ["JMP S2"] }"#,
                r#"{ when = ["rise(X0)"], do = ["JMP S0"] }"#,
            ],
            expect![[r#"
                8:40 runs-through
                  `JMP S1` runs through stage `S1`: `JMP S2` there is ON in the same scan
                    let `S1` wait for something that comes later; or let one edge make one
                    step: a bit that the step takes away,
                    `pulse = { type = "bit" }` under [tags], in `Main`
                    { when = ["X0"], do = ["PD pulse"] },
                    and here, as in every stage that waits for it,
                    { when = ["pulse"], do = ["RST pulse", "JMP S1"] },
                11:77 runs-through
                  `JMP S2` runs through stage `S2`: `JMP S0` there is ON in the same scan
                    let `S2` wait for something that comes later; or let one edge make one
                    step: a bit that the step takes away,
                    `pulse = { type = "bit" }` under [tags], in `Main`
                    { when = ["X0"], do = ["PD pulse"] },
                    and here, as in every stage that waits for it,
                    { when = ["pulse"], do = ["RST pulse", "JMP S2"] },
            "#]],
        );
    }

    #[test]
    fn levels_that_imply_the_next_transition_are_reported() {
        advice(
            RUN,
            &[
                r#"{ when = ["X0 & !X1", "D0 > 5 | T0.Acc >= 3s"], do = ["JMP S1"] }"#,
                r#"{ when = ["!X1"], do = ["JMP S2"] }"#,
                r#"{ when = ["D0 > 3 | T0.Acc >= 3s"], do = ["JMP S3"] }"#,
                r#"{ when = ["X1"], do = ["JMP S4"] }"#,
                r#"{ when = ["X1 | X2", "!X3 | X1"], do = ["SGDIVRG S5 S6"] }"#,
                r#"{ when = ["X1 & X3"], do = ["JMP S7"] }"#,
                r#"{ when = ["$On"], do = ["JMP S7"] }"#,
                r#"{ when = ["X9"], do = ["JMP S0"] }"#,
            ],
            expect![[r#"
                8:65 runs-through
                  `JMP S1` runs through stage `S1`: `JMP S2` there is ON in the same scan
                    let `S1` wait for something that comes later; or let one edge make one
                    step: a bit that the step takes away,
                    `pulse = { type = "bit" }` under [tags], in `Main`
                    { when = ["!X1"], do = ["PD pulse"] },
                    and here, as in every stage that waits for it,
                    { when = ["pulse"], do = ["RST pulse", "JMP S1"] },
                17:34 runs-through
                  `JMP S4` runs through stage `S4`: `SGDIVRG S5 S6` there is ON in the
                  same scan
                    let `S4` wait for something that comes later
            "#]],
        );
    }

    #[test]
    fn a_transition_is_reported_only_if_every_alternative_implies_the_next() {
        heads(
            RUN,
            &[
                r#"{ when = ["X0 | X1"], do = ["JMP S1"] }"#,
                r#"{ when = ["rise(X1 | X0 | X2)"], do = ["JMP S2"] }"#,
                r#"{ when = ["X1"], do = ["JMP S3"] }"#,
                r#"{ when = ["fall(X1)"], do = ["JMP S0"] }"#,
            ],
            expect![[r#"
                8:39 `JMP S1` runs through stage `S1`: `JMP S2` there is ON in the same scan
            "#]],
        );
    }

    #[test]
    fn cells_written_between_two_transitions_count_as_unknown() {
        heads(
            r#"{ when = ["X0"], do = ["PD C0", "RUN Seq", "OUT C1"] }"#,
            &[
                r#"{ when = ["C0"], do = ["JMP S1"] }"#,
                r#"{ when = ["C0"], do = ["RST C0", "JMP S2"] }"#,
                r#"{ when = ["C0"], do = ["JMP S3"] }, { when = ["C1"], do = ["JMP S3"] }"#,
                r#"{ when = ["X5"], do = ["MOVE 1 to=D0"] }, { when = ["C1"], do = ["JMP S4"] }"#,
                r#"{ when = ["D0 == 1"], do = ["JMP S5"] }"#,
                r#"{ when = ["D0 == 1"], do = ["TMR T0 preset=1s", "JMP S6"] }"#,
                r#"{ when = ["T0.Done"], do = ["JMP S0"] }"#,
            ],
            expect![[r#"
                8:34 `JMP S1` runs through stage `S1`: `JMP S2` there is ON in the same scan
                14:70 `JMP S3` runs through stage `S3`: `JMP S4` there is ON in the same scan
                20:39 `JMP S5` runs through stage `S5`: `JMP S6` there is ON in the same scan
            "#]],
        );
    }

    #[test]
    fn run_and_the_first_stage_on_the_same_edge_are_reported() {
        heads(
            r#"{ when = ["rise(X0)"], do = ["RUN Seq"] }, { when = ["X1"], do = ["HALT Seq"] }"#,
            &[r#"{ when = ["rise(X0)"], do = ["JMP S1"] }"#, r#"{ when = ["X2"], do = ["EXIT"] }"#],
            expect![[r#"
                3:40 `RUN Seq` runs through stage `S0`: `JMP S1` there is ON in the same scan
            "#]],
        );
    }

    #[test]
    fn a_target_program_earlier_in_the_order_is_not_reported() {
        check_only(
            Code::RunsThrough,
            r#"
            [ladder]
            order = ["Seq", "Main"]
            [[program]]
            name = "Main"
            rung = [ { when = ["rise(X0)"], do = ["RUN Seq"] } ]
            [[program]]
            name = "Seq"
            [[program.stage]]
            name = "S0"
            rung = [ { when = ["rise(X0)"], do = ["JMP S1"] } ]
            [[program.stage]]
            name = "S1"
            rung = [ { when = ["X2"], do = ["EXIT"] } ]
            "#,
            expect![[""]],
        );
    }

    #[test]
    fn a_jump_in_a_block_that_certainly_ends_is_not_reported() {
        heads(
            RUN,
            &[
                r#"{ when = ["X0"], do = ["JMP S1"] }, { when = ["X0"], do = ["EXIT"] }"#,
                r#"{ when = ["X0"], do = ["JMP S2"] }"#,
                r#"{ when = ["X3"], do = ["JMP S0"] }"#,
            ],
            expect![[""]],
        );
    }
}
