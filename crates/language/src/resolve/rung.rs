//! Resolves rungs: checks their legs against the instruction's legs, then resolves contacts and
//! instructions. Called by `plain`, once per block.

use std::collections::HashMap;
use std::sync::LazyLock;

use super::Resolver;
use super::block_kind::BlockKind;
use super::names::{NAME_MAX, kept};
use super::program::{Block, Branch, Leg, Rung};
use crate::source::atom::AtomKind;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{
    FixEdit, Help, advise, certain, dialect, moved_to_when, pair, possible, propose,
};
use crate::source::instruction::WrittenInstruction;
use crate::source::instruction_commas::in_form;
use crate::source::ladder;
use crate::source::nearest::{KnownNames, nearest};
use crate::source::reader::Text;
use crate::source::renaming;
use crate::source::span::Span;
pub use rungd_engine::isa::{BlockId, Function, LegName, Mnemonic, Spec, dialects};

/// The table rows of a rung's instructions; `None` for an unknown instruction.
type Specs = Vec<Option<&'static Spec>>;

/// The names of all instructions, for the help about an unknown instruction.
static INSTRUCTIONS: LazyLock<KnownNames> = LazyLock::new(|| {
    KnownNames::new(rungd_engine::isa::instruction::TABLE.iter().map(|spec| spec.name))
});

