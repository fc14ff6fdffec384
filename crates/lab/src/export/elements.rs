//! Elements that a word selects, as one compare for each element.
//!
//! IEC 61131-3 has indexes too, but says nothing of one that is outside its array: here such a read
//! is OFF or 0, and such a write does nothing.

use super::formula_values::{FormulaResult, StoredValue, WholeResult, converted};
use super::functions::number;
use super::literals::CallLiteral;
use super::project::{CallSource, CoilAction, NetworkPower, on};
use super::refusal::{self, ExportRefusal};
use super::rung_acts::RungExport;
use rungd_engine::isa::{Address, Real};
use rungd_language::resolve::array::{Array, ArrayElement};
use rungd_language::source::span::Span;

/// Most elements of an array with a moving index.
const ELEMENTS_MAX: u32 = 64;

/// An element that is written.
pub(super) struct MovingPlace {
    pub(super) array: Array,
    pub(super) index: WholeResult,
    pub(super) span: Span,
}

/// An element, and whether it is the selected one.
struct SelectedElement {
    address: Address,
    is_selected: NetworkPower,
}

impl RungExport<'_, '_> {
    /// The index of an element.
    pub(super) fn index(
        &mut self,
        element: ArrayElement,
        span: Span,
    ) -> Result<WholeResult, ExportRefusal> {
        let source = self.word(element.index, span)?.source;
        Ok(WholeResult::of_word(element.index, source))
    }

    /// The elements of an array, each with a bit that says whether the index is its number.
    fn selected(
        &mut self,
        array: Array,
        index: WholeResult,
        span: Span,
    ) -> Result<Vec<SelectedElement>, ExportRefusal> {
        if array.count > ELEMENTS_MAX || array.bit.is_some() {
            return Err(ExportRefusal::new(span, "a moving index", refusal::LONG));
        }
        let type_name = index.type_name();
        let index = self.stored_number(index.source, type_name);
        let elements = array.addresses().enumerate().map(|(at, address)| {
            let is_selected = self.compared("EQ", index.clone(), number(at as i64));
            SelectedElement { address, is_selected }
        });
        Ok(elements.collect())
    }

    /// The value of an element.
    pub(super) fn element(
        &mut self,
        array: Array,
        index: WholeResult,
        span: Span,
    ) -> Result<FormulaResult, ExportRefusal> {
        let elements = self.selected(array, index, span)?;
        let Some(word) = array.first_word() else {
            let mut each = Vec::new();
            for element in elements {
                if let Address::Bit(bit) = element.address {
                    each.push(NetworkPower::all([element.is_selected, self.bit(bit, span)?]));
                }
            }
            let bit = self.fresh("element", "BOOL");
            self.coil(CoilAction::Assign, NetworkPower::any(each), &bit);
            return Ok(FormulaResult::Power(on(&bit)));
        };
        let type_name = if word.is_real() { "REAL" } else { "DINT" };
        let zero = match word.is_real() {
            true => CallLiteral::Real(Real::nearest(0)),
            false => CallLiteral::Whole(0),
        };
        let value = self.fresh("element", type_name);
        self.assign(&value, CallSource::Literal(zero), NetworkPower::Constant(true));
        for element in elements {
            let source = CallSource::Variable(self.memory.variable(element.address));
            self.assign(&value, source, element.is_selected);
        }
        let source = CallSource::Variable(value);
        Ok(match word.is_real() {
            true => FormulaResult::Real(converted("REAL_TO_LREAL", source)),
            false => FormulaResult::Whole(WholeResult::of_word(word, source)),
        })
    }

    /// Writes a value to an element while a power is ON.
    pub(super) fn store_element(
        &mut self,
        place: &MovingPlace,
        value: StoredValue,
        power: NetworkPower,
    ) -> Result<(), ExportRefusal> {
        let elements = self.selected(place.array, place.index.clone(), place.span)?;
        let Some(word) = place.array.first_word() else {
            let state = match value {
                StoredValue::Formula(value) => self.as_power(value),
                StoredValue::Plain(_) => NetworkPower::Constant(false),
            };
            let state = self.kept_bit(state);
            for element in elements {
                let bit = self.memory.variable(element.address);
                let power = NetworkPower::all([power.clone(), element.is_selected]);
                self.store_bit(&bit, state.clone(), power);
            }
            return Ok(());
        };
        let source = self.stored_source(word, value);
        let type_name = if word.is_real() { "REAL" } else { "DINT" };
        let source = self.stored_number(source, type_name);
        for element in elements {
            if let Address::Word(word) = element.address {
                let power = NetworkPower::all([power.clone(), element.is_selected]);
                self.store(word, source.clone(), power);
            }
        }
        Ok(())
    }

    /// The REAL of an element.
    pub(super) fn real_value(&mut self, value: FormulaResult) -> CallSource {
        match value {
            FormulaResult::Real(CallSource::Call(call)) => {
                let input = call.inputs.into_iter().next();
                input.map_or_else(|| number(0), |input| input.source)
            }
            value
            @ (FormulaResult::Real(_) | FormulaResult::Whole(_) | FormulaResult::Power(_)) => {
                converted("LREAL_TO_REAL", self.as_real(value))
            }
        }
    }
}
