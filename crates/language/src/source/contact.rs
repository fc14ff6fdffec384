//! Contacts as written: a tree of names, with the place of every part.
//!
//! [`super::contact_parser`] reads one string of a leg's array for the reader of ladder files.
//! `Display` prints a contact with the necessary parentheses only, so that its text parses to the
//! same contact. Names are not looked up here; the resolver does that.

use std::fmt;

use super::atom::Atom;
use super::span::{Located, Span};

/// A boolean over bits, edges and compares.
///
/// The place of `!…`, `…&…` and `…|…` includes the parentheses around it, if it has any. `V` is the
/// type of a compare's values: names and constants in a ladder, and also sums of them in a test.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Contact<V = Atom> {
    /// A bit, by its name.
    Bit(Located<String>),
    /// `!`.
    Not(Box<Contact<V>>, Span),
    /// `&`: two or more.
    All(Vec<Contact<V>>, Span),
    /// `|`: two or more.
    Any(Vec<Contact<V>>, Span),
    /// `rise(…)`, `fall(…)` of any contacts.
    Edge(Edge, Box<Contact<V>>, Span),
    /// A compare of two values.
    Compare(V, Comparison, V, Span),
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

impl<V> Contact<V> {
    /// Its place.
    pub fn span(&self) -> Span {
        match self {
            Contact::Bit(name) => name.span,
            Contact::Not(_, span)
            | Contact::All(_, span)
            | Contact::Any(_, span)
            | Contact::Edge(_, _, span)
            | Contact::Compare(_, _, _, span) => *span,
        }
    }
}

impl<V: fmt::Display> fmt::Display for Contact<V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Contact::Bit(name) => f.write_str(&name.value),
            Contact::Not(inner, _) => write!(f, "!{}", Grouped(inner)),
            Contact::All(items, _) => series(f, items, " & "),
            Contact::Any(items, _) => series(f, items, " | "),
            Contact::Edge(edge, inner, _) => write!(f, "{}({inner})", edge.name()),
            Contact::Compare(a, comparison, b, _) => write!(f, "{a} {} {b}", comparison.sign()),
        }
    }
}

fn series<V: fmt::Display>(
    f: &mut fmt::Formatter<'_>,
    items: &[Contact<V>],
    sign: &str,
) -> fmt::Result {
    for (at, item) in items.iter().enumerate() {
        if at > 0 {
            f.write_str(sign)?;
        }
        match item {
            // `!` and compares need no parentheses beside `&` and `|`.
            Contact::Not(..) | Contact::Compare(..) => write!(f, "{item}")?,
            Contact::Bit(_) | Contact::Edge(..) | Contact::All(..) | Contact::Any(..) => {
                write!(f, "{}", Grouped(item))?;
            }
        }
    }
    Ok(())
}

/// A contact, in parentheses unless it is a bit or an edge.
struct Grouped<'a, V>(&'a Contact<V>);

impl<V: fmt::Display> fmt::Display for Grouped<'_, V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Contact::Bit(_) | Contact::Edge(..) | Contact::Not(..) => self.0.fmt(f),
            Contact::All(..) | Contact::Any(..) | Contact::Compare(..) => write!(f, "({})", self.0),
        }
    }
}
