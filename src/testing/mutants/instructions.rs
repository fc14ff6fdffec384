//! The mutations of instructions, and of whole rungs and branches.
//!
//! An instruction that is alone in its rung or branch has no `instruction-out`: the mutant without
//! the rung or branch is the same.

use crate::isa::{Bit, BitSpace, Mnemonic, StageId, status::st};
use crate::resolve::instruction::{Coil, Source, WordPlace};
use crate::resolve::program::{Action, Contact, Instruction, ProgramPart, Rung, Value};
use crate::source::span::{Located, Span};

use super::formula::formulas;
use super::ground::{Found, Ground, change_of_constant};
use super::kind::MutantKind;
use super::mutation::{InstructionIndex, Mutation};
use super::values::{ConstantStep, values_mut};

/// The mutations that leave out the rung, or one of its branches.
pub(super) fn wholes(ground: &Ground, rung: &Rung) -> Vec<Found> {
    let place = ground.place(rung.extent);
    let rung_out = |what: &str| Found {
        kind: MutantKind::RungOut,
        place,
        variant: 0,
        what: what.to_owned(),
        branch: None,
        mutation: Mutation::RungOut,
    };
    let mut found = vec![rung_out("the rung left out")];
    let is_all = rung.body.is_empty() && rung.branches.len() == 1;
    for (at, branch) in rung.branches.iter().enumerate().filter(|_| !is_all) {
        let Some(span) = branch.body.first().map(|first| first.span) else { continue };
        found.push(Found {
            kind: MutantKind::BranchOut,
            place: ground.place(span),
            variant: 0,
            what: "the branch left out".to_owned(),
            branch: Some(at + 1),
            mutation: Mutation::BranchOut(at),
        });
    }
    found
}

/// All mutations of a rung's instructions, in file order.
pub(super) fn instructions(ground: &Ground, part: ProgramPart, rung: &Rung) -> Vec<Found> {
    let mut found = Vec::new();
    let behind = rung.branches.iter().enumerate();
    let behind = behind.map(|(at, branch)| (Some(at), &branch.body));
    for (branch, body) in std::iter::once((None, &rung.body)).chain(behind) {
        let is_alone = body.len() == 1 && (branch.is_some() || rung.branches.is_empty());
        for (at, instruction) in body.iter().enumerate() {
            let index = InstructionIndex { branch, at };
            let mut search = InstructionSearch { ground, instruction, index, found: Vec::new() };
            if !is_alone {
                search.left_out();
            }
            let stays_on = branch.is_none() && stays_on(part, rung);
            search.opposite(stays_on);
            search.stages(part);
            search.values();
            found.append(&mut search.found);
            found.extend(formulas(ground, (instruction, index)));
        }
    }
    found
}

/// Whether a rung is ON in every scan of a RUN.
fn stays_on(part: ProgramPart, rung: &Rung) -> bool {
    let contacts = || rung.legs.iter().flat_map(|leg| &leg.contacts);
    part.stage.is_none() && part.block.name == "Main" && contacts().all(is_on)
}

fn is_on(contact: &Contact) -> bool {
    matches!(contact, Contact::Bit(Bit::Space(BitSpace::St, st::ON), _))
}

/// The mutations of one instruction.
struct InstructionSearch<'g, 'a> {
    ground: &'g Ground<'a>,
    instruction: &'g Instruction,
    index: InstructionIndex,
    found: Vec<Found>,
}

impl InstructionSearch<'_, '_> {
    fn left_out(&mut self) {
        let what = format!("`{}` left out", self.text());
        let key = (MutantKind::InstructionOut, self.instruction.span, 0);
        self.push(key, what, Mutation::Instruction(self.index, None));
    }

