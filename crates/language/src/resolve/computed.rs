//! Resolves the arithmetic of contacts: sides of compares that compute, two bits compared with each
//! other, and bits whose index computes.
//!
//! Part of `contact`. A side that turns out to be one constant or word stays a plain compare, so
//! that it has the operation, the history and the findings of one.

use super::Resolver;
use super::array::ArrayElement;
use super::formula::{Formula, FormulaInteger, FormulaPart, NumberType};
use super::formula_operands::{OperandForm, TypedOperand};
use super::program::{ComputedCompare, ComputedContact, Contact, Value};
use super::scope::NamedThing;
use crate::source::atom::Atom;
use crate::source::contact::Comparison;
use crate::source::contact_side::{CompareSide, ContactExpression};
use crate::source::expression::{Binary, Expression, ExpressionPart, ExpressionPartKind};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{advise, possible, proposed};
use crate::source::span::Span;
use rungd_engine::isa::{Address, Structure, Word};

/// A side of a compare.
struct ResolvedSide {
    formula: Formula,
    operand: TypedOperand,
    /// The constant or word, if it is nothing else.
    plain: Option<Value>,
}

impl ResolvedSide {
    /// Whether it is a single bit.
    fn is_bit(&self) -> bool {
        self.operand.form == OperandForm::Bit
    }
}

