//! Instructions of a ladder as acts: coils, MOVE and sums. Timers and counters: `owners`.

use super::elements::MovingPlace;
use super::formula_values::{FormulaResult, StoredValue};
use super::functions::{difference, of_two, sum};
use super::library::LibraryBlock;
use super::project::{CallSource, CoilAction, NetworkPower, off, on};
use super::refusal::{self, ExportRefusal};
use super::rung_acts::{ExportedNumber, InstructionLegs, RungExport};
use rungd_engine::isa::{Address, Bit, LegName, Mnemonic};
use rungd_language::resolve::formula::{Binary, Formula, FormulaPart, NumberType};
use rungd_language::resolve::operand_list::{FormulaTarget, WordPlace};
use rungd_language::resolve::program::{Edge, Instruction, Value};

/// The instructions that write a bit.
const BITS: [Mnemonic; 6] =
    [Mnemonic::Out, Mnemonic::Set, Mnemonic::Rst, Mnemonic::Pd, Mnemonic::Nd, Mnemonic::Ponoff];
/// Those of them that are coils.
const COILS: [(Mnemonic, CoilAction); 3] = [
    (Mnemonic::Out, CoilAction::Assign),
    (Mnemonic::Set, CoilAction::Set),
    (Mnemonic::Rst, CoilAction::Reset),
];
/// The instructions that write a word.
const STORES: [Mnemonic; 3] = [Mnemonic::Move, Mnemonic::Add, Mnemonic::Sub];
/// The instructions that reset a timer or counter.
const RESETS: [Mnemonic; 2] = [Mnemonic::Rstt, Mnemonic::Rstct];
/// The instructions of Stages.
const STAGES: &[Mnemonic] =
    &[Mnemonic::Jmp, Mnemonic::Sgset, Mnemonic::Sgrst, Mnemonic::Sgdivrg, Mnemonic::Sgconvrg];
/// The instructions that could be exported.
const NOT_YET: &[Mnemonic] = &[Mnemonic::Pack, Mnemonic::Unpack];

/// How an instruction becomes acts.
type InstructionExport =
    fn(&mut RungExport<'_, '_>, &Instruction, &InstructionLegs) -> Result<(), ExportRefusal>;
/// The instructions that are exported by a function of their own.
const OWN: [(Mnemonic, InstructionExport); 7] = [
    (Mnemonic::Math, |rung, instruction, legs| rung.math(instruction, legs)),
    (Mnemonic::Copy, |rung, instruction, legs| rung.copy(instruction, legs)),
    (Mnemonic::Fill, |rung, instruction, legs| rung.fill(instruction, legs)),
    (Mnemonic::Sr, |rung, instruction, legs| {
        rung.shift(instruction, legs);
        Ok(())
    }),
    (Mnemonic::Ctu, |rung, instruction, legs| rung.sensaphone(instruction, legs)),
    (Mnemonic::Ctd, |rung, instruction, legs| rung.sensaphone(instruction, legs)),
    (Mnemonic::Res, |rung, instruction, legs| {
        rung.sensaphone_reset(instruction, legs);
        Ok(())
    }),
];

impl RungExport<'_, '_> {
    /// Adds the acts of an instruction.
    pub(super) fn instruction(
        &mut self,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let mnemonic = instruction.mnemonic;
        if BITS.contains(&mnemonic) {
            self.bit_instruction(instruction, legs)
        } else if STORES.contains(&mnemonic) {
            self.stored(instruction, legs)
        } else if let Some((_, export)) = OWN.iter().find(|(own, _)| *own == mnemonic) {
            export(self, instruction, legs)
        } else if RESETS.contains(&mnemonic) {
            self.reset(instruction, legs)
        } else if let Some(block) = LibraryBlock::of(mnemonic) {
            self.owner(block, instruction, legs)
        } else {
            let remedies = [(STAGES, refusal::STAGES), (NOT_YET, refusal::NOT_YET)];
            let found = remedies.iter().find(|(mnemonics, _)| mnemonics.contains(&mnemonic));
            let other = if mnemonic == Mnemonic::Stop { refusal::STOP } else { refusal::BLOCKS };
            let remedy = found.map_or(other, |(_, remedy)| *remedy);
            Err(ExportRefusal::new(instruction.span, mnemonic.spec().name, remedy))
        }
    }