    /// Replaces the instruction by its opposite. An OUT that is always ON has the same effect as a
    /// SET.
    fn opposite(&mut self, stays_on: bool) {
        let new = match &self.instruction.action {
            Action::Coil { coil, bit } => {
                let (mnemonic, other) = match coil {
                    Coil::Out if stays_on => return,
                    Coil::Out => (Mnemonic::Set, Coil::Set),
                    Coil::Set => (Mnemonic::Rst, Coil::Rst),
                    Coil::Rst => (Mnemonic::Set, Coil::Set),
                    Coil::Pd => (Mnemonic::Nd, Coil::Nd),
                    Coil::Nd => (Mnemonic::Pd, Coil::Pd),
                    Coil::Ponoff => return,
                };
                (mnemonic, Action::Coil { coil: other, bit: *bit })
            }
            Action::SetElement { on, bit } => {
                let mnemonic = if *on { Mnemonic::Rst } else { Mnemonic::Set };
                (mnemonic, Action::SetElement { on: !on, bit: *bit })
            }
            Action::Store { source, to } => {
                let (mnemonic, source) = match source {
                    Source::Value(_) => return,
                    Source::Sum(_, b) | Source::Difference(_, b) if is_zero(b.value) => return,
                    Source::Sum(a, b) => (Mnemonic::Sub, Source::Difference(*a, *b)),
                    Source::Difference(a, b) => (Mnemonic::Add, Source::Sum(*a, *b)),
                };
                (mnemonic, Action::Store { source, to: *to })
            }
            Action::Counter { .. }
            | Action::UpDownCounter { .. }
            | Action::DelayTimer { .. }
            | Action::Timer { .. }
            | Action::Sensaphone { .. }
            | Action::Reset { .. }
            | Action::Math { .. }
            | Action::Copy { .. }
            | Action::Fill { .. }
            | Action::Shift { .. }
            | Action::Run { .. }
            | Action::Restart { .. }
            | Action::Halt { .. }
            | Action::Exit
            | Action::Entask { .. }
            | Action::Jump { .. }
            | Action::StageOn { .. }
            | Action::StageOff { .. }
            | Action::Converge { .. }
            | Action::Stop => return,
        };
        let (mnemonic, action) = new;
        let rest = self.text().split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim());
        let what = format!("`{}` is `{} {rest}`", self.text(), mnemonic.spec().name);
        let key = (MutantKind::Instruction, self.instruction.span, 0);
        self.new_action(key, what, (mnemonic, action));
    }

    /// Exchanges each Stage that the instruction turns ON for the next Stage of its Program.
    fn stages(&mut self, part: ProgramPart) {
        match &self.instruction.action {
            Action::Jump { stages } => {
                for (at, target) in stages.iter().enumerate() {
                    let Some(new) = next(part, *target, stages) else { continue };
                    let mut stages = stages.clone();
                    stages[at].value = new;
                    self.stage(part, (*target, new), Action::Jump { stages });
                }
            }
            Action::Converge { stages, to } => {
                let Some(new) = next(part, *to, &[*to]) else { return };
                let other = Located { value: new, span: to.span };
                let action = Action::Converge { stages: stages.clone(), to: other };
                self.stage(part, (*to, new), action);
            }
            Action::Coil { .. }
            | Action::SetElement { .. }
            | Action::Counter { .. }
            | Action::UpDownCounter { .. }
            | Action::DelayTimer { .. }
            | Action::Timer { .. }
            | Action::Sensaphone { .. }
            | Action::Reset { .. }
            | Action::Store { .. }
            | Action::Math { .. }
            | Action::Copy { .. }
            | Action::Fill { .. }
            | Action::Shift { .. }
            | Action::Run { .. }
            | Action::Restart { .. }
            | Action::Halt { .. }
            | Action::Exit
            | Action::Entask { .. }
            | Action::StageOn { .. }
            | Action::StageOff { .. }
            | Action::Stop => {}
        }
    }

    fn stage(&mut self, part: ProgramPart, (old, new): (Located<StageId>, StageId), of: Action) {
        let name = |id: StageId| {
            let stages = &part.block.stages;
            stages.iter().find(|stage| stage.id == id).map_or("", |stage| stage.name.as_str())
        };
        let what = format!("`{}` is `{}` in `{}`", name(old.value), name(new), self.text());
        let key = (MutantKind::Stage, old.span, 0);
        self.new_action(key, what, (self.instruction.mnemonic, of));
    }

    /// Exchanges the constants that the instruction reads for their neighbours.
    fn values(&mut self) {
        let mnemonic = self.instruction.mnemonic;
        let mut action = self.instruction.action.clone();
        let to_bits = matches!(&action, Action::Fill { to, .. } if to.value.is_bits());
        for (number, read) in values_mut(&mut action).into_iter().enumerate() {
            let written = match *read.value {
                Value::Const(_, written) => Some(written),
                Value::Real(_) | Value::Word(_) | Value::Element(_) => None,
            };
            let (of, period_ms) = ((mnemonic, read.operand), self.ground.period_ms);
            let Some(step) = ConstantStep::of(of, written, period_ms, to_bits) else { continue };
            for (to, new) in step.neighbours(*read.value) {
                let is_known = self.is_stored_alike(*read.value, new)
                    || self.stores_nothing_new(number, new)
                    || self.is_shared_preset();
                if is_known {
                    continue;
                }
                let place = self.ground.constant_place(read.span);
                let texts = (&*step.text(*read.value), &*step.text(new));
                let what = change_of_constant(self.ground.text(place), texts);
                let before = match mnemonic.spec().operand(read.operand).and_then(|row| row.key) {
                    Some(key) => format!("{key} "),
                    None => String::new(),
                };
                let what = format!("{before}{what} in `{}`", self.text());
                let mutation = Mutation::Value(self.index, number, new);
                self.at((MutantKind::Number, place, to as u32), what, mutation);
            }
        }
    }

    /// Whether MOVE limits both numbers to the same value of its word.
    fn is_stored_alike(&self, old: Value, new: Value) -> bool {
        let Action::Store { source: Source::Value(_), to } = &self.instruction.action else {
            return false;
        };
        let (Value::Const(old, _), Value::Const(new, _)) = (old, new) else { return false };
        let WordPlace::Word(word) = to.value else { return false };
        let (low, high) = self.ground.limits(word);
        !word.is_real() && old.clamp(low, high) == new.clamp(low, high)
    }

    /// Whether the instruction would store the value that its word already has, as `ADD D0 0
    /// to=D0`. That is the same as the instruction left out.
    fn stores_nothing_new(&self, number: usize, new: Value) -> bool {
        let Action::Store { source, to } = &self.instruction.action else { return false };
        let WordPlace::Word(word) = to.value else { return false };
        let other = match source {
            Source::Sum(a, b) => [b, a][number.min(1)],
            Source::Difference(a, _) if number == 1 => a,
            Source::Value(_) | Source::Difference(..) => return false,
        };
        is_zero(new) && other.value == Value::Word(word)
    }

    /// Whether a second instruction sets the preset of the same Sensaphone counter: both presets
    /// must be equal.
    fn is_shared_preset(&self) -> bool {
        let constant = |action: &Action| {
            let Action::Sensaphone { n, preset: Some(preset), .. } = action else { return None };
            preset.value.constant().map(|_| n.value)
        };
        let Some(own) = constant(&self.instruction.action) else { return false };
        let all = self.ground.program.instructions();
        all.filter(|(_, other)| constant(&other.action) == Some(own)).count() > 1
    }

    fn text(&self) -> &str {
        self.ground.text_of(self.instruction.span)
    }

    fn new_action(
        &mut self,
        key: (MutantKind, Span, u32),
        what: String,
        (mnemonic, action): (Mnemonic, Action),
    ) {
        let new = Instruction { mnemonic, span: self.instruction.span, action };
        self.push(key, what, Mutation::Instruction(self.index, Some(Box::new(new))));
    }

    fn push(&mut self, (kind, span, variant): (MutantKind, Span, u32), what: String, of: Mutation) {
        self.at((kind, self.ground.place(span), variant), what, of);
    }

    fn at(
        &mut self,
        (kind, place, variant): (MutantKind, Span, u32),
        what: String,
        mutation: Mutation,
    ) {
        let branch = self.index.branch.map(|at| at + 1);
        self.found.push(Found { kind, place, variant, what, branch, mutation });
    }
}

fn is_zero(value: Value) -> bool {
    value.constant() == Some(0.0)
}

/// The Stage after a Stage in its Program; after the last Stage, the first one. Skips the Stages in
/// `but`.
fn next(part: ProgramPart, of: Located<StageId>, but: &[Located<StageId>]) -> Option<StageId> {
    let stages = &part.block.stages;
    let at = stages.iter().position(|stage| stage.id == of.value)?;
    let others = stages.iter().cycle().skip(at + 1).take(stages.len());
    let mut others = others.map(|stage| stage.id);
    others.find(|id| but.iter().all(|taken| taken.value != *id))
}
