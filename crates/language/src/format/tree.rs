//! A TOML file with its author's layout: the order of its parts, blank lines and comments.
//!
//! Made by [`super::parse`], spaced by [`super::blanks`], ordered by [`super::order`], and written
//! by [`super::write`]. Texts of keys, numbers and strings do not change.

/// A part of the file that begins a line.
#[derive(Debug)]
pub(super) enum Piece<'a> {
    /// One blank line, or several.
    Blank,
    /// A comment on a line of its own.
    Remark(&'a str),
    /// A header.
    Head(Head<'a>),
    /// A key with its value.
    Pair(Pair<'a>),
}

/// `[scan]`, `[[program.rung]]`.
#[derive(Debug)]
pub(super) struct Head<'a> {
    pub(super) path: Vec<&'a str>,
    /// Whether it has two brackets.
    pub(super) is_array: bool,
    pub(super) tail: Option<Tail<'a>>,
}

/// `leg.up = ["X0"]`.
#[derive(Debug)]
pub(super) struct Pair<'a> {
    pub(super) key: Vec<&'a str>,
    pub(super) value: Content<'a>,
    pub(super) tail: Option<Tail<'a>>,
}

/// A comment behind other text on the same line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tail<'a> {
    pub(super) text: &'a str,
    /// The number of characters before it on its line.
    pub(super) column: usize,
}

/// A value.
#[derive(Debug)]
pub(super) enum Content<'a> {
    /// A string, number, boolean or time, as written.
    Scalar(&'a str),
    Array(Array<'a>),
    /// An inline table.
    Table(Vec<Pair<'a>>),
}

/// An array.
#[derive(Debug, Default)]
pub(super) struct Array<'a> {
    /// The comment behind `[`.
    pub(super) opening: Option<Tail<'a>>,
    pub(super) rows: Vec<Row<'a>>,
    /// Whether its author wrote it on several lines.
    pub(super) is_split: bool,
    /// Whether it contains a comment.
    pub(super) has_remarks: bool,
}

/// A part of an array.
#[derive(Debug)]
pub(super) enum Row<'a> {
    /// One blank line, or several.
    Blank,
    /// A comment on a line of its own.
    Remark(&'a str),
    /// An element, with the comment behind it.
    Element(Content<'a>, Option<Tail<'a>>),
}

impl Array<'_> {
    /// Whether it has neither an element nor a comment.
    pub(super) fn is_empty(&self) -> bool {
        self.opening.is_none() && self.rows.iter().all(|row| matches!(row, Row::Blank))
    }
}

impl Content<'_> {
    /// Whether it contains a comment.
    pub(super) fn has_remarks(&self) -> bool {
        match self {
            Content::Scalar(_) => false,
            Content::Array(array) => array.has_remarks,
            Content::Table(pairs) => pairs.iter().any(|pair| pair.value.has_remarks()),
        }
    }
}
