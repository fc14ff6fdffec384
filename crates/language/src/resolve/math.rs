//! Resolves MATH: its target, its expression, and the warnings about both.
//!
//! Called by `operand`. The target may be an element whose index is an expression too.

use super::Resolver;
use super::array::Array;
use super::formula::{Formula, FormulaPart};
use super::formula_elements::constant;
use super::formula_operands::{OperandForm, TypedOperand};
use super::instruction::{
    Calculation, FormulaTarget, Instruction, OperandList, OperandType, ResolvedOperand,
};
use super::mistake::address_mistake;
use super::scope::NamedThing;
use crate::source::atom::{Atom, AtomKind};
use crate::source::expression as written;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{advise, proposed, text};
use crate::source::indexed::{first_of, with_index};
use crate::source::span::{Located, Span};
use rungd_engine::isa::{Address, Spec, address_text};

impl Resolver<'_> {
    /// Resolves a MATH; `None` if it has a mistake.
    pub(super) fn math(
        &mut self,
        span: Span,
        formula: &written::WrittenFormula,
        spec: &'static Spec,
    ) -> Option<Instruction> {
        let target = self.math_target(formula, spec);
        let resolved = self.expression(&formula.expression);
        let ((target, index), (value, whole)) = (target?, resolved?);
        self.doubts(target.value, whole);
        let row = spec.positional(0)?;
        let target = ResolvedOperand { row, value: target.value.operand(), span: target.span };
        let operands = OperandList(vec![target]);
        let calculation = Some(Box::new(Calculation { index, value }));
        Some(Instruction { mnemonic: spec.mnemonic, span, operands, calculation })
    }

    fn math_target(
        &mut self,
        formula: &written::WrittenFormula,
        spec: &'static Spec,
    ) -> Option<(Located<FormulaTarget>, Option<Formula>)> {
        let name = &formula.target;
        if let Some(index) = &formula.index {
            return self.math_element(name, index, formula.bit.as_ref(), spec);
        }
        self.math_selected(name, spec)
    }

    /// Resolves a target without an index, or with a constant index.
    fn plain_target(
        &mut self,
        name: String,
        span: Span,
        spec: &'static Spec,
    ) -> Option<Located<FormulaTarget>> {
        let found = self.scope.look_up(&name).map(|found| found.thing);
        let atom = Atom { kind: AtomKind::Name(name), span };
        let value = match found {
            Ok(NamedThing::Address(Address::Bit(_))) => {
                FormulaTarget::Bit(self.writable_bit(&atom, spec)?)
            }
            _ => FormulaTarget::Word(self.writable_word(&atom, spec)?),
        };
        Some(Located { value, span })
    }

    /// The warnings about an expression and its target.
    fn doubts(&mut self, target: FormulaTarget, whole: TypedOperand) {
        match target {
            _ if target.is_real() => {
                let Some((sign, sides)) = whole.division else { return };
                self.doubt_division(sign, sides, "stored");
            }
            _ if target.is_bit() && whole.form == OperandForm::ComplementOfBit => {
                let name = self.text(whole.span).trim_start_matches('~').trim_start();
                let message = "`~` of a bit is -1 or -2, which is never 0";
                let finding = Finding::new(Code::ComplementOfBit, whole.span, message);
                let help = advise("the opposite of a bit is `{}`", [proposed(format!("!{name}"))]);
                self.find(finding.label("the target is always ON").help(help));
            }
            FormulaTarget::Word(_) | FormulaTarget::Bit(_) | FormulaTarget::Array(_) => {}
        }
    }

    /// The warning about a division of integers whose fraction is lost before the result is used as
    /// a real. `sign`, `sides`: the places of the division; `used`: what becomes of the result.
    pub(super) fn doubt_division(&mut self, sign: Span, sides: [Span; 2], used: &str) {
        let place = sides[0].to(sides[1]);
        let [left, right] = sides.map(|side| self.text(side));
        let real = match right.bytes().all(|b| b.is_ascii_digit()) {
            true => format!("{left} / {right}.0"),
            false => format!("toreal({left}) / {right}"),
        };
        let message = format!("a division of integers loses its fraction before it is {used}");
        let finding = Finding::new(Code::IntegerDivisionIntoReal, sign, message);
        let right = [real.clone(), format!("trunc({real})")];
        let help = advise("write `{}`, or `{}` if the loss is meant", right.map(text));
        self.find(finding.label("both sides are integers").help(help.at(place)));
    }

    /// Resolves a target with an index. With a constant index, it is a plain word or bit.
    fn math_element(
        &mut self,
        name: &Located<String>,
        index: &written::Expression,
        bit: Option<&Located<String>>,
        spec: &'static Spec,
    ) -> Option<(Located<FormulaTarget>, Option<Formula>)> {
        let array = self.array_of(name, None);
        let index = self.expression(index);
        let (array, (index, whole)) = (array?, index?);
        if !self.whole_number(whole) {
            return None;
        }
        let behind = bit.map_or(String::new(), |bit| format!(".{}", bit.value));
        let element = |at: i64| format!("{}{behind}", with_index(&name.value, &at.to_string()));
        let array = match bit {
            Some(bit) => self.bits_of_array(array, bit, name.span.to(bit.span))?,
            None => array,
        };
        if let Some((at, _)) = constant(&index.parts) {
            self.names_an_element(name.span);
            return Some((self.plain_target(element(at), name.span, spec)?, None));
        }
        if array.member.is_some() {
            let message =
                format!("`{}` is written with a moving index", with_index(&name.value, "…"));
            let finding = Finding::new(Code::OperandType, name.span, message);
            self.find(finding.help("a member of a structure is written with a constant index"));
            return None;
        }
        if !array.is_writable() {
            // Adds the finding that any of its elements would have.
            self.plain_target(element(0), name.span, spec);
            return None;
        }
        Some((Located { value: FormulaTarget::Array(array), span: name.span }, Some(index)))
    }

    /// The bits with this number of an array of words. `whole`: the place of the element's bit.
    fn bits_of_array(&mut self, array: Array, bit: &Located<String>, whole: Span) -> Option<Array> {
        match address_text::bit_of(array.element(0), &bit.value) {
            Ok(bit) => Some(Array { bit: bit.of_word().map(|bit| bit.number), ..array }),
            Err(error) => {
                let element = self.text(whole).to_owned();
                self.findings.extend(address_mistake(&element, error).finding(whole));
                None
            }
        }
    }

    /// Resolves a target that a word selects, with its index. A template's argument may be such a
    /// target.
    fn math_selected(
        &mut self,
        name: &Located<String>,
        spec: &'static Spec,
    ) -> Option<(Located<FormulaTarget>, Option<Formula>)> {
        let Ok(NamedThing::Element(element)) = self.scope.look_up(&name.value).map(|f| f.thing)
        else {
            return Some((self.plain_target(name.value.clone(), name.span, spec)?, None));
        };
        // Marks its tag as used, and records the index.
        self.look_up(&name.value, name.span);
        if element.array.member.is_some() {
            self.moving_member(&name.value, name.span);
            return None;
        }
        if !element.array.is_writable() {
            let first = first_of(&name.value);
            self.plain_target(first, name.span, spec);
            return None;
        }
        let index = Formula { parts: vec![FormulaPart::Word(element.index)] };
        Some((Located { value: FormulaTarget::Array(element.array), span: name.span }, Some(index)))
    }
}
