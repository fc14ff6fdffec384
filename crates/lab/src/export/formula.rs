//! Expressions of MATH and of contacts as functions of IEC 61131-3.
//!
//! rungd calculates whole numbers in 64 bits and reals in binary64. Here a whole number is a DINT
//! as long as none of its possible values is beyond 32 bits, else an LINT; a real is an LREAL. An
//! expression whose values could be beyond 64 bits is refused, so nothing wraps. Bits stay power,
//! that is contacts. A divisor that can be 0 is replaced by 1 and the result by 0.

use super::formula_values::{FormulaResult, WholeResult, converted, is_short};
use super::functions::{of_two, select};
use super::literals::CallLiteral;
use super::project::{CallSource, NetworkPower};
use super::refusal::{self, ExportRefusal};
use super::rung_acts::RungExport;
use rungd_engine::isa::{Function, Word};
use rungd_language::resolve::formula::{Binary, Formula, FormulaPart, NumberType, Unary};
use rungd_language::source::span::Span;

/// A refusal of a part of an expression.
fn refused(span: Span, what: impl Into<String>) -> ExportRefusal {
    ExportRefusal::new(span, what, refusal::NOT_YET)
}

impl RungExport<'_, '_> {
    /// The value of an expression.
    pub(super) fn formula(
        &mut self,
        formula: &Formula,
        span: Span,
    ) -> Result<FormulaResult, ExportRefusal> {
        let mut waiting: Vec<FormulaResult> = Vec::new();
        for part in &formula.parts {
            let operands = waiting.split_off(waiting.len().saturating_sub(part.operand_count()));
            waiting.push(self.formula_part(part, operands, span)?);
        }
        waiting.pop().ok_or_else(|| refused(span, "an empty expression"))
    }

    fn formula_part(
        &mut self,
        part: &FormulaPart,
        operands: Vec<FormulaResult>,
        span: Span,
    ) -> Result<FormulaResult, ExportRefusal> {
        let mut operands = operands.into_iter();
        let mut next = || operands.next().ok_or_else(|| refused(span, "an expression"));
        match part {
            FormulaPart::Integer(constant) => {
                Ok(FormulaResult::Whole(WholeResult::constant(constant.number)))
            }
            FormulaPart::Real(constant) => Ok(FormulaResult::Real(CallSource::Literal(
                CallLiteral::LongReal(constant.number().into()),
            ))),
            FormulaPart::Word(word) => self.formula_word(*word, span),
            FormulaPart::Bit(bit) => self.bit(*bit, span).map(FormulaResult::Power),
            FormulaPart::Element(array) => {
                let FormulaResult::Whole(index) = next()? else {
                    return Err(refused(span, "an index that is no whole number"));
                };
                self.element(*array, index, span)
            }
            FormulaPart::Unary(Unary::Not, _) => {
                let power = self.as_power(next()?);
                Ok(FormulaResult::Power(power.opposite()))
            }
            FormulaPart::Unary(Unary::Minus, number_type) => {
                let zero = FormulaResult::Whole(WholeResult::constant(0));
                let operator = TypedOperator::new(Binary::Subtract, *number_type);
                self.binary(operator, [zero, next()?], span)
            }
            FormulaPart::Unary(Unary::Complement, _) => Err(refused(span, "`~`")),
            FormulaPart::Binary(operator, number_type) => {
                let sides = [next()?, next()?];
                self.binary(TypedOperator::new(*operator, *number_type), sides, span)
            }
            FormulaPart::Call(function, _, number_type) => {
                let arguments: Vec<FormulaResult> = operands.collect();
                self.function(*function, arguments, *number_type, span)
            }
        }
    }

    fn formula_word(&mut self, word: Word, span: Span) -> Result<FormulaResult, ExportRefusal> {
        let found = self.word(word, span)?;
        if found.is_real {
            return Ok(FormulaResult::Real(converted("REAL_TO_LREAL", found.source)));
        }
        Ok(FormulaResult::Whole(WholeResult::of_word(word, found.source)))
    }

