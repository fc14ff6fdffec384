//! A TOML text as its author wrote it: headers, keys, values, comments and blank lines, in their
//! order and with their places. Every text has a tree, even one that is not TOML.
//!
//! [`TomlTree::read`] makes it; `format` lays it out, and the editor finds the tables and values of
//! a file and the place of a cursor in it. It decodes no strings and checks nothing: whether a text
//! is TOML is decided by the `toml` crate alone.

use std::ops::{Deref, Range};

use toml_parser::Source;
use toml_parser::lexer::TokenKind::{Comment, Eof, Newline, Whitespace};

/// The contents of a text.
#[derive(Debug)]
pub struct TomlTree<'a> {
    /// Its parts, in order.
    pub pieces: Vec<Piece<'a>>,
    /// The position at which it ends.
    pub end: TextEnd,
}

/// The position at which a text ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextEnd {
    /// On a line without anything else, where a statement may begin.
    LineStart,
    /// In a comment.
    Comment,
    /// Within a statement, or behind it on its line.
    Statement,
}

/// A part of a text, with its place.
#[derive(Clone, Copy, Debug, Default)]
pub struct TextSlice<'a> {
    text: &'a str,
    start: usize,
}

/// A part of the file that begins a line.
#[derive(Debug)]
pub enum Piece<'a> {
    /// One blank line, or several.
    Blank,
    /// A comment on a line of its own.
    Remark(&'a str),
    /// A header.
    Head(TomlHead<'a>),
    /// A key with its value.
    Pair(TomlPair<'a>),
}

/// `[scan]`, `[[program.rung]]`.
#[derive(Debug)]
pub struct TomlHead<'a> {
    /// The parts of its name.
    pub path: Vec<TextSlice<'a>>,
    /// Whether it has two brackets.
    pub is_array: bool,
    /// From its first bracket to its last one, or to its name if no bracket closes it.
    pub span: Range<usize>,
    /// The comment behind it.
    pub tail: Option<Tail<'a>>,
}

/// `leg.up = ["X0"]`.
#[derive(Debug)]
pub struct TomlPair<'a> {
    /// The parts of its key; the last one is empty if it is missing: `leg.`.
    pub key: Vec<TextSlice<'a>>,
    /// Whether it has a `=`.
    pub is_assigned: bool,
    /// Its value; an empty scalar if it is missing.
    pub value: Content<'a>,
    /// The comment behind it.
    pub tail: Option<Tail<'a>>,
}

/// A comment behind other text on the same line.
#[derive(Clone, Copy, Debug)]
pub struct Tail<'a> {
    /// The comment, with its `#`.
    pub text: &'a str,
    /// The number of characters before it on its line.
    pub column: usize,
}

/// A value.
#[derive(Debug)]
pub enum Content<'a> {
    /// A string, number, boolean or time, as written.
    Scalar(TextSlice<'a>),
    /// An array.
    Array(TomlArray<'a>),
    /// An inline table.
    Table(InlineTable<'a>),
}

/// An array.
#[derive(Debug, Default)]
pub struct TomlArray<'a> {
    /// The comment behind `[`.
    pub opening: Option<Tail<'a>>,
    /// Its elements, comments and blank lines.
    pub rows: Vec<TomlRow<'a>>,
    /// Whether its author wrote it on several lines.
    pub is_split: bool,
    /// Whether it contains a comment.
    pub has_remarks: bool,
    /// Its brackets.
    pub brackets: Brackets,
}

/// An inline table.
#[derive(Debug)]
pub struct InlineTable<'a> {
    /// Its keys with their values.
    pub pairs: Vec<TomlPair<'a>>,
    /// Its braces.
    pub brackets: Brackets,
}

/// The brackets of an array or the braces of an inline table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Brackets {
    /// From the first one to the last one, or to the end of the text between them.
    pub span: Range<usize>,
    /// Whether the last one is present.
    pub is_closed: bool,
    /// Whether nothing follows the first one or the last comma between them.
    pub is_open_for_next: bool,
}

/// A part of an array.
#[derive(Debug)]
pub enum TomlRow<'a> {
    /// One blank line, or several.
    Blank,
    /// A comment on a line of its own.
    Remark(&'a str),
    /// An element, with the comment behind it.
    Element(Content<'a>, Option<Tail<'a>>),
}

/// The tokens of a text that are neither spaces nor comments.
pub fn tokens(text: &str) -> impl Iterator<Item = &str> {
    let all = Source::new(text).lex();
    let kept = all.filter(|token| !matches!(token.kind(), Whitespace | Newline | Comment | Eof));
    kept.map(|token| &text[token.span().start()..token.span().end()])
}

impl<'a> TextSlice<'a> {
    /// A place in a text.
    pub(crate) fn new(text: &'a str, span: Range<usize>) -> TextSlice<'a> {
        TextSlice { start: span.start, text: text.get(span).unwrap_or_default() }
    }

    /// The text itself.
    pub fn text(&self) -> &'a str {
        self.text
    }

    /// Its place.
    pub fn span(&self) -> Range<usize> {
        self.start..self.start + self.text.len()
    }

    /// The part between its quotes; the closing quote may be missing. The whole without quotes.
    pub fn unquoted(&self) -> TextSlice<'a> {
        match self.quote() {
            Some(_) => {
                let end = self.text.len() - usize::from(self.is_closed());
                TextSlice { text: &self.text[1..end], start: self.start + 1 }
            }
            None => *self,
        }
    }

    /// The quote that it begins with.
    pub fn quote(&self) -> Option<char> {
        self.text.chars().next().filter(|quote| matches!(quote, '"' | '\''))
    }

    /// Whether it is a text in quotes with its closing quote.
    pub fn is_closed(&self) -> bool {
        self.text.len() >= 2 && self.quote().is_some_and(|quote| self.text.ends_with(quote))
    }

    /// Whether it is a string that may have several lines.
    pub fn is_multi_line(&self) -> bool {
        self.text.starts_with("\"\"\"") || self.text.starts_with("'''")
    }
}

impl PartialEq for TextSlice<'_> {
    /// Whether the texts are equal, at whatever places.
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

impl Deref for TextSlice<'_> {
    type Target = str;

    fn deref(&self) -> &str {
        self.text
    }
}

impl TomlArray<'_> {
    /// Whether it has neither an element nor a comment.
    pub fn is_empty(&self) -> bool {
        self.opening.is_none() && self.rows.iter().all(|row| matches!(row, TomlRow::Blank))
    }
}

impl<'a> TomlRow<'a> {
    /// The element, if it is one.
    pub fn element(&self) -> Option<&Content<'a>> {
        match self {
            TomlRow::Element(value, _) => Some(value),
            TomlRow::Blank | TomlRow::Remark(_) => None,
        }
    }
}

impl Content<'_> {
    /// Its place.
    pub fn span(&self) -> Range<usize> {
        match self {
            Content::Scalar(text) => text.span(),
            Content::Array(array) => array.brackets.span.clone(),
            Content::Table(table) => table.brackets.span.clone(),
        }
    }

    /// Whether it contains a comment.
    pub fn has_remarks(&self) -> bool {
        match self {
            Content::Scalar(_) => false,
            Content::Array(array) => array.has_remarks,
            Content::Table(table) => table.pairs.iter().any(|pair| pair.value.has_remarks()),
        }
    }
}