impl Resolver<'_> {
    /// Resolves all rungs of a block and its stages.
    pub(super) fn rungs(&mut self, written: &ladder::WrittenBlock, block: &mut Block) {
        let mut names = HashMap::new();
        block.rungs = self.series(&written.rungs, block.id, &mut names);
        for (written, stage) in written.stages.iter().zip(&mut block.stages) {
            stage.rungs = self.series(&written.rungs, block.id, &mut names);
        }
    }

    fn series(
        &mut self,
        rungs: &[ladder::WrittenRung],
        block: BlockId,
        names: &mut HashMap<String, Span>,
    ) -> Vec<Rung> {
        let mut resolved = Vec::new();
        for rung in rungs {
            if self.options.progress.is_over() {
                break;
            }
            if let Some(name) = &rung.name {
                self.rung_name(name, names);
            }
            resolved.push(self.rung(rung, block));
        }
        resolved
    }

    fn rung_name(&mut self, name: &Text, names: &mut HashMap<String, Span>) {
        let part = |part: &str| {
            !part.is_empty() && part.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit())
        };
        if name.text.len() > NAME_MAX {
            let message = format!("this name of a rung has {} characters", name.text.len());
            let finding = Finding::new(Code::ForbiddenName, name.span, message);
            self.find(finding.help(format!("a name has at most {NAME_MAX}")));
        } else if !name.text.rsplit('/').next().is_some_and(|own| own.split('-').all(part)) {
            let message = format!("`{}` is not in kebab-case", name.text);
            let finding = Finding::new(Code::ForbiddenName, name.span, message);
            let finding = finding.help("a rung's name reads `count-bottles`");
            self.find(finding.fix(possible(renaming::kebab(&name.text))));
        }
        if let Some(first) = names.insert(name.text.clone(), name.span) {
            let message = format!("this block has a rung `{}` already", name.text);
            let finding = Finding::new(Code::DuplicateName, name.span, message);
            let fix = renaming::another(&name.text, '-', |name| names.contains_key(name));
            self.find(finding.label("again here").related(first, "first here").fix(fix));
        }
    }

    fn rung(&mut self, rung: &ladder::WrittenRung, block: BlockId) -> Rung {
        let specs = self.specs(&rung.body, block);
        let branch_specs: Vec<Specs> =
            rung.branches.iter().map(|branch| self.specs(&branch.body, block)).collect();
        let is_iec = self.is_iec_counter(rung);
        let legs = match (&rung.when, rung.legs.is_empty()) {
            _ if is_iec => {
                rung.when.iter().chain(&rung.legs).for_each(|leg| {
                    self.contacts(&leg.contacts);
                });
                Vec::new()
            }
            (Some(when), true) => self.when_rung(rung, when, &specs, &branch_specs),
            (None, false) => self.leg_rung(rung, &specs),
            // The rung has both or neither, which the reader has reported.
            _ => Vec::new(),
        };
        let body = match is_iec {
            true => Vec::new(),
            false => self.body(&rung.body, &specs, block),
        };
        let branches = rung.branches.iter().zip(&branch_specs).map(|(branch, specs)| Branch {
            contacts: self.contacts(&branch.contacts),
            body: self.body(&branch.body, specs, block),
        });
        Rung {
            branches: branches.collect(),
            name: rung.name.as_ref().map(|name| kept(&name.text)),
            doc: rung.doc.clone(),
            allow: rung.allow.iter().map(|name| self.allowed(name)).collect(),
            extent: rung.extent,
            of_use: self.layers.use_of(rung.extent).map(str::to_owned),
            legs,
            body,
        }
    }

    fn body(
        &mut self,
        body: &[WrittenInstruction],
        specs: &Specs,
        block: BlockId,
    ) -> Vec<super::program::Instruction> {
        let known = body.iter().zip(specs).filter_map(|(text, spec)| Some((text, (*spec)?)));
        known.filter_map(|(text, spec)| self.instruction(text, spec, block)).collect()
    }

    /// The table rows of instructions.
    fn specs(&mut self, body: &[WrittenInstruction], block: BlockId) -> Specs {
        body.iter().map(|instruction| self.spec(instruction, block)).collect()
    }

    fn spec(&mut self, instruction: &WrittenInstruction, block: BlockId) -> Option<&'static Spec> {
        let name = instruction.mnemonic.value.as_str();
        if let Some(mnemonic) = Mnemonic::from_name(name) {
            return Some(mnemonic.spec());
        }
        let span = instruction.mnemonic.span;
        if let Some(mnemonic) = Mnemonic::from_name(&name.to_ascii_uppercase()) {
            let right = mnemonic.spec().name;
            let message = format!("`{name}` is written `{right}`");
            let finding = Finding::new(Code::WrongCase, span, message);
            self.find(finding.write(certain(right)));
            return Some(mnemonic.spec());
        }
        let message = format!("there is no instruction `{name}`");
        let finding = Finding::new(Code::UnknownInstruction, span, message);
        let function = Function::from_name(&name.to_ascii_lowercase());
        if let Some(help) = iec_timer(instruction).or_else(|| self.own_form(instruction, block)) {
            self.find(finding.help(help.at(instruction.span)));
            return None;
        }
        self.find(match (dialects::instead_of(name), function) {
            (Some(help), _) => {
                let operands: Vec<String> =
                    instruction.operands.iter().map(|operand| operand.value.to_string()).collect();
                let finding = finding.help(dialect(help).at(instruction.span));
                let finding = match dialects::is_superfluous(name) {
                    true => finding.or_omit(),
                    false => finding,
                };
                finding.fixes(in_form(help, &operands).map(|fix| fix.at(instruction.span)))
            }
            (None, Some(function)) => {
                let form = function.spec().form();
                finding.help(format!("a function stands in MATH: `MATH R0 = {form}`"))
            }
            (None, None) => {
                finding.help("`rungd explain` lists all instructions").near(name, &INSTRUCTIONS)
            }
        });
        None
    }

    /// The help for a contact or an instruction of another controller, with its own operands.
    fn own_form(&self, instruction: &WrittenInstruction, block: BlockId) -> Option<Help> {
        let name = &instruction.mnemonic.value;
        let operands: Vec<String> =
            instruction.operands.iter().map(|operand| operand.value.to_string()).collect();
        let operands: Vec<&str> = operands.iter().map(String::as_str).collect();
        if instruction.operands.iter().any(|operand| operand.key.is_some()) {
            return None;
        }
        let is_subroutine = || {
            self.scope.block_of(block).is_some_and(|(_, names)| names.kind == BlockKind::Subroutine)
        };
        match dialects::instruction(name, &operands) {
            // What ends elsewhere is said by the table of dialects.
            Some(right) if right == "RETURN" && !is_subroutine() => None,
            Some(right) => Some(propose(right)),
            None => Some(moved_to_when(&dialects::contact(name, &operands)?)),
        }
    }

    /// Resolves the leg of a rung with `when`.
    fn when_rung(
        &mut self,
        rung: &ladder::WrittenRung,
        when: &ladder::WrittenLeg,
        specs: &Specs,
        branch_specs: &[Specs],
    ) -> Vec<Leg> {
        let alone = rung.body.len() == 1 && rung.branches.is_empty();
        for (instruction, spec) in rung.body.iter().zip(specs) {
            let Some(spec) = spec.filter(|spec| spec.legs != [LegName::When]) else { continue };
            let finding = if alone {
                self.wants_legs(spec, instruction, when)
            } else {
                self.legs_shared(spec, instruction, Some(when))
            };
            self.find(finding);
        }
        for (branch, specs) in rung.branches.iter().zip(branch_specs) {
            for (instruction, spec) in branch.body.iter().zip(specs) {
                if let Some(spec) = spec.filter(|spec| spec.legs != [LegName::When]) {
                    let finding = self.legs_shared(spec, instruction, None);
                    self.find(finding);
                }
            }
        }
        vec![self.leg(LegName::When, when)]
    }

    fn wants_legs(
        &self,
        spec: &Spec,
        instruction: &WrittenInstruction,
        when: &ladder::WrittenLeg,
    ) -> Finding {
        let name = spec.name;
        let keys: Vec<String> = spec.legs.iter().map(|leg| format!("`{}`", leg.key())).collect();
        let message = format!("`{name}` has the legs {}, and no `when`", keys.join(", "));
        let help = self.leg_lines(spec, Some(when));
        Finding::new(Code::MissingLeg, when.key.span, message)
            .label("names no leg")
            .related(instruction.mnemonic.span, "of this instruction")
            .help(advise(
                "write its legs instead of `when`:\n{}",
                [FixEdit::Lines { lines: help, instead: Some("when") }],
            ))
    }

    /// The lines of a help with an instruction's legs; the first leg gets the contacts of `when`.
    fn leg_lines(&self, spec: &Spec, when: Option<&ladder::WrittenLeg>) -> String {
        let lines = spec.legs.iter().enumerate().map(|(at, leg)| {
            let array = match when {
                Some(when) if at == 0 => self.text(when.span),
                _ if at == 0 => "[\"$On\"]",
                _ => "[\"$Off\"]",
            };
            format!("leg.{:<3} = {array}", leg.key())
        });
        lines.collect::<Vec<_>>().join("\n")
    }

    fn legs_shared(
        &self,
        spec: &Spec,
        instruction: &WrittenInstruction,
        when: Option<&ladder::WrittenLeg>,
    ) -> Finding {
        let message = format!("`{}` has legs, and so stands alone in its rung", spec.name);
        let lines = self.leg_lines(spec, when);
        let text = self.text(instruction.span);
        Finding::new(Code::LegsShared, instruction.span, message)
            .label("give it a rung of its own")
            .help(format!(
                "a rung of its own, with the legs that it is to have:\n{lines}\n\
                 do      = [\"{text}\"]"
            ))
    }

    /// Resolves the legs of a rung with `leg.*`, in the order of its instruction's legs.
    fn leg_rung(&mut self, rung: &ladder::WrittenRung, specs: &Specs) -> Vec<Leg> {
        let legged = |spec: &Option<&'static Spec>| {
            spec.as_ref().is_some_and(|spec| spec.legs != [LegName::When])
        };
        if let Some(at) = specs.iter().position(legged) {
            let spec = specs[at].unwrap_or_else(|| unreachable!("it has legs"));
            if let Some(other) = (0..specs.len()).find(|other| *other != at) {
                let finding = legs_not_alone(spec, &rung.body[at]);
                self.find(finding.related(rung.body[other].span, "stands beside it"));
            }
            if let Some(branch) = rung.branches.first() {
                let finding = legs_not_alone(spec, &rung.body[at]);
                self.find(finding.related(branch.span, "this branch is in the same rung"));
            }
            return self.match_legs(rung, spec, &rung.body[at]);
        }
        if let (Some(Some(spec)), Some(body)) = (specs.first(), rung.body.first()) {
            for (at, leg) in rung.legs.iter().enumerate() {
                let elsewhere = reset_elsewhere(spec, body, &leg.key.text);
                if let Some(help) = elsewhere {
                    let message = format!("`{}` has no leg `{}`", spec.name, leg.key.text);
                    let finding = Finding::new(Code::UnknownLeg, leg.key.span, message);
                    self.find(finding.help(help).or_omit());
                } else if at == 0 {
                    self.find(one_leg(spec, leg, self.text(leg.span)));
                }
            }
        } else if let (true, Some(branch)) = (rung.body.is_empty(), rung.branches.first()) {
            let message = "a rung with `leg.*` has one instruction in its `do`, and no branch";
            self.find(Finding::new(Code::LegsShared, branch.span, message));
        }
        for leg in &rung.legs {
            self.contacts(&leg.contacts);
        }
        Vec::new()
    }

    fn match_legs(
        &mut self,
        rung: &ladder::WrittenRung,
        spec: &Spec,
        instruction: &WrittenInstruction,
    ) -> Vec<Leg> {
        let names: Vec<&str> = spec.legs.iter().map(|leg| leg.key()).collect();
        let unknown = rung.legs.iter().filter(|leg| !names.contains(&leg.key.text.as_str()));
        let unknown: Vec<&ladder::WrittenLeg> = unknown.collect();
        let given = |name: LegName| rung.legs.iter().find(|leg| leg.key.text == name.key());
        let mut missing: Vec<LegName> =
            spec.legs.iter().copied().filter(|name| given(*name).is_none()).collect();
        let mut unclear = false;
        for (at, leg) in unknown.iter().enumerate() {
            let message = format!("`{}` has no leg `{}`", spec.name, leg.key.text);
            // One unknown leg and one missing leg are one mistake.
            let last = at + 1 == unknown.len();
            let help = if let Some(help) = reset_elsewhere(spec, instruction, &leg.key.text) {
                Help::from(help).with(possible(FixEdit::Omit))
            } else if let Some(meant) = leg_meant(&leg.key.text, &missing, last) {
                missing.retain(|name| *name != meant);
                propose(pair(format!("leg.{} = {}", meant.key(), self.text(leg.span))))
            } else {
                unclear = true;
                let list = names.iter().map(|n| format!("`leg.{n}`")).collect::<Vec<_>>();
                let array = self.text(leg.span);
                let right =
                    |name: &LegName| pair(format!("leg.{} = {array}", name.key())).possible();
                let help = Help::from(format!("its legs are {}", list.join(", ")));
                help.with_all(missing.iter().map(right)).with(possible(FixEdit::Omit))
            };
            self.find(Finding::new(Code::UnknownLeg, leg.key.span, message).help(help));
            self.contacts(&leg.contacts);
        }
        // If a leg's name is unclear, the help must not suggest `$Off` for it.
        if !unclear {
            missing.iter().for_each(|name| self.find(missing_leg(spec, instruction, *name)));
        }
        let legs = spec.legs.iter().filter_map(|name| Some((*name, given(*name)?)));
        legs.map(|(name, leg)| self.leg(name, leg)).collect()
    }

    fn leg(&mut self, name: LegName, leg: &ladder::WrittenLeg) -> Leg {
        Leg { name, contacts: self.contacts(&leg.contacts) }
    }
}