    fn bit_instruction(
        &mut self,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let bit: Bit = instruction.operands.required("bit");
        if bit.of_word().is_some() {
            let what = format!("{} of a bit of a word", instruction.mnemonic.spec().name);
            return Err(ExportRefusal::new(instruction.span, what, refusal::NOT_YET));
        }
        let bit = self.memory.variable(Address::Bit(bit));
        let power = legs.leg(LegName::When);
        let mnemonic = instruction.mnemonic;
        if let Some((_, action)) = COILS.into_iter().find(|(coil, _)| *coil == mnemonic) {
            self.coil(action, power, &bit);
        } else if mnemonic == Mnemonic::Ponoff {
            let edge = self.fresh("press", "BOOL");
            self.edge(Edge::Rise, &power, &edge);
            let turned = NetworkPower::any([
                NetworkPower::all([on(&edge), off(&bit)]),
                NetworkPower::all([off(&edge), on(&bit)]),
            ]);
            self.coil(CoilAction::Assign, turned, &bit);
        } else {
            let edge = if mnemonic == Mnemonic::Pd { Edge::Rise } else { Edge::Fall };
            self.edge(edge, &power, &bit);
        }
        Ok(())
    }

    /// MOVE, ADD and SUB.
    fn stored(
        &mut self,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let span = instruction.span;
        let place: WordPlace = instruction.operands.required("to");
        let a: Value = instruction.operands.required("a");
        let b = instruction.operands.get::<Value>("b").map(|b| b.value);
        let is_real = match place {
            WordPlace::Word(word) => word.is_real(),
            WordPlace::Element(element) => element.array.is_real(),
        };
        let first = self.number(a, span)?;
        let second = b.map(|b| self.number(b, span)).transpose()?;
        let is_sum = instruction.mnemonic == Mnemonic::Add;
        let plain = match is_real {
            true => real_result(first, second, is_sum),
            false => whole_result(first, second, is_sum),
        };
        let value = match plain {
            Some(source) => StoredValue::Plain(source),
            None => {
                let operator = if is_sum { Binary::Add } else { Binary::Subtract };
                StoredValue::Formula(self.formula(&calculation(a, b, operator), span)?)
            }
        };
        let power = legs.leg(LegName::When);
        match place {
            WordPlace::Word(word) => self.store_value(word, value, power),
            WordPlace::Element(element) => {
                let index = self.index(element, span)?;
                self.store_element(
                    &MovingPlace { array: element.array, index, span },
                    value,
                    power,
                )?;
            }
        }
        Ok(())
    }

    /// MATH.
    fn math(
        &mut self,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let span = instruction.span;
        let Some(calculation) = &instruction.calculation else { return Ok(()) };
        let power = legs.leg(LegName::When);
        let target: FormulaTarget = instruction.operands.required("target");
        let index =
            calculation.index.as_ref().map(|index| self.formula(index, span)).transpose()?;
        let value = self.formula(&calculation.value, span)?;
        match target {
            FormulaTarget::Word(word) => {
                self.store_value(word, StoredValue::Formula(value), power);
            }
            FormulaTarget::Bit(bit) if bit.of_word().is_some() => {
                return Err(ExportRefusal::new(span, "a bit of a word", refusal::NOT_YET));
            }
            FormulaTarget::Bit(bit) => {
                let state = self.as_power(value);
                let state = self.kept_bit(state);
                let bit = self.memory.variable(Address::Bit(bit));
                self.store_bit(&bit, state, power);
            }
            FormulaTarget::Array(array) => {
                let Some(FormulaResult::Whole(index)) = index else {
                    return Err(ExportRefusal::new(span, "an index", refusal::NOT_YET));
                };
                let place = MovingPlace { array, index, span };
                self.store_element(&place, StoredValue::Formula(value), power)?;
            }
        }
        Ok(())
    }
}

/// The expression of a MOVE, ADD or SUB.
fn calculation(a: Value, b: Option<Value>, operator: Binary) -> Formula {
    let mut formula = a.formula();
    if let Some(b) = b {
        let is_real = a.is_real() || b.is_real();
        let number_type = if is_real { NumberType::Real } else { NumberType::Integer };
        formula.parts.extend(b.formula().parts);
        formula.parts.push(FormulaPart::Binary(operator, number_type));
    }
    formula
}

/// The sum, difference or copy of whole numbers.
fn whole_result(a: ExportedNumber, b: Option<ExportedNumber>, is_sum: bool) -> Option<CallSource> {
    if a.is_real || b.as_ref().is_some_and(|b| b.is_real) {
        return None;
    }
    Some(match b {
        Some(b) if is_sum => sum(a.source, b.source),
        Some(b) => difference(a.source, b.source),
        None => a.source,
    })
}

/// The sum, difference or copy of reals.
fn real_result(a: ExportedNumber, b: Option<ExportedNumber>, is_sum: bool) -> Option<CallSource> {
    let a = a.real_source()?;
    let name = if is_sum { "ADD" } else { "SUB" };
    match b {
        Some(b) => Some(of_two(name, a, b.real_source()?)),
        None => Some(a),
    }
}
