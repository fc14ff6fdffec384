//! The operands of an expression while it is resolved: their types, and the names among them.
//!
//! `formula_resolver` and `formula_elements` make them; `formula_constants` and `math` read them
//! for warnings.

use super::Resolver;
use super::array::{Array, Element};
use super::formula::{NumberType, Part, type_of};
use super::mistake::{bit_of_block, bits_of_device};
use super::resolver::of_array;
use super::scope::{Misplaced, Thing};
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
    pub fn new(of: NumberType, span: Span) -> TypedOperand {
        TypedOperand {
            of,
            span,
            division: None,
            form: OperandForm::Other,
            whole: None,
            literal: None,
        }
    }
}

/// The parts resolved so far, and the operands that wait for their operator.
pub(super) struct Walk {
    pub parts: Vec<Part>,
    pub operands: Vec<TypedOperand>,
    /// Whether no part had a mistake.
    pub whole: bool,
}

impl Walk {
    pub fn push(&mut self, part: Part, operand: TypedOperand) {
        self.parts.push(part);
        self.operands.push(operand);
    }

    /// Adds an operand with a mistake as an integer, which causes no further finding.
    pub fn unknown(&mut self, span: Span) {
        self.whole = false;
        self.push(Part::Integer(0), TypedOperand::new(NumberType::Integer, span));
    }
}

impl Resolver<'_> {
    /// Resolves a name as an operand of an expression.
    pub(super) fn operand_of(&mut self, name: &str, span: Span) -> Option<(Part, TypedOperand)> {
        let operand = |of| TypedOperand::new(of, span);
        let integer = operand(NumberType::Integer);
        let thing = self.look_up(name, span)?;
        let help = match thing {
            Thing::Real(real) => {
                self.note_constant(name, span);
                return Some((Part::Real(real), operand(NumberType::Real)));
            }
            Thing::Constant(value, _) => {
                self.note_constant(name, span);
                return Some((Part::Integer(i64::from(value)), integer));
            }
            Thing::Address(address @ Address::Word(word)) => {
                self.note(name, span, address);
                return Some((Part::Word(word), operand(type_of(word))));
            }
            Thing::Address(address @ Address::Bit(bit)) => {
                self.note(name, span, address);
                return Some((Part::Bit(bit), TypedOperand { form: OperandForm::Bit, ..integer }));
            }
            Thing::Address(Address::Structure(structure)) => {
                let acc = if structure.members().contains(&"Acc") { "Acc" } else { "ACC" };
                advise("its value is `{}`", [proposed(format!("{name}.{acc}"))])
            }
            Thing::Array(array) | Thing::Element(Element { array, .. }) => of_array(name, array),
            Thing::Block(_) => bit_of_block(name),
            Thing::Device(_) => advise("its bits are `{}` and `{}`", bits_of_device(name)),
        };
        self.wrong_kind(Misplaced { name, span, thing }, "a value", help);
        None
    }
}
