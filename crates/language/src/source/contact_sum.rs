//! Sums in the compares of a test's conditions, as written: `+ - * / %` with parentheses, and `&`
//! of bits within these.
//!
//! Made by `sum_parser`. The parts are in postfix order, so that a loop can visit a sum of any
//! length. Names are not looked up here.

use std::fmt;

use super::atom::Atom;
use super::span::Span;

/// A sum of names and constants, or a single name or constant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sum {
    /// Its parts in postfix order; the last part is the outermost one.
    pub parts: Vec<SumPart>,
    /// Its place, with the parentheses around it.
    pub span: Span,
    /// Its text as written.
    pub(super) text: Box<str>,
}

/// A part of a sum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SumPart {
    /// A name or constant.
    Value(Atom),
    /// An operator behind its two operands.
    Sign(SumSign),
}

/// A sign of a sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SumSign {
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
    /// `&`, bit by bit; within parentheses only, because outside it joins contacts.
    And,
}

impl SumSign {
    /// The sign as written.
    pub(super) fn sign(self) -> char {
        match self {
            SumSign::Add => '+',
            SumSign::Subtract => '-',
            SumSign::Multiply => '*',
            SumSign::Divide => '/',
            SumSign::Remainder => '%',
            SumSign::And => '&',
        }
    }

    /// How tightly it binds: an operator with a greater number binds tighter.
    pub(super) fn precedence(self) -> u8 {
        match self {
            SumSign::And => 0,
            SumSign::Add | SumSign::Subtract => 1,
            SumSign::Multiply | SumSign::Divide | SumSign::Remainder => 2,
        }
    }
}

impl From<Atom> for Sum {
    fn from(atom: Atom) -> Sum {
        let (span, text) = (atom.span, atom.to_string().into());
        Sum { parts: vec![SumPart::Value(atom)], span, text }
    }
}

impl fmt::Display for Sum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
