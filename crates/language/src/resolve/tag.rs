//! A tag of a resolved program. Made by `tags` and `array_tags`; the names of a program are made of
//! its tags.

use std::borrow::Cow;
use std::sync::Arc;

use super::alarm_terms::AlarmTerms;
use super::array::Array;
use super::value_texts::ValueTexts;
use crate::source::atom::ConstantForm;
use crate::source::indexed::IndexedName;
use crate::source::reader::Text;
use crate::source::span::Span;
use rungd_engine::isa::{Address, Real};

/// A tag, resolved.
#[derive(Clone, Debug)]
pub struct Tag {
    /// Its name.
    pub name: String,
    /// The place of its name.
    pub span: Span,
    /// `doc`.
    pub doc: Option<String>,
    /// Its meaning.
    pub meaning: TagMeaning,
    /// `initial`: the content of the cell after a cold start (for a bit: 0 or 1).
    pub initial: Option<(i32, Span)>,
    /// `min`, as the content of the cell.
    pub min: Option<(i32, Span)>,
    /// `max`, as the content of the cell.
    pub max: Option<(i32, Span)>,
    /// `alarm` of a bit.
    pub alarm: Option<String>,
    /// The terms of the alarm.
    pub(crate) terms: AlarmTerms,
    /// `log = "change"`.
    pub(crate) log_changes: bool,
    /// `unit` of a word.
    pub unit: Option<Text>,
    /// `texts`: the texts of its values.
    pub texts: Option<Arc<ValueTexts>>,
    /// `metric = true`.
    pub metric: bool,
    /// `spare = true`.
    pub(crate) spare: bool,
    /// Whether the ladder names it.
    pub used: bool,
    /// Its array, if it is an element: the program has a tag for each element (`recipe[3]`).
    pub of_array: Option<OfArray>,
}

/// The limits of a tag, each with its place, if it is given.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TagLimits {
    pub min: Option<(i32, Span)>,
    pub max: Option<(i32, Span)>,
}

/// The place of an element in its array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OfArray {
    /// The array.
    pub array: Array,
    /// The number of the element.
    pub at: u32,
}

impl Tag {
    /// The name of the array that it is an element of; else its own name.
    pub fn array_name(&self) -> Cow<'_, str> {
        match self.of_array.and_then(|_| IndexedName::of(&self.name)) {
            Some(IndexedName { base, behind: "", .. }) => Cow::Borrowed(base),
            Some(field) => Cow::Owned(field.column()),
            None => Cow::Borrowed(&self.name),
        }
    }

    /// Whether its value is shown to people, so that the ladder need not name it.
    pub(crate) fn is_shown(&self) -> bool {
        self.alarm.is_some() || self.log_changes || self.metric
    }

    /// The group of its alarm.
    pub fn alarm_group(&self) -> Option<&str> {
        self.terms.group.as_deref()
    }
}

/// The meaning of a tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TagMeaning {
    /// `at`; for a tag with a `type`, the address of its place.
    Address(Address),
    /// `value`.
    Constant(i32, ConstantForm),
    /// `value`, a real.
    Real(Real),
    /// `at` with `count`. Only the scope has this meaning; the program has a tag for each element.
    Array(Array),
}