/// The help for IEC's on-delay, with its own timer and time.
fn iec_timer(instruction: &WrittenInstruction) -> Option<Help> {
    let [timer, time] = instruction.operands.as_slice() else { return None };
    let is_time = time
        .key
        .as_ref()
        .is_none_or(|key| ["pt", "preset"].contains(&key.value.to_ascii_lowercase().as_str()));
    let is_clear = matches!(time.value.kind, AtomKind::Duration(_));
    let is_on_delay = instruction.mnemonic.value.eq_ignore_ascii_case("TON");
    (is_on_delay && is_clear && is_time && timer.key.is_none())
        .then(|| format!("TMR {} preset={}", timer.value, time.value))
        .map(|timer| advise("an on-delay: write `{}`", [timer]))
}

/// The missing leg that an unknown key probably means.
fn leg_meant(key: &str, missing: &[LegName], last: bool) -> Option<LegName> {
    let words = key.to_ascii_lowercase();
    let meant = match words.as_str() {
        "reset" | "res" | "r" | "clear" | "clr" => "rst",
        "down" | "cd" | "dec" => "dn",
        "cu" | "inc" | "count" => "up",
        "enable" | "run" | "in" => "en",
        "clock" | "shift" => "clk",
        other => other,
    };
    let near = missing
        .iter()
        .find(|name| name.key() == meant)
        .copied()
        .or_else(|| LegName::from_key(nearest(&words, missing.iter().map(|name| name.key()))?));
    near.or_else(|| missing.first().copied().filter(|_| last && missing.len() == 1))
}

