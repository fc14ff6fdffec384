//! COPY, FILL and SR: an act for each element.

use super::elements::MovingPlace;
use super::formula_values::{FormulaResult, StoredValue};
use super::project::{CoilAction, NetworkPower, off, on};
use super::refusal::{self, ExportRefusal};
use super::rung_acts::{InstructionLegs, RungExport};
use rungd_engine::isa::{Address, LegName};
use rungd_language::resolve::array::{Array, ShiftBits};
use rungd_language::resolve::operand_list::{CopiedPlace, FieldCopy, Filling};
use rungd_language::resolve::program::{Instruction, Value};
use rungd_language::source::span::Span;

impl RungExport<'_, '_> {
    /// COPY.
    pub(super) fn copy(
        &mut self,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let power = legs.leg(LegName::When);
        let span = instruction.span;
        if instruction.is_record_copy() {
            let fields: Vec<FieldCopy> = instruction.copied_fields().collect();
            if fields.iter().any(|field| moves_an_index(field, &fields)) {
                let what = "COPY of a record that has its own index";
                return Err(ExportRefusal::new(span, what, refusal::NOT_YET));
            }
            return fields.iter().try_for_each(|field| {
                self.copied(&field.from, field.to, &PlacedPower { power: power.clone(), span })
            });
        }
        let from: Array = instruction.operands.required("from");
        let to: Array = instruction.operands.required("to");
        if from.addresses().any(|address| to.addresses().any(|other| other == address)) {
            let what = "COPY within one array";
            return Err(ExportRefusal::new(span, what, refusal::NOT_YET));
        }
        for (from, to) in from.addresses().zip(to.addresses()) {
            let (from, to) = match (from, to) {
                (Address::Bit(from), Address::Bit(to)) => {
                    (Filling::Bit(from), CopiedPlace::Bit(to))
                }
                (Address::Word(from), Address::Word(to)) => {
                    (Filling::Value(Value::Word(from)), CopiedPlace::Word(to))
                }
                _ => continue,
            };
            self.copied(&from, to, &PlacedPower { power: power.clone(), span })?;
        }
        Ok(())
    }

    /// FILL.
    pub(super) fn fill(
        &mut self,
        instruction: &Instruction,
        legs: &InstructionLegs,
    ) -> Result<(), ExportRefusal> {
        let span = instruction.span;
        let power = legs.leg(LegName::When);
        let value: Filling = instruction.operands.required("value");
        let to: Array = instruction.operands.required("to");
        let mut value = self.filling(&value, span)?;
        if let FormulaResult::Power(power) = value {
            value = FormulaResult::Power(self.kept_bit(power));
        } else {
            value = self.steady(value);
        }
        for address in to.addresses() {
            match address {
                Address::Word(word) => {
                    self.store_value(word, StoredValue::Formula(value.clone()), power.clone());
                }
                Address::Bit(bit) => {
                    let state = self.as_power(value.clone());
                    let bit = self.memory.variable(Address::Bit(bit));
                    self.store_bit(&bit, state, power.clone());
                }
                Address::Structure(_) => {}
            }
        }
        Ok(())
    }

    /// SR.
    pub(super) fn shift(&mut self, instruction: &Instruction, legs: &InstructionLegs) {
        let ShiftBits { array, down } = instruction.operands.required("bits");
        let mut bits: Vec<String> =
            array.addresses().map(|address| self.memory.variable(address)).collect();
        if down {
            bits.reverse();
        }
        let data = self.kept_bit(legs.leg(LegName::Data));
        let reset = self.kept_bit(legs.leg(LegName::Rst));
        let was = self.fresh("was", "BOOL");
        let clk = legs.leg(LegName::Clk);
        let shifts = NetworkPower::all([clk.clone(), off(&was), reset.clone().opposite()]);
        let shifts = self.kept_bit(shifts);
        self.coil(CoilAction::Assign, clk, &was);
        for pair in bits.windows(2).rev() {
            self.store_bit(&pair[1], on(&pair[0]), shifts.clone());
        }
        if let Some(first) = bits.first() {
            self.store_bit(first, data, shifts);
        }
        for bit in bits.iter().filter(|_| reset != NetworkPower::Constant(false)) {
            self.coil(CoilAction::Reset, reset.clone(), bit);
        }
    }

    /// The value that is copied or filled in.
    fn filling(&mut self, value: &Filling, span: Span) -> Result<FormulaResult, ExportRefusal> {
        match value {
            Filling::Value(value) => self.formula(&value.formula(), span),
            Filling::Bit(bit) => self.bit(*bit, span).map(FormulaResult::Power),
            Filling::Element(element) => {
                let index = self.index(*element, span)?;
                self.element(element.array, index, span)
            }
        }
    }

    /// Copies a bit or word.
    fn copied(
        &mut self,
        from: &Filling,
        to: CopiedPlace,
        placed: &PlacedPower,
    ) -> Result<(), ExportRefusal> {
        let PlacedPower { power, span } = placed;
        let value = self.filling(from, *span)?;
        match to {
            CopiedPlace::Word(word) => {
                self.store_value(word, StoredValue::Formula(value), power.clone());
            }
            CopiedPlace::Bit(bit) => {
                let state = self.as_power(value);
                let bit = self.memory.variable(Address::Bit(bit));
                self.store_bit(&bit, state, power.clone());
            }
            CopiedPlace::Element(element) => {
                let index = self.index(element, *span)?;
                let place = MovingPlace { array: element.array, index, span: *span };
                self.store_element(&place, StoredValue::Formula(value), power.clone())?;
            }
        }
        Ok(())
    }
}

/// A power, and the place of the instruction that has it.
struct PlacedPower {
    power: NetworkPower,
    span: Span,
}

/// Whether a field is at an index that the same COPY writes.
fn moves_an_index(field: &FieldCopy, fields: &[FieldCopy]) -> bool {
    let from = match field.from {
        Filling::Element(element) | Filling::Value(Value::Element(element)) => Some(element.index),
        Filling::Bit(_) | Filling::Value(Value::Const(..) | Value::Real(_) | Value::Word(_)) => {
            None
        }
    };
    let to = match field.to {
        CopiedPlace::Element(element) => Some(element.index),
        CopiedPlace::Bit(_) | CopiedPlace::Word(_) => None,
    };
    let written = |index| fields.iter().any(|field| field.to == CopiedPlace::Word(index));
    from.into_iter().chain(to).any(written)
}
