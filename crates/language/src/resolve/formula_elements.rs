//! Arrays in MATH: elements with an index that is an expression, and whole arrays among the
//! arguments of `sum`, `min` and `max`.
//!
//! Called by `formula_resolver` and `math`. An element with a constant index becomes a plain word
//! or bit.

use super::Resolver;
use super::array::{Array, ArrayElement};
use super::formula::{FormulaPart, NumberType, Unary, type_of_array};
use super::formula_operands::{FormulaWalk, OperandForm, TypedOperand};
use super::index::moving_structure;
use super::mistake::address_mistake;
use super::program::NamedArray;
use super::record::{RecordIndex, RecordPlace};
use super::resolver::of_array;
use super::scope::NamedThing;
use crate::source::finding::{Code, Finding};
use crate::source::fix::advise;
use crate::source::indexed::{INDEX, with_index};
use crate::source::span::{Located, Span};
use rungd_engine::isa::Address;
use rungd_engine::isa::address_text::{self, AddressError};

/// Maximum number of elements of the whole arrays in all formulas of a program: each element
/// becomes a part of its formula, and then a step.
const ELEMENTS_MAX: usize = 1_000_000;

impl Resolver<'_> {
    /// Resolves a name in an expression: one value, or a whole array.
    pub(super) fn name(&mut self, walk: &mut FormulaWalk, name: &str, span: Span) {
        let array = match self.scope.look_up(name).map(|found| found.thing) {
            Ok(NamedThing::Array(array)) if !array.is_structures() => Some(array),
            Ok(NamedThing::Element(ArrayElement { array, index })) => {
                self.look_up(name, span);
                walk.parts.push(FormulaPart::Word(index));
                walk.push(FormulaPart::Element(array), element(array, span));
                return;
            }
            Ok(_) | Err(_) => None,
        };
        let Some(array) = array else {
            match self.operand_of(name, span) {
                Some((part, operand)) => walk.push(part, operand),
                // An unknown name causes no finding about its type.
                None => walk.unknown(span),
            }
            return;
        };
        // Marks its tag as used.
        self.look_up(name, span);
        if !self.has_room(array, span) {
            walk.unknown(span);
            return;
        }
        let parts = array.addresses().map(|address| match address {
            Address::Bit(bit) => FormulaPart::Bit(bit),
            Address::Word(word) => FormulaPart::Word(word),
            Address::Structure(_) => unreachable!("arrays are of bits or words"),
        });
        walk.parts.extend(parts);
        let whole = Some(array);
        walk.operands.push(TypedOperand { whole, ..TypedOperand::new(type_of_array(array), span) });
    }

    /// Takes room for the elements of a whole array; reports once if there is too little.
    fn has_room(&mut self, array: Array, span: Span) -> bool {
        let had_room = self.elements <= ELEMENTS_MAX;
        self.elements = self.elements.saturating_add(array.count as usize);
        if self.elements <= ELEMENTS_MAX {
            return true;
        }
        if had_room {
            let message = "the whole arrays in all MATHs have more than 1000000 elements together";
            let finding = Finding::new(Code::FunctionArguments, span, message);
            let help = "calculate each `sum`, `min` or `max` once, in a MATH of its own, and name \
                        the word with its result elsewhere";
            self.find(finding.label("no room from here on").help(help));
        }
        false
    }

    /// Resolves `name[index]`; the index is the last operand.
    pub(super) fn element_of(
        &mut self,
        walk: &mut FormulaWalk,
        name: &Located<String>,
        span: Span,
    ) {
        let Some(index) = walk.operands.pop() else { return };
        self.one_value(walk, index);
        // The rest of the name is behind its index.
        let rest = name.value.split_once(INDEX).map_or(0, |(_, rest)| rest.len());
        let end = self.text(span).len();
        let field = span.part(end.saturating_sub(rest.saturating_sub(1)), end);
        let array = self.array_of(name, Some(field)).filter(|_| self.whole_number(index));
        let Some(array) = array else {
            walk.whole = false;
            walk.operands.push(TypedOperand::new(NumberType::Integer, span));
            return;
        };
        if let Some((at, parts)) = constant(&walk.parts) {
            self.names_an_element(span);
            walk.parts.truncate(walk.parts.len() - parts);
            match self.operand_of(&with_index(&name.value, &at.to_string()), span) {
                Some((part, operand)) => walk.push(part, operand),
                None => walk.unknown(span),
            }
            return;
        }
        walk.push(FormulaPart::Element(array), element(array, span));
    }

    /// Resolves the bit of the element that is the last operand.
    pub(super) fn bit_of_element(
        &mut self,
        walk: &mut FormulaWalk,
        digits: &Located<String>,
        span: Span,
    ) {
        if walk.operands.pop().is_none() || !walk.whole {
            return walk.operands.push(TypedOperand::new(NumberType::Integer, span));
        }
        let bit = |address| address_text::bit_of(address, &digits.value);
        let part = match walk.parts.pop() {
            Some(FormulaPart::Element(array)) => bit(array.element(0)).map(|bit| {
                let bit = bit.of_word().map(|bit| bit.number);
                FormulaPart::Element(Array { bit, ..array })
            }),
            Some(FormulaPart::Word(word)) => bit(Address::Word(word)).map(FormulaPart::Bit),
            Some(FormulaPart::Bit(of)) => Err(AddressError::NoBits(Address::Bit(of))),
            Some(_) | None => unreachable!("an element is a word or a bit"),
        };
        match part {
            Ok(part) => {
                let form = OperandForm::Bit;
                let operand = TypedOperand::new(NumberType::Integer, span);
                walk.push(part, TypedOperand { form, ..operand });
            }
            Err(error) => {
                let text = self.text(span).to_owned();
                self.findings.extend(address_mistake(&text, error).finding(span));
                walk.unknown(span);
            }
        }
    }

    /// The array with this name. Marks its tag as used. `field`: the place of its name behind the
    /// index, if it is known.
    pub(super) fn array_of(
        &mut self,
        name: &Located<String>,
        field: Option<Span>,
    ) -> Option<Array> {
        if name.value.contains(INDEX) {
            return self.column_of(name, field);
        }
        let thing = self.look_up(&name.value, name.span)?;
        if let NamedThing::Array(array) = thing {
            if !array.is_structures() {
                return Some(array);
            }
            let message = format!("`{}` is an array of structures", name.value);
            let finding = Finding::new(Code::OperandType, name.span, message);
            self.find(finding.help("name a member of one, behind the index"));
            return None;
        }
        if let NamedThing::Record(place) = thing {
            let text = format!("{}[…]", name.value);
            let place = RecordPlace { at: RecordIndex::Constant(0), ..place };
            let message = format!("`{text}` is {}, not a value", place.words());
            let finding = Finding::new(Code::OperandType, name.span, message);
            self.find(finding.help("name a field of it, behind the index"));
            return None;
        }
        let message = format!("`{}` is no array: it has no elements", name.value);
        let finding = Finding::new(Code::OperandType, name.span, message);
        self.find(finding.help("declare a tag with `count`: `{ at = \"D10\", count = 7 }`"));
        None
    }

    /// The array of a column, as [`Resolver::array_of`]: `recipe[].target`, `lanes[].Acc`.
    fn column_of(&mut self, name: &Located<String>, field: Option<Span>) -> Option<Array> {
        if let Some(mistake) = self.scope.no_such_field(&name.value) {
            self.mark_used(&name.value);
            let finding = mistake.finding(field.unwrap_or(name.span));
            // What would be written belongs behind the index.
            self.findings.extend(finding.map(|finding| match (field, finding.help_text()) {
                (None, Some(words)) => finding.clone().help(words.into_owned()),
                (Some(_), _) | (_, None) => finding,
            }));
            return None;
        }
        match self.scope.column(&name.value) {
            Ok(column) if column.array.is_structures() => {
                let mistake = moving_structure(&column, "…").finding(name.span);
                let help = "name a member of it, behind the index";
                self.findings.extend(mistake.map(|finding| finding.help(help)));
                None
            }
            Ok(column) => {
                self.used[column.tag] = true;
                self.note_array(&name.value, name.span, column.array, Some(column.tag));
                Some(column.array)
            }
            Err(mistake) => {
                self.mark_used(&name.value);
                let finding = mistake.finding(name.span);
                // What would be written belongs around the index, which the place does not have.
                let is_one = self.scope.is_one_record(&name.value);
                let help = |finding: Finding| match is_one {
                    true => finding.help("name the field, without an index"),
                    false => finding,
                };
                self.findings.extend(finding.map(help));
                None
            }
        }
    }

    /// Removes the record that the ladder names a whole array here, because it names one element.
    pub(super) fn names_an_element(&mut self, place: Span) {
        let is_there = |(span, _): &mut (Span, NamedArray)| {
            span.file == place.file && (place.start..place.end).contains(&span.start)
        };
        self.arrays.pop_if(is_there);
    }

    /// Whether an index is a whole number; if not, adds a finding.
    pub(super) fn whole_number(&mut self, index: TypedOperand) -> bool {
        if index.of == NumberType::Integer {
            return true;
        }
        let text = self.text(index.span);
        let finding = Finding::new(Code::OperandType, index.span, "an index is a whole number");
        let help =
            advise("write `{}` or `{}`", [format!("round({text})"), format!("trunc({text})")]);
        self.find(finding.label("a real").help(help));
        false
    }

    /// Reports a whole array in the place of one value.
    pub(super) fn one_value(&mut self, walk: &mut FormulaWalk, operand: TypedOperand) {
        let Some(array) = operand.whole else { return };
        walk.whole = false;
        let name = self.text(operand.span).to_owned();
        let message = format!("`{name}` is an array, not a value");
        let finding = Finding::new(Code::OperandType, operand.span, message);
        let help = of_array(&name, array).and("; `sum`, `min` and `max` take whole arrays");
        self.find(finding.label("a value belongs here").help(help));
    }
}

/// An element as an operand.
fn element(array: Array, span: Span) -> TypedOperand {
    let form = if array.is_bits() { OperandForm::Bit } else { OperandForm::Other };
    TypedOperand { form, ..TypedOperand::new(type_of_array(array), span) }
}

/// A constant at the end of an expression, and the number of its parts.
pub(super) fn constant(parts: &[FormulaPart]) -> Option<(i64, usize)> {
    match parts {
        [.., FormulaPart::Integer(n), FormulaPart::Unary(Unary::Minus, _)] => Some((-n.number, 2)),
        [.., FormulaPart::Integer(n)] => Some((n.number, 1)),
        _ => None,
    }
}