    fn binary(
        &mut self,
        operator: TypedOperator,
        sides: [FormulaResult; 2],
        span: Span,
    ) -> Result<FormulaResult, ExportRefusal> {
        let TypedOperator { operator, is_real } = operator;
        if let Some(power) = self.logic(operator, &sides) {
            return Ok(FormulaResult::Power(power));
        }
        let compares = [
            (Binary::Less, "LT"),
            (Binary::AtMost, "LE"),
            (Binary::Greater, "GT"),
            (Binary::AtLeast, "GE"),
            (Binary::Equal, "EQ"),
            (Binary::NotEqual, "NE"),
        ];
        let compare = compares.iter().find(|(compare, _)| *compare == operator);
        let has_real = sides.iter().any(|side| matches!(side, FormulaResult::Real(_)));
        if let Some((_, name)) = compare {
            let [left, right] = match has_real || is_real {
                true => sides.map(|side| self.as_real(side)),
                false => self.both_whole(sides).map(|side| side.source),
            };
            return Ok(FormulaResult::Power(self.compared(name, left, right)));
        }
        let names = [
            (Binary::Add, "ADD"),
            (Binary::Subtract, "SUB"),
            (Binary::Multiply, "MUL"),
            (Binary::Divide, "DIV"),
            (Binary::Remainder, "MOD"),
        ];
        let Some((_, name)) = names.into_iter().find(|(named, _)| *named == operator) else {
            return Err(refused(span, format!("`{}`", operator.sign())));
        };
        match is_real {
            true if operator == Binary::Remainder => Err(refused(span, "`%` of reals")),
            true => {
                let [left, right] = sides.map(|side| self.as_real(side));
                Ok(FormulaResult::Real(self.real_result(name, left, right)))
            }
            false => {
                let sides = self.both_whole(sides);
                self.whole_result(name, sides, span).map(FormulaResult::Whole)
            }
        }
    }

    /// What two bits give; `None`, if they or the operator are for numbers.
    fn logic(&mut self, operator: Binary, sides: &[FormulaResult; 2]) -> Option<NetworkPower> {
        if matches!(operator, Binary::AndAlso | Binary::OrElse) {
            let sides = sides.clone().map(|side| self.as_power(side));
            return Some(match operator == Binary::AndAlso {
                true => NetworkPower::all(sides),
                false => NetworkPower::any(sides),
            });
        }
        let [FormulaResult::Power(left), FormulaResult::Power(right)] = sides else { return None };
        let (left, right) = (left.clone(), right.clone());
        if operator == Binary::And {
            return Some(NetworkPower::all([left, right]));
        }
        if operator == Binary::Or {
            return Some(NetworkPower::any([left, right]));
        }
        let differ = NetworkPower::any([
            NetworkPower::all([left.clone(), right.clone().opposite()]),
            NetworkPower::all([left.opposite(), right]),
        ]);
        match (matches!(operator, Binary::Xor | Binary::NotEqual), operator == Binary::Equal) {
            (true, _) => Some(differ),
            (_, true) => Some(differ.opposite()),
            _ => None,
        }
    }

    /// A whole number's arithmetic, in the smallest type that has all of its results.
    fn whole_result(
        &mut self,
        name: &str,
        [left, right]: [WholeResult; 2],
        span: Span,
    ) -> Result<WholeResult, ExportRefusal> {
        let corners = |operation: fn(i128, i128) -> i128| {
            let ends = [left.low, left.high].into_iter().flat_map(|one| {
                [right.low, right.high].into_iter().map(move |other| operation(one, other))
            });
            let ends: Vec<i128> = ends.collect();
            let (low, high) = (ends.iter().min(), ends.iter().max());
            (low.copied().unwrap_or_default(), high.copied().unwrap_or_default())
        };
        let most = left.low.abs().max(left.high.abs());
        let (low, high) = match name {
            "ADD" => corners(|one, other| one + other),
            "SUB" => corners(|one, other| one - other),
            "MUL" => corners(|one, other| one * other),
            _ => (-most, most),
        };
        if low < i64::MIN.into() || high > i64::MAX.into() {
            return Err(ExportRefusal::new(
                span,
                "an expression whose values may be beyond 64 bits",
                refusal::BEYOND,
            ));
        }
        let is_long = left.is_long || right.is_long || !is_short(low, high);
        let [left, right] = if is_long { [left.long(), right.long()] } else { [left, right] };
        let type_name = if is_long { "LINT" } else { "DINT" };
        let has_zero = right.low <= 0 && right.high >= 0;
        let source = match (name, has_zero) {
            ("DIV" | "MOD", true) => {
                let divisor = self.stored_number(right.source, type_name);
                self.divided(name, left.source, divisor, [0, 1].map(CallLiteral::Whole))
            }
            _ => {
                let [left, right] = WholeResult::beside([left, right]);
                of_two(name, left, right)
            }
        };
        Ok(WholeResult { source, low, high, is_long })
    }

    fn real_result(&mut self, name: &str, left: CallSource, right: CallSource) -> CallSource {
        let is_constant = matches!(&right, CallSource::Literal(literal)
            if literal.number().is_some_and(|number| number != 0.0));
        if name != "DIV" || is_constant {
            return of_two(name, left, right);
        }
        let divisor = self.stored_number(right, "LREAL");
        self.divided(name, left, divisor, [0.0, 1.0].map(CallLiteral::LongReal))
    }

    /// A quotient or remainder that is 0 if the divisor is.
    fn divided(
        &mut self,
        name: &str,
        left: CallSource,
        divisor: CallSource,
        literals: [CallLiteral; 2],
    ) -> CallSource {
        let [zero, one] = literals.map(CallSource::Literal);
        let is_zero = self.compared("EQ", divisor.clone(), zero.clone());
        let safe = select(is_zero.clone(), divisor, one);
        select(is_zero, of_two(name, left, safe), zero)
    }

