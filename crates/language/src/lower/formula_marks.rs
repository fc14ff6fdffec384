//! The places of an expression where a conditional part begins: the right side of `&&` and `||`,
//! and the values of `if`.
//!
//! Called by `formula` before it walks the parts: the test must come before the conditional part,
//! but in postfix order its operator comes after that part.

use crate::resolve::formula::{Binary, FormulaPart, NumberType};
pub use rungd_engine::isa::Function;

/// The kind of conditional part that begins at a place.
#[derive(Clone, Copy)]
pub(super) enum FormulaMark {
    /// The right side of `&&`.
    AndAlso,
    /// The right side of `||`.
    OrElse,
    /// The second argument of `if`.
    Then,
    /// The third argument of `if`, and the type of its result.
    Else(NumberType),
}

/// The marks of a formula, by the part that begins there.
pub(super) fn marks(parts: &[FormulaPart]) -> Vec<Option<FormulaMark>> {
    let mut marks = vec![None; parts.len()];
    // The part at which each waiting operand begins.
    let mut begins: Vec<usize> = Vec::new();
    for (at, part) in parts.iter().enumerate() {
        match part {
            FormulaPart::Integer(_)
            | FormulaPart::Real(_)
            | FormulaPart::Word(_)
            | FormulaPart::Bit(_) => begins.push(at),
            FormulaPart::Unary(..) | FormulaPart::Element(_) => {}
            FormulaPart::Binary(operator, _) => {
                let right = begins.pop().expect("an operator has two operands");
                if *operator == Binary::AndAlso {
                    marks[right] = Some(FormulaMark::AndAlso);
                } else if *operator == Binary::OrElse {
                    marks[right] = Some(FormulaMark::OrElse);
                }
            }
            FormulaPart::Call(function, count, number_type) => {
                let arguments = begins.split_off(begins.len() - *count as usize);
                if let (Function::If, [_, then, other]) = (function, &arguments[..]) {
                    marks[*then] = Some(FormulaMark::Then);
                    marks[*other] = Some(FormulaMark::Else(*number_type));
                }
                begins.push(arguments[0]);
            }
        }
    }
    marks
}
