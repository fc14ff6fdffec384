//! The sides of compares in contacts, and the elements with a computed index, as written.
//!
//! Made by `side_parser`. A side that is one name or constant stays an atom; any other is an
//! expression (`docs/semantics.md`, section 12). Names are not looked up here.

use std::fmt;

use super::atom::Atom;
use super::expression::Expression;
use super::span::Span;

/// A side of a compare.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CompareSide {
    /// A name or a constant.
    Atom(Atom),
    /// Anything that computes, and a name or constant in parentheses.
    Computed(ContactExpression),
}

/// An expression in a contact, and its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ContactExpression {
    /// The expression.
    pub expression: Expression,
    /// Its place, with the parentheses around it.
    pub span: Span,
}

impl CompareSide {
    /// Its place.
    pub fn span(&self) -> Span {
        match self {
            CompareSide::Atom(atom) => atom.span,
            CompareSide::Computed(computed) => computed.span,
        }
    }

    /// The atom; `None` for anything that computes.
    pub fn atom(&self) -> Option<&Atom> {
        match self {
            CompareSide::Atom(atom) => Some(atom),
            CompareSide::Computed(_) => None,
        }
    }
}

impl ContactExpression {
    /// The same expression with different places, which `place` returns.
    pub fn moved(&self, place: &mut dyn FnMut(Span) -> Span) -> ContactExpression {
        let span = place(self.span);
        ContactExpression { expression: self.expression.moved(place), span }
    }
}

impl From<Atom> for CompareSide {
    fn from(atom: Atom) -> CompareSide {
        CompareSide::Atom(atom)
    }
}

impl fmt::Display for CompareSide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CompareSide::Atom(atom) => atom.fmt(f),
            CompareSide::Computed(computed) => computed.fmt(f),
        }
    }
}

impl fmt::Display for ContactExpression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.expression.fmt(f)
    }
}