    fn function(
        &mut self,
        function: Function,
        arguments: Vec<FormulaResult>,
        number_type: NumberType,
        span: Span,
    ) -> Result<FormulaResult, ExportRefusal> {
        let is_real = number_type == NumberType::Real;
        let refuse = || Err(refused(span, format!("`{}()`", function.spec().name)));
        match (function, &arguments[..]) {
            (Function::If, [condition, on, off]) => {
                let condition = self.as_power(condition.clone());
                let sides = [off.clone(), on.clone()];
                Ok(self.chosen(condition, sides, is_real))
            }
            (Function::Min | Function::Max | Function::Sum, [first, rest @ ..]) => {
                let mut result = first.clone();
                for next in rest {
                    result = self.folded(function, [result, next.clone()], number_type, span)?;
                }
                Ok(result)
            }
            (Function::Clamp, [value, low, high]) => {
                let sides = [value.clone(), high.clone()];
                let most = self.folded(Function::Min, sides, number_type, span)?;
                self.folded(Function::Max, [most, low.clone()], number_type, span)
            }
            (Function::Abs, [value]) => {
                let zero = FormulaResult::Whole(WholeResult::constant(0));
                let value = self.steady(value.clone());
                let operator = TypedOperator::new(Binary::Subtract, number_type);
                let minus = self.binary(operator, [zero, value.clone()], span)?;
                self.folded(Function::Max, [value, minus], number_type, span)
            }
            (Function::Scale, [value, in_low, in_high, out_low, out_high]) => {
                let bounds =
                    [in_low, in_high, out_low, out_high].map(|bound| self.as_real(bound.clone()));
                let value = self.as_real(value.clone());
                Ok(FormulaResult::Real(self.scaled(value, bounds)))
            }
            (Function::Toreal, [value]) => Ok(FormulaResult::Real(self.as_real(value.clone()))),
            _ => refuse(),
        }
    }

    /// `scale()`: each step is the operator.
    fn scaled(&mut self, value: CallSource, bounds: [CallSource; 4]) -> CallSource {
        let [in_low, in_high, out_low, out_high] = bounds;
        let in_low = self.stored_number(in_low, "LREAL");
        let out_low = self.stored_number(out_low, "LREAL");
        let way = of_two("SUB", value, in_low.clone());
        let width = of_two("SUB", out_high, out_low.clone());
        let share =
            self.real_result("DIV", of_two("MUL", way, width), of_two("SUB", in_high, in_low));
        of_two("ADD", out_low, share)
    }

    /// The least, the greatest or the sum of two values.
    fn folded(
        &mut self,
        function: Function,
        sides: [FormulaResult; 2],
        number_type: NumberType,
        span: Span,
    ) -> Result<FormulaResult, ExportRefusal> {
        if function == Function::Sum {
            return self.binary(TypedOperator::new(Binary::Add, number_type), sides, span);
        }
        let is_min = function == Function::Min;
        let name = if is_min { "MIN" } else { "MAX" };
        if number_type == NumberType::Real {
            let [left, right] = sides.map(|side| self.as_real(side));
            return Ok(FormulaResult::Real(of_two(name, left, right)));
        }
        let [left, right] = self.both_whole(sides);
        let of = |one: i128, other: i128| if is_min { one.min(other) } else { one.max(other) };
        let (low, high) = (of(left.low, right.low), of(left.high, right.high));
        let is_long = left.is_long;
        let [left, right] = WholeResult::beside([left, right]);
        let source = of_two(name, left, right);
        Ok(FormulaResult::Whole(WholeResult { source, low, high, is_long }))
    }

    /// One of two values, the second while the power is ON.
    fn chosen(
        &mut self,
        power: NetworkPower,
        [off, on]: [FormulaResult; 2],
        is_real: bool,
    ) -> FormulaResult {
        match (off, on) {
            (FormulaResult::Power(off), FormulaResult::Power(on)) => {
                FormulaResult::Power(NetworkPower::any([
                    NetworkPower::all([power.clone(), on]),
                    NetworkPower::all([power.opposite(), off]),
                ]))
            }
            (off, on) if is_real => {
                let (off, on) = (self.as_real(off), self.as_real(on));
                FormulaResult::Real(select(power, off, on))
            }
            (off, on) => {
                let [off, on] = self.both_whole([off, on]);
                let (low, high) = (off.low.min(on.low), off.high.max(on.high));
                let is_long = off.is_long;
                let [off, on] = WholeResult::beside([off, on]);
                let source = select(power, off, on);
                FormulaResult::Whole(WholeResult { source, low, high, is_long })
            }
        }
    }
}

/// An operator, and whether it calculates in reals.
struct TypedOperator {
    operator: Binary,
    is_real: bool,
}

impl TypedOperator {
    fn new(operator: Binary, number_type: NumberType) -> TypedOperator {
        TypedOperator { operator, is_real: number_type == NumberType::Real }
    }
}
