//! Expressions of MATH and of contacts as written: constants, names, operators and calls, with
//! their places.
//!
//! [`super::expression_parser`] makes them from a text. The parts are in postfix order: an
//! operator comes after its operands. So a loop with a stack of operands can visit an expression
//! of any length, without recursion that could exhaust the program's stack. Names are not looked
//! up here; the resolver does that.

use super::span::{Located, Span};
use rungd_engine::isa::Real;

/// The text after `MATH`: `target = expression`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrittenFormula {
    /// The name before the `=`; with an index, the name of a column: `recipe[].target`.
    pub target: Located<String>,
    /// The index of the target.
    pub index: Option<Expression>,
    /// The number of the bit behind the index, as written.
    pub bit: Option<Located<String>>,
    /// The expression behind the `=`.
    pub expression: Expression,
}

/// An expression.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Expression {
    /// Its parts, in postfix order; the last part is the outermost one.
    pub parts: Vec<ExpressionPart>,
}

/// A constant, a name, or an operator or call behind its operands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExpressionPart {
    /// The kind.
    pub kind: ExpressionPartKind,
    /// The place of the part with its operands and the parentheses around them.
    pub span: Span,
}

/// The kind of a part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExpressionPartKind {
    /// An integer. 2147483648 occurs only directly behind a unary `-`.
    Integer(i64),
    /// A duration in ms.
    Duration(i32),
    /// A real.
    Real(Real),
    /// The name of a word, a bit, a member or a constant.
    Name(String),
    /// An operator with one operand.
    Unary(Unary),
    /// An operator with two operands, and the place of its sign.
    Binary(Binary, Span),
    /// The element of a column (`recipe`, `recipe[].target`); its index comes before it.
    Element(Located<String>),
    /// The bit with this number, as written, of the operand before it, which is an element.
    WordBit(Located<String>),
    /// A function by its name, and the number of its arguments.
    Call(Located<String>, u32),
}

impl Expression {
    /// The same expression with different places, which `place` returns.
    pub fn moved(&self, place: &mut dyn FnMut(Span) -> Span) -> Expression {
        let parts = self
            .parts
            .iter()
            .map(|part| ExpressionPart { kind: part.kind.moved(place), span: place(part.span) });
        Expression { parts: parts.collect() }
    }
}

impl ExpressionPartKind {
    /// The same part with different places, which `place` returns.
    pub fn moved(&self, place: &mut dyn FnMut(Span) -> Span) -> ExpressionPartKind {
        let mut moved_name =
            |name: &Located<String>| Located { value: name.value.clone(), span: place(name.span) };
        match self {
            ExpressionPartKind::Element(name) => ExpressionPartKind::Element(moved_name(name)),
            ExpressionPartKind::WordBit(bit) => ExpressionPartKind::WordBit(moved_name(bit)),
            ExpressionPartKind::Call(name, count) => {
                ExpressionPartKind::Call(moved_name(name), *count)
            }
            ExpressionPartKind::Binary(operator, sign) => {
                ExpressionPartKind::Binary(*operator, place(*sign))
            }
            ExpressionPartKind::Integer(_)
            | ExpressionPartKind::Duration(_)
            | ExpressionPartKind::Real(_)
            | ExpressionPartKind::Name(_)
            | ExpressionPartKind::Unary(_) => self.clone(),
        }
    }
}

macro_rules! operators {
    ($(#[$doc:meta])* $operators:ident $($operator:ident $sign:literal)*) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[allow(missing_docs)]
        pub enum $operators { $($operator),* }

        impl $operators {
            /// All operators.
            pub const ALL: &[$operators] = &[$($operators::$operator),*];

            /// The sign as written.
            pub fn sign(self) -> &'static str {
                match self { $($operators::$operator => $sign),* }
            }
        }
    };
}

operators! {
    /// An operator with one operand.
    Unary Minus "-" Complement "~" Not "!"
}

operators! {
    /// An operator with two operands. If two signs begin with the same characters, the longer one
    /// comes first.
    Binary
    Power "**" Multiply "*" Divide "/" Remainder "%" Add "+" Subtract "-"
    ShiftLeft "<<" ShiftRightZeros ">>>" ShiftRight ">>"
    AtMost "<=" Less "<" AtLeast ">=" Greater ">" Equal "==" NotEqual "!="
    AndAlso "&&" And "&" Xor "^" OrElse "||" Or "|"
}

impl Binary {
    /// How tightly it binds: an operator with a greater number binds tighter.
    pub fn precedence(self) -> u8 {
        match self {
            Binary::Power => 10,
            Binary::Multiply | Binary::Divide | Binary::Remainder => 9,
            Binary::Add | Binary::Subtract => 8,
            Binary::ShiftLeft | Binary::ShiftRight | Binary::ShiftRightZeros => 7,
            Binary::Less | Binary::AtMost | Binary::Greater | Binary::AtLeast => 6,
            Binary::Equal | Binary::NotEqual => 5,
            Binary::And => 4,
            Binary::Xor => 3,
            Binary::Or => 2,
            Binary::AndAlso => 1,
            Binary::OrElse => 0,
        }
    }

    /// Whether it compares.
    pub fn is_compare(self) -> bool {
        self.is_ordering() || matches!(self, Binary::Equal | Binary::NotEqual)
    }

    /// Whether it is `<`, `<=`, `>` or `>=`.
    pub fn is_ordering(self) -> bool {
        matches!(self, Binary::Less | Binary::AtMost | Binary::Greater | Binary::AtLeast)
    }

    /// Whether it is `&`, `^` or `|`.
    pub fn is_bitwise(self) -> bool {
        matches!(self, Binary::And | Binary::Xor | Binary::Or)
    }

    /// Whether it is `<<`, `>>` or `>>>`.
    pub fn is_shift(self) -> bool {
        matches!(self, Binary::ShiftLeft | Binary::ShiftRight | Binary::ShiftRightZeros)
    }
}
