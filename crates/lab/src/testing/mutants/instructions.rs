//! The mutations of instructions, and of whole rungs and branches.
//!
//! An instruction that is alone in its rung or branch has no `instruction-out`: the mutant without
//! the rung or branch is the same.

use rungd_engine::isa::{Bit, BitSpace, Mnemonic, OperandRole, StageId, Word, status::st};
use rungd_language::resolve::instruction::{OperandList, OperandValue, ResolvedOperand};
use rungd_language::resolve::program::{Contact, Instruction, ProgramPart, Rung, Value};

use super::formula::formulas;
use super::ground::{ExchangedText, FoundMutation, Ground, MutationSite, change_of_constant};
use super::kind::MutantKind;
use super::mutation::{InstructionIndex, Mutation};
use super::values::ConstantStep;
use super::word_bits::{other_bit_of_word, with_number};

/// The mutations that leave out the rung, or one of its branches.
pub(super) fn rung_mutations(ground: &Ground, rung: &Rung) -> Vec<FoundMutation> {
    let place = ground.place(rung.extent);
    let rung_out = |what: &str| FoundMutation {
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
        found.push(FoundMutation {
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
pub(super) fn instructions(ground: &Ground, part: ProgramPart, rung: &Rung) -> Vec<FoundMutation> {
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
            search.other_bits();
            search.constants();
            found.append(&mut search.found);
            found.extend(formulas(ground, instruction, index));
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

/// The instructions that an author might confuse.
const OPPOSITES: [(Mnemonic, Mnemonic); 7] = [
    (Mnemonic::Out, Mnemonic::Set),
    (Mnemonic::Set, Mnemonic::Rst),
    (Mnemonic::Rst, Mnemonic::Set),
    (Mnemonic::Pd, Mnemonic::Nd),
    (Mnemonic::Nd, Mnemonic::Pd),
    (Mnemonic::Add, Mnemonic::Sub),
    (Mnemonic::Sub, Mnemonic::Add),
];

/// The mutations of one instruction.
struct InstructionSearch<'g, 'a> {
    ground: &'g Ground<'a>,
    instruction: &'g Instruction,
    index: InstructionIndex,
    found: Vec<FoundMutation>,
}

impl InstructionSearch<'_, '_> {
    fn left_out(&mut self) {
        let what = format!("`{}` left out", self.text());
        let site = MutationSite::new(MutantKind::InstructionOut, self.instruction.span);
        self.push(site, what, Mutation::Instruction(self.index, None));
    }

    /// Replaces the instruction by its opposite. An OUT that is always ON has the same effect as a
    /// SET.
    fn opposite(&mut self, stays_on: bool) {
        let mnemonic = match OPPOSITES
            .iter()
            .find(|(opposite_of, _)| *opposite_of == self.instruction.mnemonic)
        {
            Some((Mnemonic::Out, _)) if stays_on => return,
            // `ADD a 0` is `SUB a 0`.
            Some(_) if self.values().nth(1).is_some_and(is_zero) => return,
            Some((_, opposite)) => *opposite,
            None => return,
        };
        let rest = self.text().split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim());
        let what = format!("`{}` is `{} {rest}`", self.text(), mnemonic.spec().name);
        let site = MutationSite::new(MutantKind::Instruction, self.instruction.span);
        let rows = mnemonic.spec().operands;
        let operands = self.instruction.operands.0.iter().map(|operand| {
            let row = rows.iter().find(|row| row.name == operand.row.name);
            ResolvedOperand { row: row.unwrap_or(operand.row), ..*operand }
        });
        let operands = OperandList(operands.collect());
        self.replaced(site, what, Instruction { mnemonic, operands, ..self.instruction.clone() });
    }

    /// Exchanges each Stage that the instruction enters for the next Stage of its Program.
    fn stages(&mut self, part: ProgramPart) {
        let entered: Vec<StageId> =
            self.instruction.operands_with(OperandRole::Enters).map(|stage| stage.value).collect();
        for (at, operand) in self.instruction.operands.0.iter().enumerate() {
            let OperandValue::Stage(old) = operand.value else { continue };
            let is_entered = operand.row.role == OperandRole::Enters;
            let Some(new) = next(part, old, &entered).filter(|_| is_entered) else { continue };
            let name = |id: StageId| {
                let stages = &part.block.stages;
                stages.iter().find(|stage| stage.id == id).map_or("", |stage| stage.name.as_str())
            };
            let what = format!("`{}` is `{}` in `{}`", name(old), name(new), self.text());
            let mut changed = self.instruction.clone();
            changed.operands.0[at].value = OperandValue::Stage(new);
            self.replaced(MutationSite::new(MutantKind::Stage, operand.span), what, changed);
        }
    }

    /// Exchanges each bit of a word that the instruction writes for another bit of the same word.
    fn other_bits(&mut self) {
        for (at, operand) in self.instruction.operands.0.iter().enumerate() {
            let OperandValue::Bit(bit) = operand.value else { continue };
            let Some(other) = other_bit_of_word(bit) else { continue };
            let written = self.ground.text_of(operand.span);
            let written = written.rsplit('=').next().unwrap_or(written);
            let new = with_number(written, bit, other);
            let what = format!("`{written}` is `{new}` in `{}`", self.text());
            let mut changed = self.instruction.clone();
            changed.operands.0[at].value = OperandValue::Bit(Bit::InWord(other));
            self.replaced(MutationSite::new(MutantKind::WordBit, operand.span), what, changed);
        }
    }

    /// The numbers that the instruction reads.
    fn values(&self) -> impl Iterator<Item = Value> {
        self.instruction.operands.of().map(|(_, value)| value.value)
    }

    /// Exchanges the constants that the instruction reads for their neighbours.
    fn constants(&mut self) {
        let to_bits = self.instruction.written_array().is_some_and(|array| array.is_bits());
        let numbers = self.instruction.operands.0.iter().filter_map(|operand| {
            let OperandValue::Value(value) = operand.value else { return None };
            Some((operand.row, value, operand.span))
        });
        for (number, (row, value, span)) in numbers.enumerate() {
            let written = match value {
                Value::Const(_, written) => Some(written),
                Value::Real(_) | Value::Word(_) | Value::Element(_) => None,
            };
            let period = self.ground.period;
            let step = ConstantStep::of(row.kind, written, period, to_bits);
            let is_preset = row.key.is_some_and(|key| key.ends_with("preset"));
            let step = if is_preset { step.of_preset() } else { step };
            for (to, new) in step.neighbours(value) {
                let is_known = self.is_stored_alike(value, new)
                    || self.stores_nothing_new(number, new)
                    || self.is_shared_preset();
                if is_known {
                    continue;
                }
                let place = self.ground.constant_place(span);
                let texts = ExchangedText { old: &step.text(value), new: &step.text(new) };
                let what = change_of_constant(self.ground.text(place), texts);
                let before = row.key.map_or_else(String::new, |key| format!("{key} "));
                let what = format!("{before}{what} in `{}`", self.text());
                let mutation = Mutation::Value(self.index, number, new);
                let site =
                    MutationSite { kind: MutantKind::Number, span: place, variant: to as u32 };
                self.at(site, what, mutation);
            }
        }
    }

    /// The word that MOVE, ADD or SUB stores in.
    fn stored(&self) -> Option<Word> {
        let stores = self.instruction.acting_role() == Some(OperandRole::Stores);
        self.instruction.first_operand().map(|word| word.value).filter(|_| stores)
    }

    /// Whether MOVE limits both numbers to the same value of its word.
    fn is_stored_alike(&self, old: Value, new: Value) -> bool {
        let Some(word) = self.stored().filter(|_| self.values().count() == 1) else { return false };
        let (Value::Const(old, _), Value::Const(new, _)) = (old, new) else { return false };
        let (low, high) = self.ground.limits(word);
        !word.is_real() && old.clamp(low, high) == new.clamp(low, high)
    }

    /// Whether the instruction would store the value that its word already has, as `ADD D0 0
    /// to=D0`. That is the same as the instruction left out.
    fn stores_nothing_new(&self, number: usize, new: Value) -> bool {
        let Some(word) = self.stored() else { return false };
        let values: Vec<Value> = self.values().collect();
        let other = match *values.as_slice() {
            [a, b] if self.instruction.mnemonic == Mnemonic::Add => [b, a][number.min(1)],
            [a, _] if number == 1 => a,
            _ => return false,
        };
        is_zero(new) && other == Value::Word(word)
    }

    /// Whether a second instruction sets the preset of the same Sensaphone counter: both presets
    /// must be equal.
    fn is_shared_preset(&self) -> bool {
        let constant = |instruction: &Instruction| {
            let counter = instruction.owned_sensaphone()?;
            instruction.preset()?.value.constant().map(|_| counter)
        };
        let Some(own) = constant(self.instruction) else { return false };
        let all = self.ground.program.instructions();
        all.filter(|(_, other)| constant(other) == Some(own)).count() > 1
    }

    fn text(&self) -> &str {
        self.ground.text_of(self.instruction.span)
    }

    fn replaced(&mut self, site: MutationSite, what: String, new: Instruction) {
        self.push(site, what, Mutation::Instruction(self.index, Some(Box::new(new))));
    }

    fn push(&mut self, site: MutationSite, what: String, mutation: Mutation) {
        let span = self.ground.place(site.span);
        self.at(MutationSite { span, ..site }, what, mutation);
    }

    fn at(&mut self, site: MutationSite, what: String, mutation: Mutation) {
        let branch = self.index.branch.map(|at| at + 1);
        let MutationSite { kind, span: place, variant } = site;
        self.found.push(FoundMutation { kind, place, variant, what, branch, mutation });
    }
}

fn is_zero(value: Value) -> bool {
    value.constant() == Some(0.0)
}

/// The Stage after a Stage in its Program; after the last Stage, the first one. Skips the Stages in
/// `but`.
fn next(part: ProgramPart, current: StageId, but: &[StageId]) -> Option<StageId> {
    let stages = &part.block.stages;
    let at = stages.iter().position(|stage| stage.id == current)?;
    let others = stages.iter().cycle().skip(at + 1).take(stages.len());
    let mut others = others.map(|stage| stage.id);
    others.find(|id| !but.contains(id))
}
