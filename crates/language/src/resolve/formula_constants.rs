//! `math-constants`: numbers in an expression that can only be a mistake, such as a division by 0.
//!
//! Called by `formula_resolver`. Only numbers written in the expression count. A named constant or
//! a template's argument is a setting, and an `if` in the expression may handle the value 0.

use super::Resolver;
use super::formula::{Binary, NumberType};
use super::formula_operands::TypedOperand;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, text};
use crate::source::span::Span;
pub use rungd_engine::isa::Function;

/// A mistake: the words for the message, and the help.
type ConstantDoubt = (String, Help);

impl Resolver<'_> {
    /// Warns about the constants of an operator.
    pub(super) fn constants_of(
        &mut self,
        operator: Binary,
        operands: [TypedOperand; 2],
        span: Span,
    ) {
        let number_type = operands[0].of.with(operands[1].of);
        let [left, right] = operands.map(|operand| self.number(operand));
        let doubt = match operator {
            Binary::Divide | Binary::Remainder => right.filter(|n| *n == 0.0).map(|_| by_zero()),
            Binary::Power => power(number_type, left, right),
            Binary::ShiftLeft | Binary::ShiftRightZeros => shift(right)
                .map(|help| ("always 0: no bit is left".to_owned(), help.with(text("0").same()))),
            Binary::ShiftRight => shift(right).map(|help| {
                let by_31 = (right > Some(31.0)).then(|| text("31").at(operands[1].span).same());
                ("0 or -1: only the sign is left".to_owned(), help.with_all(by_31))
            }),
            Binary::Xor => self.exclusive_or(operands),
            Binary::Multiply
            | Binary::Add
            | Binary::Subtract
            | Binary::Less
            | Binary::AtMost
            | Binary::Greater
            | Binary::AtLeast
            | Binary::Equal
            | Binary::NotEqual
            | Binary::And
            | Binary::Or
            | Binary::AndAlso
            | Binary::OrElse => None,
        };
        self.doubt(doubt, span);
    }

    /// Warns about the constants of a function.
    pub(super) fn constants_of_call(
        &mut self,
        function: Function,
        arguments: &[TypedOperand],
        span: Span,
    ) {
        let number = |at: usize| arguments.get(at).and_then(|operand| self.number(*operand));
        let outside = |is_outside: fn(f64) -> bool, domain: &str| {
            let help = format!("`{}` takes {domain}", function.spec().name);
            number(0).filter(|n| is_outside(*n)).map(|_| (out_of_range(), help.into()))
        };
        let doubt = match function {
            Function::Sqrt => outside(|n| n < 0.0, "0 and more"),
            Function::Ln | Function::Log10 => outside(|n| n <= 0.0, "numbers above 0"),
            Function::Asin | Function::Acos => outside(|n| n.abs() > 1.0, "-1.0 to 1.0"),
            Function::Clamp => match (number(1), number(2)) {
                (Some(low), Some(high)) if low > high => {
                    let texts = [0, 2, 1].map(|at: usize| self.text(arguments[at].span));
                    let says = format!("always {low}: its lower limit is above its upper one");
                    let right = format!("clamp({})", texts.join(", "));
                    Some((says, Help::from(format!("write `{right}`")).with(right)))
                }
                (Some(_) | None, Some(_) | None) => None,
            },
            Function::Scale => match (number(1), number(2)) {
                (Some(low), Some(high)) if low == high => {
                    let help = "the second and third argument are the ends of a range";
                    Some((by_zero().0, help.into()))
                }
                (Some(_) | None, Some(_) | None) => None,
            },
            Function::Abs
            | Function::Min
            | Function::Max
            | Function::Sum
            | Function::If
            | Function::Round
            | Function::Floor
            | Function::Ceil
            | Function::Trunc
            | Function::Toreal
            | Function::Exp
            | Function::Sin
            | Function::Cos
            | Function::Tan
            | Function::Atan
            | Function::Atan2 => None,
        };
        self.doubt(doubt, span);
    }

    fn doubt(&mut self, doubt: Option<ConstantDoubt>, span: Span) {
        let Some((says, help)) = doubt else { return };
        let said = STATUS.iter().find_map(|status| says.strip_suffix(status));
        let says = said.filter(|_| self.is_in_contact).unwrap_or(&says);
        let message = format!("`{}` is {says}", self.text(span));
        self.find(Finding::new(Code::MathConstants, span, message).help(help));
    }

    /// The number written at the place of an operand. `None` for a name and for an argument of a
    /// template: the template may check it before the operation.
    fn number(&self, operand: TypedOperand) -> Option<f64> {
        if self.layers.is_given(operand.span.file) {
            return None;
        }
        let text = self.text(operand.span).trim_start_matches(['-', '(', ' ']);
        operand.literal.filter(|_| text.starts_with(|c: char| c.is_ascii_digit()))
    }

    /// Detects `10 ^ 2`: a power as other languages write it. Masks are written as `0x…`.
    fn exclusive_or(&self, operands: [TypedOperand; 2]) -> Option<ConstantDoubt> {
        let is_decimal = |text: &str| text.bytes().all(|b| b.is_ascii_digit()) && !text.is_empty();
        let [left, right] = operands.map(|operand| self.text(operand.span));
        let [a, b] = operands.map(|operand| operand.literal.map(|n| n as i64));
        let is_slip = is_decimal(left) && is_decimal(right);
        let result = a.zip(b).filter(|_| is_slip).map(|(a, b)| (a ^ b) as i32)?;
        let says = format!("{result}: `^` is the exclusive or of the bits");
        let help = Help::from(format!("a power is `{left} ** {right}`"));
        Some((says, help.with(text(result.to_string()).same())))
    }
}

/// What a MATH does besides, and a contact does not.
const STATUS: [&str; 2] = [", and turns `$DivideByZero` ON", ", and turns `$OutOfRange` ON"];

fn by_zero() -> ConstantDoubt {
    let says = "a division by 0: it gives 0, and turns `$DivideByZero` ON";
    (says.to_owned(), "divide by another number, or by a word".into())
}

fn out_of_range() -> String {
    "always 0, and turns `$OutOfRange` ON".to_owned()
}

fn shift(count: Option<f64>) -> Option<Help> {
    let help = Help::from("the operators on bits take 32 bits: shift by 0 to 31");
    count.filter(|count| !(0.0..=31.0).contains(count)).map(|_| help)
}

fn power(number_type: NumberType, left: Option<f64>, right: Option<f64>) -> Option<ConstantDoubt> {
    let exponent = right?;
    if left == Some(0.0) && exponent < 0.0 {
        return Some(by_zero());
    }
    if number_type == NumberType::Integer && exponent < 0.0 {
        let help = format!("a real keeps the fraction: write the exponent as `{exponent}.0`");
        return Some((out_of_range(), help.into()));
    }
    let is_outside = left.is_some_and(|base| base < 0.0) && exponent.fract() != 0.0;
    let help = "a number below 0 has powers of whole exponents alone";
    is_outside.then(|| (out_of_range(), help.into()))
}
