//! Resolves the expression of a MATH or of a contact: its names, and the types of its operators.
//!
//! Called by `math` and `computed`. Visits the parts in a loop with a stack of operands, so that
//! no expression is too deep. All mistakes of an expression are found, not only the first.
#![deny(clippy::wildcard_enum_match_arm)]

use super::Resolver;
use super::formula::{Binary, Formula, FormulaInteger, FormulaPart, NumberType, Unary};
use super::formula_operands::{FormulaWalk, OperandForm, TypedOperand};
use crate::source::atom::ConstantForm;
use crate::source::expression::{self as written, ExpressionPartKind};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, advise, one_of, possible};
use crate::source::nearest::did_you_mean;
use crate::source::span::{Located, Span};
pub use rungd_engine::isa::Function;
pub use rungd_engine::isa::function::{FUNCTIONS, ResultType};

impl Resolver<'_> {
    /// Resolves an expression; also returns it as an operand with its type.
    pub(super) fn expression(
        &mut self,
        written: &written::Expression,
    ) -> Option<(Formula, TypedOperand)> {
        let mut walk = FormulaWalk { parts: Vec::new(), operands: Vec::new(), whole: true };
        for part in &written.parts {
            match &part.kind {
                ExpressionPartKind::Integer(n) => {
                    let operand = TypedOperand::new(NumberType::Integer, part.span);
                    let literal = Some(*n as f64);
                    let part = FormulaPart::Integer(FormulaInteger::new(*n));
                    walk.push(part, TypedOperand { literal, ..operand });
                }
                ExpressionPartKind::Duration(ms) => {
                    let operand = TypedOperand::new(NumberType::Integer, part.span);
                    let literal = Some(f64::from(*ms));
                    let (number, form) = ((*ms).into(), ConstantForm::Duration);
                    let part = FormulaPart::Integer(FormulaInteger { number, form });
                    walk.push(part, TypedOperand { literal, ..operand });
                }
                ExpressionPartKind::Real(real) => {
                    let operand = TypedOperand::new(NumberType::Real, part.span);
                    let literal = Some(f64::from(*real));
                    walk.push(FormulaPart::Real(*real), TypedOperand { literal, ..operand });
                }
                ExpressionPartKind::Name(name) => self.name(&mut walk, name, part.span),
                ExpressionPartKind::Element(name) => self.element_of(&mut walk, name, part.span),
                ExpressionPartKind::WordBit(bit) => self.bit_of_element(&mut walk, bit, part.span),
                ExpressionPartKind::Unary(operator) => self.unary(&mut walk, *operator, part.span),
                ExpressionPartKind::Binary(operator, sign) => {
                    self.binary(&mut walk, *operator, *sign, part.span);
                }
                ExpressionPartKind::Call(name, count) => {
                    self.call(&mut walk, name, *count, part.span)
                }
            }
        }
        let last = walk.operands.pop()?;
        self.one_value(&mut walk, last);
        walk.whole.then_some((Formula { parts: walk.parts }, last))
    }

    fn unary(&mut self, walk: &mut FormulaWalk, operator: Unary, span: Span) {
        let Some(operand) = walk.operands.pop() else { return };
        self.one_value(walk, operand);
        let number_type = operand.of;
        let whole = match operator {
            Unary::Minus => {
                let literal = operand.literal.map(|number| -number);
                let division = operand.division;
                TypedOperand { division, literal, ..TypedOperand::new(number_type, span) }
            }
            Unary::Not => TypedOperand::new(NumberType::Integer, span),
            Unary::Complement => {
                self.wants_integers(walk, operator.sign(), &[operand]);
                let is_bit = operand.form == OperandForm::Bit;
                let form = if is_bit { OperandForm::ComplementOfBit } else { OperandForm::Other };
                TypedOperand { form, ..TypedOperand::new(NumberType::Integer, span) }
            }
        };
        walk.push(FormulaPart::Unary(operator, number_type), whole);
    }

    /// An operator with two operands. `sign`: its place; `span`: that of the whole.
    fn binary(&mut self, walk: &mut FormulaWalk, operator: Binary, sign: Span, span: Span) {
        let (Some(right), Some(left)) = (walk.operands.pop(), walk.operands.pop()) else { return };
        self.one_value(walk, left);
        self.one_value(walk, right);
        let number_type = left.of.with(right.of);
        let division = left.division.or(right.division);
        self.constants_of(operator, [left, right], span);
        let whole = match operator {
            Binary::Divide if number_type == NumberType::Integer => {
                let own = Some((sign, [left.span, right.span]));
                TypedOperand { division: division.or(own), ..TypedOperand::new(number_type, span) }
            }
            Binary::Add | Binary::Subtract | Binary::Multiply | Binary::Divide | Binary::Power => {
                TypedOperand { division, ..TypedOperand::new(number_type, span) }
            }
            Binary::Remainder => TypedOperand::new(number_type, span),
            Binary::And
            | Binary::Or
            | Binary::Xor
            | Binary::ShiftLeft
            | Binary::ShiftRight
            | Binary::ShiftRightZeros => {
                self.wants_integers(walk, operator.sign(), &[left, right]);
                TypedOperand::new(NumberType::Integer, span)
            }
            Binary::Less
            | Binary::AtMost
            | Binary::Greater
            | Binary::AtLeast
            | Binary::Equal
            | Binary::NotEqual
            | Binary::AndAlso
            | Binary::OrElse => TypedOperand::new(NumberType::Integer, span),
        };
        walk.push(FormulaPart::Binary(operator, number_type), whole);
    }

    /// Reports reals among the operands of an operator on bits.
    fn wants_integers(&mut self, walk: &mut FormulaWalk, sign: &str, operands: &[TypedOperand]) {
        for operand in operands.iter().filter(|operand| operand.of == NumberType::Real) {
            let message = format!("`{sign}` works on the bits of integers, not on a real");
            let text = self.text(operand.span).to_owned();
            let integers = [format!("round({text})"), format!("trunc({text})")].map(possible);
            let help = advise("an integer of it is `{}` or `{}`", integers);
            let finding = Finding::new(Code::OperandType, operand.span, message);
            self.find(finding.label("a real").help(help));
            walk.whole = false;
        }
    }

    fn call(&mut self, walk: &mut FormulaWalk, name: &Located<String>, count: u32, span: Span) {
        let rest = walk.operands.len().saturating_sub(count as usize);
        let arguments = walk.operands.split_off(rest);
        let Some(function) = Function::from_name(&name.value) else {
            self.find(unknown_function(name));
            return walk.unknown(span);
        };
        let spec = function.spec();
        if !(spec.least..=spec.most).contains(&count) {
            let wanted = match (spec.least, spec.most) {
                (1, u32::MAX) => "at least one argument".to_owned(),
                (1, _) => "one argument".to_owned(),
                (least, _) => format!("{least} arguments"),
            };
            let message = format!("`{}` takes {wanted}, not {count}", spec.name);
            let finding = Finding::new(Code::FunctionArguments, span, message);
            self.find(finding.help(format!("its form is `{}`", spec.form())));
            return walk.unknown(span);
        }
        // The condition of `if` does not affect its type.
        let typed = if function == Function::If { &arguments[1..] } else { &arguments[..] };
        let all = typed
            .iter()
            .fold(NumberType::Integer, |number_type, operand| number_type.with(operand.of));
        let (number_type, result) = match spec.result {
            ResultType::Kept => (all, all),
            ResultType::Integer => (all, NumberType::Integer),
            ResultType::Real => (NumberType::Real, NumberType::Real),
        };
        // A rounding shows that the fraction is not wanted.
        let division = typed.iter().find_map(|operand| operand.division);
        let division = division.filter(|_| spec.result != ResultType::Integer);
        let whole = TypedOperand { division, ..TypedOperand::new(result, span) };
        if !function.takes_arrays() {
            arguments.iter().for_each(|operand| self.one_value(walk, *operand));
        }
        let count =
            arguments.iter().map(|operand| operand.whole.map_or(1, |array| array.count)).sum();
        self.constants_of_call(function, &arguments, span);
        walk.push(FormulaPart::Call(function, count, number_type), whole);
    }
}

fn unknown_function(name: &Located<String>) -> Finding {
    let message = format!("there is no function `{}`", name.value);
    let names = || FUNCTIONS.iter().map(|spec| spec.name);
    let other = match name.value.to_ascii_lowercase().as_str() {
        "pow" | "power" => Some(Help::from("a power is `x ** y`")),
        "mod" => Some("a remainder is `x % y`".into()),
        "not" => Some(Help::from("write `!(…)`").with("!")),
        "rise" | "fall" => Some("an edge is a contact: `when = [\"rise(X0)\"]`".into()),
        "log" => Some(Help::from("write `ln(x)` or `log10(x)`").with("ln").with("log10")),
        "int" | "toint" => {
            Some(Help::from("write `trunc(x)` or `round(x)`").with("trunc").with("round"))
        }
        "real" | "float" => Some(Help::from("write `toreal(x)`").with("toreal")),
        _ => None,
    };
    let help = other.or_else(|| did_you_mean(&name.value, names()));
    let help = help.unwrap_or_else(|| one_of("there are", names()));
    Finding::new(Code::UnknownFunction, name.span, message).help(help)
}
