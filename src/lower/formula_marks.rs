//! The places of an expression where a part begins that is evaluated or left out: behind `&&` and
//! `||`, and in `if`.
//!
//! Called by `formula` before it walks the parts: a test stands before the part, but the operator
//! behind it.

use crate::isa::Function;
use crate::resolve::formula::{Binary, NumberType, Part};

/// What happens where a part begins that is evaluated or not.
#[derive(Clone, Copy)]
pub(super) enum Mark {
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
pub(super) fn marks(parts: &[Part]) -> Vec<Option<Mark>> {
    let mut marks = vec![None; parts.len()];
    // Where each waiting operand begins.
    let mut begins: Vec<usize> = Vec::new();
    for (at, part) in parts.iter().enumerate() {
        match part {
            Part::Integer(_) | Part::Real(_) | Part::Word(_) | Part::Bit(_) => begins.push(at),
            Part::Unary(..) | Part::Element(_) => {}
            Part::Binary(operator, _) => {
                let right = begins.pop().expect("an operator has two operands");
                if *operator == Binary::AndAlso {
                    marks[right] = Some(Mark::AndAlso);
                } else if *operator == Binary::OrElse {
                    marks[right] = Some(Mark::OrElse);
                }
            }
            Part::Call(function, count, of) => {
                let arguments = begins.split_off(begins.len() - *count as usize);
                if let (Function::If, [_, then, other]) = (function, &arguments[..]) {
                    marks[*then] = Some(Mark::Then);
                    marks[*other] = Some(Mark::Else(*of));
                }
                begins.push(arguments[0]);
            }
        }
    }
    marks
}