/// The help for a reset leg of an instruction that has none.
fn reset_elsewhere(spec: &Spec, instruction: &WrittenInstruction, key: &str) -> Option<String> {
    let resets = [(Mnemonic::Udcg, "RSTCT"), (Mnemonic::Tmrag, "RSTT")];
    let (_, reset) = resets.into_iter().find(|(global, _)| *global == spec.mnemonic)?;
    let is_reset = leg_meant(key, &[LegName::Rst], false).is_some();
    let structure = instruction.operands.first().map(|operand| operand.value.to_string());
    is_reset.then(|| {
        let structure = structure.unwrap_or_default();
        let name = spec.name;
        format!("{name} has no reset leg: reset it by `{reset} {structure}` in a rung of its own")
    })
}

fn missing_leg(spec: &Spec, instruction: &WrittenInstruction, leg: LegName) -> Finding {
    let message =
        format!("`{}` has a leg `{}`, which is missing in the rung", spec.name, leg.key());
    Finding::new(Code::MissingLeg, instruction.mnemonic.span, message)
        .label(format!("`leg.{}` is missing", leg.key()))
        .help(advise(
            "if nothing drives it, write:\n{}",
            [FixEdit::Lines { lines: format!("leg.{} = [\"$Off\"]", leg.key()), instead: None }],
        ))
}

fn legs_not_alone(spec: &Spec, instruction: &WrittenInstruction) -> Finding {
    let message = format!("`{}` has legs, and so stands alone in its rung", spec.name);
    Finding::new(Code::LegsShared, instruction.span, message).help(
        "move the other part into a rung of its own, with this instruction's flags in its `when`",
    )
}

fn one_leg(spec: &Spec, leg: &ladder::WrittenLeg, array: &str) -> Finding {
    let message = format!("`{}` has no leg `{}`: its only one is `when`", spec.name, leg.key.text);
    Finding::new(Code::UnknownLeg, leg.key.span, message).propose(pair(format!("when = {array}")))
}
