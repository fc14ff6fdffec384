//! Contacts as written: a tree of names, with the place of every part.
//!
//! [`super::contact_parser`] reads one string of a leg's array for the reader of ladder files.
//! `Display` prints a contact with the necessary parentheses only, so that its text parses to the
//! same contact. Names are not looked up here; the resolver does that.

use std::fmt;

use super::contact_side::{CompareSide, ContactExpression};
use super::expression::Binary;
use super::span::{Located, Span};

/// A boolean over bits, edges and compares.
///
/// The place of `!…`, `…&…` and `…|…` includes the parentheses around it, if it has any.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WrittenContact {
    /// A bit, by its name.
    Bit(Located<String>),
    /// `!`.
    Not(Box<WrittenContact>, Span),
    /// `&`: two or more.
    All(Vec<WrittenContact>, Span),
    /// `|`: two or more.
    Any(Vec<WrittenContact>, Span),
    /// `rise(…)`, `fall(…)` of any contacts.
    Edge(Edge, Box<WrittenContact>, Span),
    /// The bit of an array whose index computes: `gate[i + 1]`.
    Indexed(ContactExpression),
    /// A compare of two values.
    Compare(CompareSide, Comparison, CompareSide, Span),
}

/// The edge that a contact detects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Edge {
    Rise,
    Fall,
}

/// How two values are compared, as signed numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Comparison {
    Eq,
    Ne,
    Lt,
    Le,
    Gt,
    Ge,
}

impl Edge {
    /// The word as written.
    pub fn name(self) -> &'static str {
        match self {
            Edge::Rise => "rise",
            Edge::Fall => "fall",
        }
    }
}

impl Comparison {
    /// The sign as written.
    pub fn sign(self) -> &'static str {
        match self {
            Comparison::Eq => "==",
            Comparison::Ne => "!=",
            Comparison::Lt => "<",
            Comparison::Le => "<=",
            Comparison::Gt => ">",
            Comparison::Ge => ">=",
        }
    }

    /// The operator of MATH with the same sign.
    pub fn operator(self) -> Binary {
        match self {
            Comparison::Eq => Binary::Equal,
            Comparison::Ne => Binary::NotEqual,
            Comparison::Lt => Binary::Less,
            Comparison::Le => Binary::AtMost,
            Comparison::Gt => Binary::Greater,
            Comparison::Ge => Binary::AtLeast,
        }
    }

    /// The opposite comparison: it is ON if this one is OFF.
    pub fn negated(self) -> Comparison {
        match self {
            Comparison::Eq => Comparison::Ne,
            Comparison::Ne => Comparison::Eq,
            Comparison::Lt => Comparison::Ge,
            Comparison::Le => Comparison::Gt,
            Comparison::Gt => Comparison::Le,
            Comparison::Ge => Comparison::Lt,
        }
    }
}

impl WrittenContact {
    /// Its place.
    pub fn span(&self) -> Span {
        match self {
            WrittenContact::Bit(name) => name.span,
            WrittenContact::Indexed(computed) => computed.span,
            WrittenContact::Not(_, span)
            | WrittenContact::All(_, span)
            | WrittenContact::Any(_, span)
            | WrittenContact::Edge(_, _, span)
            | WrittenContact::Compare(_, _, _, span) => *span,
        }
    }
}

impl fmt::Display for WrittenContact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WrittenContact::Bit(name) => f.write_str(&name.value),
            WrittenContact::Indexed(computed) => computed.fmt(f),
            WrittenContact::Not(inner, _) => write!(f, "!{}", GroupedContact(inner)),
            WrittenContact::All(items, _) => series(f, items, " & "),
            WrittenContact::Any(items, _) => series(f, items, " | "),
            WrittenContact::Edge(edge, inner, _) => write!(f, "{}({inner})", edge.name()),
            WrittenContact::Compare(a, comparison, b, _) => {
                write!(f, "{a} {} {b}", comparison.sign())
            }
        }
    }
}

fn series(f: &mut fmt::Formatter<'_>, items: &[WrittenContact], sign: &str) -> fmt::Result {
    for (at, item) in items.iter().enumerate() {
        if at > 0 {
            f.write_str(sign)?;
        }
        match item {
            // `!` and compares need no parentheses beside `&` and `|`.
            WrittenContact::Not(..) | WrittenContact::Compare(..) => write!(f, "{item}")?,
            WrittenContact::Bit(_)
            | WrittenContact::Indexed(_)
            | WrittenContact::Edge(..)
            | WrittenContact::All(..)
            | WrittenContact::Any(..) => {
                write!(f, "{}", GroupedContact(item))?;
            }
        }
    }
    Ok(())
}

/// A contact, in parentheses unless it is a bit or an edge.
struct GroupedContact<'a>(&'a WrittenContact);

impl fmt::Display for GroupedContact<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            WrittenContact::Bit(_)
            | WrittenContact::Indexed(_)
            | WrittenContact::Edge(..)
            | WrittenContact::Not(..) => self.0.fmt(f),
            WrittenContact::All(..) | WrittenContact::Any(..) | WrittenContact::Compare(..) => {
                write!(f, "({})", self.0)
            }
        }
    }
}
