//! The operands of an expression while it is resolved: their types, and the names among them.
//!
//! `formula_resolver` and `formula_elements` make them; `formula_constants` and `math` read them
//! for warnings.

use super::Resolver;
use super::array::{Array, ArrayElement};
use super::formula::{FormulaInteger, FormulaPart, NumberType, type_of};
use super::mistake::{bit_of_block, bits_of_device};
use super::resolver::of_array;
use super::scope::{MisplacedName, NamedThing};
use crate::source::fix::{advise, proposed};
use crate::source::span::Span;
use rungd_engine::isa::Address;

/// An operand on the stack.
#[derive(Clone, Copy)]
pub(super) struct TypedOperand {
    pub of: NumberType,
    /// Its place.
    pub span: Span,
    /// A division of integers whose lost fraction affects this operand: the places of its sign and
    /// of its operands.
    pub division: Option<(Span, [Span; 2])>,
    /// The form, for the warning about a complement.
    pub form: OperandForm,
    /// The array, if the operand is a whole array; each of its elements is a part.
    pub whole: Option<Array>,
    /// The value, if the operand is a number and not a name.
    pub literal: Option<f64>,
}

/// The form of an operand, for the warning about a complement.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum OperandForm {
    Bit,
    ComplementOfBit,
    Other,
}

impl TypedOperand {
    pub fn new(number_type: NumberType, span: Span) -> TypedOperand {
        TypedOperand {
            of: number_type,
            span,
            division: None,
            form: OperandForm::Other,
            whole: None,
            literal: None,
        }
    }
}

/// The parts resolved so far, and the operands that wait for their operator.
pub(super) struct FormulaWalk {
    pub parts: Vec<FormulaPart>,
    pub operands: Vec<TypedOperand>,
    /// Whether no part had a mistake.
    pub whole: bool,
}

impl FormulaWalk {
    pub fn push(&mut self, part: FormulaPart, operand: TypedOperand) {
        self.parts.push(part);
        self.operands.push(operand);
    }

    /// Adds an operand with a mistake as an integer, which causes no further finding.
    pub fn unknown(&mut self, span: Span) {
        self.whole = false;
        let zero = FormulaPart::Integer(FormulaInteger::new(0));
        self.push(zero, TypedOperand::new(NumberType::Integer, span));
    }
}

impl Resolver<'_> {
    /// Resolves a name as an operand of an expression.
    pub(super) fn operand_of(
        &mut self,
        name: &str,
        span: Span,
    ) -> Option<(FormulaPart, TypedOperand)> {
        let operand = |number_type| TypedOperand::new(number_type, span);
        let integer = operand(NumberType::Integer);
        let thing = self.look_up(name, span)?;
        let help = match thing {
            NamedThing::Real(real) => {
                self.note_constant(name, span);
                return Some((FormulaPart::Real(real), operand(NumberType::Real)));
            }
            NamedThing::Constant(value, form) => {
                self.note_constant(name, span);
                let constant = FormulaInteger { number: i64::from(value), form };
                return Some((FormulaPart::Integer(constant), integer));
            }
            NamedThing::Address(address @ Address::Word(word)) => {
                self.note(name, span, address);
                return Some((FormulaPart::Word(word), operand(type_of(word))));
            }
            NamedThing::Address(address @ Address::Bit(bit)) => {
                self.note(name, span, address);
                return Some((
                    FormulaPart::Bit(bit),
                    TypedOperand { form: OperandForm::Bit, ..integer },
                ));
            }
            NamedThing::Address(Address::Structure(structure)) => {
                let acc = if structure.members().contains(&"Acc") { "Acc" } else { "ACC" };
                advise("its value is `{}`", [proposed(format!("{name}.{acc}"))])
            }
            NamedThing::Array(array) | NamedThing::Element(ArrayElement { array, .. }) => {
                of_array(name, array)
            }
            NamedThing::Record(place) => self.scope.name_a_field(name, place),
            NamedThing::Block(_) => bit_of_block(name),
            NamedThing::Device(_) => advise("its bits are `{}` and `{}`", bits_of_device(name)),
        };
        self.wrong_kind(MisplacedName { name, span, thing }, "a value", help);
        None
    }
}