impl Resolver<'_> {
    /// Resolves a compare.
    pub(super) fn compare(
        &mut self,
        left: &CompareSide,
        right: &CompareSide,
        comparison: Comparison,
        span: Span,
    ) -> Option<Contact> {
        let are_bits = [left, right].map(|side| self.is_bit_side(side));
        // Resolves both before returning, so that mistakes in both are reported.
        let sides = [left, right].map(|side| match side {
            CompareSide::Atom(atom) if are_bits != [true; 2] => self.atom_side(atom),
            CompareSide::Atom(atom) => {
                let name = atom.name().unwrap_or_default().to_owned();
                let part = ExpressionPart { kind: ExpressionPartKind::Name(name), span: atom.span };
                self.expression_side(&Expression { parts: vec![part] })
            }
            CompareSide::Computed(computed) => self.expression_side(&computed.expression),
        });
        let [left, right] = sides;
        let (left, right) = (left?, right?);
        if let (Some(a), Some(b)) = (left.plain, right.plain) {
            return Some(Contact::Compare(a, comparison, b, span));
        }
        if left.is_bit() != right.is_bit() {
            let bit = if left.is_bit() { left.operand.span } else { right.operand.span };
            self.find(lone_bit(self.text(bit), bit));
            return None;
        }
        self.doubt_compare(&left, &right);
        let number_type = left.operand.of.with(right.operand.of);
        let right = right.formula;
        let compare = Some(ComputedCompare { comparison, right, number_type });
        Some(Contact::Computed(Box::new(ComputedContact { left: left.formula, compare }), span))
    }

    /// Resolves a bit of an array whose index computes.
    pub(super) fn computed_bit(&mut self, computed: &ContactExpression) -> Option<Contact> {
        if self.has_differences(&computed.expression) {
            return None;
        }
        let (formula, operand) = self.contact_expression(&computed.expression)?;
        let name = self.text(computed.span).trim().to_owned();
        match formula.parts[..] {
            [FormulaPart::Bit(bit)] => return Some(Contact::Bit(bit, computed.span)),
            [FormulaPart::Word(index), FormulaPart::Element(array)] if array.is_bits() => {
                return Some(Contact::Element(ArrayElement { array, index }, computed.span));
            }
            _ => {}
        }
        if operand.form != OperandForm::Bit {
            let message = format!("`{name}` is a word, not a bit");
            let finding = Finding::new(Code::OperandType, computed.span, message);
            let help = advise("compare it: `{}`", [proposed(format!("{name} != 0"))]);
            self.find(finding.label("a bit belongs here").help(help));
            return None;
        }
        let contact = ComputedContact { left: formula, compare: None };
        Some(Contact::Computed(Box::new(contact), computed.span))
    }

    /// Whether a side is the name of a single bit.
    pub(super) fn is_bit_side(&self, side: &CompareSide) -> bool {
        let Some(name) = side.atom().and_then(Atom::name) else {
            // Parentheses do not make a number of a bit.
            let CompareSide::Computed(computed) = side else { return false };
            return match &computed.expression.parts[..] {
                [ExpressionPart { kind: ExpressionPartKind::Name(name), .. }] => self.is_bit(name),
                [.., ExpressionPart { kind: ExpressionPartKind::WordBit(_), .. }] => true,
                [.., ExpressionPart { kind: ExpressionPartKind::Element(name), .. }] => {
                    self.scope.column(&name.value).is_ok_and(|column| column.array.is_bits())
                }
                _ => false,
            };
        };
        self.is_bit(name)
    }

    fn is_bit(&self, name: &str) -> bool {
        match self.scope.look_up(name).map(|found| found.thing) {
            Ok(NamedThing::Address(Address::Bit(_))) => true,
            Ok(NamedThing::Element(element)) => element.array.is_bits(),
            Ok(
                NamedThing::Address(_)
                | NamedThing::Constant(..)
                | NamedThing::Real(_)
                | NamedThing::Block(_)
                | NamedThing::Device(_)
                | NamedThing::Record(_)
                | NamedThing::Array(_),
            )
            | Err(_) => false,
        }
    }

    /// A side that is a name or constant.
    fn atom_side(&mut self, atom: &Atom) -> Option<ResolvedSide> {
        if atom.name().is_some_and(|name| self.is_difference(name, atom.span)) {
            return None;
        }
        let value = self.value(atom)?;
        let number_type = if value.is_real() { NumberType::Real } else { NumberType::Integer };
        let operand = TypedOperand::new(number_type, atom.span);
        Some(ResolvedSide { formula: value.formula(), operand, plain: Some(value) })
    }

    /// A side that is an expression.
    fn expression_side(&mut self, expression: &Expression) -> Option<ResolvedSide> {
        if self.has_differences(expression) {
            return None;
        }
        self.doubt_timers(expression);
        let (formula, operand) = self.contact_expression(expression)?;
        let plain = match formula.parts[..] {
            [FormulaPart::Integer(FormulaInteger { number, form })] => {
                i32::try_from(number).ok().map(|number| Value::Const(number, form))
            }
            [FormulaPart::Real(real)] => Some(Value::Real(real)),
            [FormulaPart::Word(word)] => Some(Value::Word(word)),
            [FormulaPart::Word(index), FormulaPart::Element(array)] if !array.is_bits() => {
                Some(Value::Element(ArrayElement { array, index }))
            }
            _ => None,
        };
        Some(ResolvedSide { formula, operand, plain })
    }

    /// As [`Resolver::expression`], for a contact, which touches no status bit.
    fn contact_expression(&mut self, expression: &Expression) -> Option<(Formula, TypedOperand)> {
        self.is_in_contact = true;
        let resolved = self.expression(expression);
        self.is_in_contact = false;
        resolved
    }

    /// Reports each `D0-D1` in an expression; returns whether there was one.
    fn has_differences(&mut self, expression: &Expression) -> bool {
        let before = self.findings.len();
        for part in &expression.parts {
            if let ExpressionPartKind::Name(name) = &part.kind {
                self.is_difference(name, part.span);
            }
        }
        self.findings.len() > before
    }

    /// Reports `D0-D1`, which is read as one name; returns whether it did.
    pub(super) fn is_difference(&mut self, name: &str, span: Span) -> bool {
        let scope = &self.scope;
        let Some((left, right)) = name.split_once('-') else { return false };
        if scope.look_up(name).is_ok() || scope.look_up(left).is_err() {
            return false;
        }
        // A block's name may have a `-` itself.
        let right = match scope.look_up(right) {
            Ok(_) => right.to_owned(),
            Err(_) => right.replace('-', " - "),
        };
        let finding = Finding::new(Code::ContactSyntax, span, "a minus without spaces around it");
        self.findings.push(finding.write(format!("{left} - {right}")));
        true
    }

    /// The warning about a division of integers that is compared with a real.
    fn doubt_compare(&mut self, left: &ResolvedSide, right: &ResolvedSide) {
        let lost = |side: &ResolvedSide, other: &ResolvedSide| {
            let is_real = [side, other].iter().any(|side| side.operand.of == NumberType::Real);
            side.operand.division.filter(|_| is_real)
        };
        let Some((sign, [a, b])) = lost(left, right).or_else(|| lost(right, left)) else { return };
        self.doubt_division(sign, [a, b], "compared");
    }

    /// The warning about a bare integer that is added to the `.Acc` of a timer, or subtracted.
    fn doubt_timers(&mut self, expression: &Expression) {
        for parts in expression.parts.windows(3) {
            let [a, b, sum] = parts else { continue };
            let ExpressionPartKind::Binary(operator, _) = &sum.kind else { continue };
            let is_sum = matches!(operator, Binary::Add | Binary::Subtract);
            let bare = match (&a.kind, &b.kind) {
                (ExpressionPartKind::Integer(n), ExpressionPartKind::Name(name))
                    if self.is_time(name) =>
                {
                    Some((*n, a.span))
                }
                (ExpressionPartKind::Name(name), ExpressionPartKind::Integer(n))
                    if self.is_time(name) =>
                {
                    Some((*n, b.span))
                }
                _ => None,
            };
            let Some((n, span)) = bare.filter(|(n, _)| is_sum && *n != 0) else { continue };
            let message = format!("`{n}` beside a timer's `.Acc` is {n} ms");
            let finding = Finding::new(Code::BareTimerValue, span, message);
            let times = [format!("{n}ms"), format!("{n}s")].map(possible);
            self.find(finding.help(advise("a duration says its unit: `{}`, or `{}`", times)));
        }
    }

    /// Whether a name is the `.Acc` of a timer.
    fn is_time(&self, name: &str) -> bool {
        let thing = self.scope.look_up(name).map(|found| found.thing);
        matches!(thing, Ok(NamedThing::Address(Address::Word(Word::Acc(Structure::Timer(_))))))
    }
}

/// The finding for a bit that is compared with a number.
fn lone_bit(name: &str, span: Span) -> Finding {
    let name = name.trim_matches(['(', ')', ' ']);
    let message = format!("`{name}` is a bit, not a number");
    let help = "a bit stands alone in contacts: `{}`, or `{}`; it is compared with a bit alone; an \
                operator around it makes it 0 or 1";
    let texts = [name.to_owned(), format!("!{name}")].map(possible);
    let finding = Finding::new(Code::OperandType, span, message);
    finding.label("a number belongs here").help(advise(help, texts))
}

impl Value {
    /// The value as an expression.
    pub fn formula(self) -> Formula {
        let parts = match self {
            Value::Const(n, form) => {
                vec![FormulaPart::Integer(FormulaInteger { number: n.into(), form })]
            }
            Value::Real(real) => vec![FormulaPart::Real(real)],
            Value::Word(word) => vec![FormulaPart::Word(word)],
            Value::Element(element) => {
                vec![FormulaPart::Word(element.index), FormulaPart::Element(element.array)]
            }
        };
        Formula { parts }
    }
}
