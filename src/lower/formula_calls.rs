//! The functions of an expression as steps.
//!
//! Called by `formula`, once for each call, with the arguments on the stack of operands. Matches
//! every function of `isa::function`.

use super::formula::{Builder, Operand, Operator, Place, Source, fused, one, slot_of, two};
use crate::engine::ops::{Code, Fused, Other};
use crate::isa::Function;
use crate::resolve::formula::NumberType;

impl Builder<'_, '_> {
    pub(super) fn call(&mut self, function: Function, count: usize, of: NumberType) -> Operand {
        if function == Function::If {
            return self.end_of_if(of);
        }
        let arguments = self.operands.split_off(self.operands.len() - count);
        let kept = (of, of);
        let real = (NumberType::Real, NumberType::Real);
        match function {
            Function::Abs => self.one(one(of, Code::Abs, Code::RealAbs), arguments[0], kept),
            Function::Min => self.fold(two(of, Code::Min, Code::RealMin), &arguments, of),
            Function::Max => self.fold(two(of, Code::Max, Code::RealMax), &arguments, of),
            Function::Sum => self.fold(fused(of, Fused::Add, Fused::RealAdd), &arguments, of),
            Function::Clamp => self.clamp(&arguments, of),
            Function::Round => self.rounded(Code::Round, arguments[0], of),
            Function::Floor => self.rounded(Code::Floor, arguments[0], of),
            Function::Ceil => self.rounded(Code::Ceil, arguments[0], of),
            Function::Trunc => self.rounded(Code::Trunc, arguments[0], of),
            Function::Toreal => self.as_type(arguments[0], NumberType::Real),
            Function::Sqrt => self.one(Code::Sqrt, arguments[0], real),
            Function::Exp => self.one(Code::Exp, arguments[0], real),
            Function::Ln => self.one(Code::Ln, arguments[0], real),
            Function::Log10 => self.one(Code::Log10, arguments[0], real),
            Function::Sin => self.one(Code::Sin, arguments[0], real),
            Function::Cos => self.one(Code::Cos, arguments[0], real),
            Function::Tan => self.one(Code::Tan, arguments[0], real),
            Function::Asin => self.one(Code::Asin, arguments[0], real),
            Function::Acos => self.one(Code::Acos, arguments[0], real),
            Function::Atan => self.one(Code::Atan, arguments[0], real),
            Function::Atan2 => {
                self.both(Operator::Two(Code::Atan2), [arguments[0], arguments[1]], real)
            }
            Function::Scale => self.scale(&arguments),
            Function::If => unreachable!("it returned above"),
        }
    }

    /// An operand as a number of a type.
    fn as_type(&mut self, operand: Operand, of: NumberType) -> Operand {
        if operand.of == of {
            return operand;
        }
        Operand { place: Place::Slot(self.slot(operand, of)), of }
    }

    fn rounded(&mut self, code: Code, operand: Operand, of: NumberType) -> Operand {
        match of {
            NumberType::Integer => operand,
            NumberType::Real => self.one(code, operand, (of, NumberType::Integer)),
        }
    }

    /// An operation over all arguments, from left to right.
    fn fold(&mut self, operator: Operator, arguments: &[Operand], of: NumberType) -> Operand {
        // Slots of later arguments are in use until the last step.
        let before = self.next;
        let first = self.as_type(arguments[0], of);
        let whole = arguments[1..].iter().fold(first, |whole, argument| {
            self.next = self.next.max(before);
            self.both(operator, [whole, *argument], (of, of))
        });
        self.end_of_call(whole, arguments)
    }

    /// `clamp`: `max(min(x, hi), lo)`, which is lo where lo > hi.
    fn clamp(&mut self, arguments: &[Operand], of: NumberType) -> Operand {
        let before = self.next;
        let (min, max) = (two(of, Code::Min, Code::RealMin), two(of, Code::Max, Code::RealMax));
        let limited = self.both(min, [arguments[0], arguments[2]], (of, of));
        self.next = self.next.max(before);
        let limited = self.both(max, [limited, arguments[1]], (of, of));
        self.end_of_call(limited, arguments)
    }

    /// `scale`: its steps are the operators.
    fn scale(&mut self, arguments: &[Operand]) -> Operand {
        let sources: Vec<Source> =
            arguments.iter().map(|argument| self.source(*argument, NumberType::Real)).collect();
        let [x, in_lo, in_hi, out_lo, out_hi] = sources[..] else {
            unreachable!("the resolver counts arguments")
        };
        let run = self.stepped(Fused::RealSub, x, in_lo);
        let rise = self.stepped(Fused::RealSub, out_hi, out_lo);
        let product = self.stepped(Fused::RealMul, run, rise);
        let width = self.stepped(Fused::RealSub, in_hi, in_lo);
        let quotient = self.stepped(Fused::RealDiv, product, width);
        let whole = self.stepped(Fused::RealAdd, out_lo, quotient);
        let whole = Operand { place: Place::Slot(whole.number()), of: NumberType::Real };
        self.end_of_call(whole, arguments)
    }

    /// An operator with its result in a slot of its own.
    fn stepped(&mut self, operator: Fused, a: Source, b: Source) -> Source {
        let to = self.take_slot();
        self.step(operator.code(a.is_word(), b.is_word()), to, a.number(), b.number());
        Source::Slot(to)
    }

    /// The result of a call, in the lowest slot that its arguments had.
    fn end_of_call(&mut self, whole: Operand, arguments: &[Operand]) -> Operand {
        let Place::Slot(slot) = whole.place else { return whole };
        let mut used = arguments.to_vec();
        used.push(whole);
        let result = self.result(&used, whole.of);
        if slot_of(result) != slot {
            self.step(Code::Other(Other::Copy), slot_of(result), slot, 0);
        }
        result
    }
}
