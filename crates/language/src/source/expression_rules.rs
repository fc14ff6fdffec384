//! The rules for neighbouring operators of an expression: which are refused, and which cause a
//! warning if they have no parentheses.
//!
//! Called by `expression_parser`, once for each operator with two operands. A warning shows how the
//! expression is read.

use super::expression::{Binary, Unary};
use super::finding::{Code, Finding};
use super::fix::{advise, text as written};
use super::span::Span;

/// A complete operand: its place, and its outermost operator, unless the operand is in parentheses.
#[derive(Clone, Copy)]
pub(super) struct OperandTerm {
    pub span: Span,
    pub root: OperandRoot,
}

/// The outermost part of an operand.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum OperandRoot {
    /// A constant, a name, a call, or anything in parentheses.
    Closed,
    Unary(Unary),
    Binary(Binary),
}

/// An operator and its operands.
#[derive(Clone, Copy)]
pub(super) struct OperatorUse {
    pub operator: Binary,
    pub sign: Span,
    pub left: OperandTerm,
    pub right: OperandTerm,
}

impl OperatorUse {
    /// The finding for operators that must not be neighbours; `text` returns the text of a place.
    pub(super) fn mistake<'t>(&self, text: &impl Fn(Span) -> &'t str) -> Option<Finding> {
        let sign = self.operator.sign();
        let whole = self.left.span.to(self.right.span);
        let (left, right) = (text(self.left.span), text(self.right.span));
        let error = |message: String| Finding::new(Code::ExpressionSyntax, whole, message);
        if self.left.root == OperandRoot::Unary(Unary::Not) && self.operator.is_compare() {
            let inner = left.trim_start_matches('!').trim_start();
            let finding = error(format!("`!` binds tighter than `{sign}`"));
            return Some(
                finding
                    .label(format!("this would compare `{left}`"))
                    .write(format!("!({inner} {sign} {right})")),
            );
        }
        if let OperandRoot::Binary(first) = self.left.root
            && first.is_ordering()
            && self.operator.is_ordering()
        {
            let middle = left.rsplit(first.sign()).next().unwrap_or("").trim();
            let finding = error("two compares in a row".to_owned());
            let joined = format!("{left} && {middle} {sign} {right}");
            return Some(finding.help(advise("join them: `{}`", [joined])));
        }
        None
    }

    /// The warning for operators that are easily misread.
    pub(super) fn warning<'t>(&self, text: &impl Fn(Span) -> &'t str) -> Option<Finding> {
        let doubtful = |operand: OperandTerm| match operand.root {
            OperandRoot::Binary(inner) if is_doubtful(self.operator, inner) => Some(inner),
            OperandRoot::Binary(_) | OperandRoot::Unary(_) | OperandRoot::Closed => None,
        };
        let inner = doubtful(self.left).or(doubtful(self.right))?;
        let side = |operand: OperandTerm| match doubtful(operand) {
            Some(_) => format!("({})", text(operand.span)),
            None => text(operand.span).to_owned(),
        };
        let (sign, inner) = (self.operator.sign(), inner.sign());
        let message = format!("`{sign}` and `{inner}` are mixed without parentheses");
        let read = format!("{} {sign} {}", side(self.left), side(self.right));
        let read = written(read).same().at(self.left.span.to(self.right.span));
        let finding = Finding::new(Code::MixedOperators, self.sign, message);
        Some(
            finding
                .label(format!("`{inner}` binds tighter"))
                .help(advise("it is read as `{}`", [read])),
        )
    }
}

/// Whether two operators are easily misread without parentheses. `inner` binds tighter, and is the
/// operator of an operand of `outer`.
fn is_doubtful(outer: Binary, inner: Binary) -> bool {
    let is_sum = |operator| matches!(operator, Binary::Add | Binary::Subtract);
    (outer.is_bitwise() && (inner.is_compare() || (inner.is_bitwise() && inner != outer)))
        || (outer.is_shift() && is_sum(inner))
        || (outer == Binary::OrElse && inner == Binary::AndAlso)
}
