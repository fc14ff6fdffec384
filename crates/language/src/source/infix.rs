//! The text of an expression in postfix order, with the parentheses that it needs.
//!
//! Displays written expressions, and is called by the book of names for resolved ones. A right
//! operand that binds as tightly as its operator has parentheses too, so that a reader need not
//! know the order.

use std::fmt;

use super::expression::{Binary, Expression, ExpressionPartKind, Unary};
use super::indexed::with_index;
use rungd_engine::isa::duration;

/// A part of an expression in postfix order.
pub enum InfixPart<'n> {
    /// A name or constant, as it is written.
    Operand(String),
    /// The element of a column with this name (`recipe[].target`); its index comes before it.
    Element(String),
    /// The bit with this number of the operand before it.
    WordBit(String),
    /// An operator with one operand.
    Unary(Unary),
    /// An operator with two operands.
    Binary(Binary),
    /// A function by its name, and the number of its arguments.
    Call(&'n str, u32),
}

/// Binds tighter than every operator.
const ATOM: u8 = u8::MAX;
/// How tightly `-`, `~` and `!` bind.
const UNARY: u8 = 11;

/// A part with its operands.
#[derive(Default)]
struct InfixText {
    text: String,
    /// How tightly its outermost operator binds.
    binds: u8,
}

impl InfixText {
    fn atom(text: String) -> InfixText {
        InfixText { text, binds: ATOM }
    }

    /// The text, in parentheses if it binds less tightly than `least`.
    fn within(self, least: u8) -> String {
        if self.binds < least { format!("({})", self.text) } else { self.text }
    }
}

/// The expression as an author would write it.
pub fn infix<'n>(parts: impl IntoIterator<Item = InfixPart<'n>>) -> String {
    let mut stack: Vec<InfixText> = Vec::new();
    for part in parts {
        let item = with_operands(part, &mut stack);
        stack.push(item);
    }
    stack.pop().map(|item| item.text).unwrap_or_default()
}

/// A part with its operands, which are taken from the stack.
fn with_operands(part: InfixPart<'_>, stack: &mut Vec<InfixText>) -> InfixText {
    let mut take = || stack.pop().unwrap_or_default();
    match part {
        InfixPart::Operand(text) => InfixText::atom(text),
        InfixPart::Element(name) => InfixText::atom(with_index(&name, &take().text)),
        InfixPart::WordBit(bit) => InfixText::atom(format!("{}.{bit}", take().text)),
        InfixPart::Unary(unary) => {
            let text = format!("{}{}", unary.sign(), take().within(UNARY));
            InfixText { text, binds: UNARY }
        }
        InfixPart::Binary(binary) => {
            let (right, left) = (take(), take());
            let binds = binary.precedence();
            let least = if binary == Binary::Power { binds + 1 } else { binds };
            let (left, right) = (left.within(least), right.within(binds + 1));
            InfixText { text: format!("{left} {} {right}", binary.sign()), binds }
        }
        InfixPart::Call(name, count) => {
            let mut arguments: Vec<String> = (0..count).map(|_| take().text).collect();
            arguments.reverse();
            InfixText::atom(format!("{name}({})", arguments.join(", ")))
        }
    }
}

/// A written part for its text.
fn infix_part(kind: &ExpressionPartKind) -> InfixPart<'_> {
    match kind {
        ExpressionPartKind::Integer(number) => InfixPart::Operand(number.to_string()),
        ExpressionPartKind::Duration(ms) => InfixPart::Operand(duration::print(*ms)),
        ExpressionPartKind::Real(real) => InfixPart::Operand(real.to_string()),
        ExpressionPartKind::Name(name) => InfixPart::Operand(name.clone()),
        ExpressionPartKind::Unary(operator) => InfixPart::Unary(*operator),
        ExpressionPartKind::Binary(operator, _) => InfixPart::Binary(*operator),
        ExpressionPartKind::Element(name) => InfixPart::Element(name.value.clone()),
        ExpressionPartKind::WordBit(bit) => InfixPart::WordBit(bit.value.clone()),
        ExpressionPartKind::Call(name, count) => InfixPart::Call(&name.value, *count),
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&infix(self.parts.iter().map(|part| infix_part(&part.kind))))
    }
}
