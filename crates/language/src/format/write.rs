//! Writes pieces as lines: `=` in one column for a group of keys, values on one line or one element
//! on each line, comments behind lines in one column.
//!
//! Called by `format` with pieces that are in order. It chooses the line ends inside a value and
//! the number of spaces. It neither adds nor removes pieces.

use super::tails::{self, TextLine};
use crate::source::toml_tree::{
    Content, InlineTable, Piece, Tail, TextSlice, TomlArray, TomlHead, TomlPair, TomlRow,
};

/// The maximum length of a line in characters. An array that makes a line longer is split.
const LINE_CHARS_MAX: usize = 100;
/// The maximum length of a key or value that counts for a column. So one long key does not lengthen
/// many lines.
const CELL_CHARS_MAX: usize = 50;
/// The spaces before an element on a line of its own.
const INDENT: usize = 4;

/// The text of pieces, with this end of line.
pub(super) fn write(pieces: &[Piece<'_>], line_end: &str) -> String {
    let mut writer = TomlWriter::default();
    let (mut rest, mut is_root) = (pieces, true);
    while !rest.is_empty() {
        let is_blank = |piece: &Piece<'_>| matches!(piece, Piece::Blank | Piece::Head(_));
        let length = rest.iter().position(is_blank).unwrap_or(rest.len()).max(1);
        let (run, later) = rest.split_at(length);
        is_root &= !matches!(run, [Piece::Head(_)]);
        writer.run(run, is_root);
        rest = later;
    }
    tails::joined(&writer.lines, line_end)
}

#[derive(Default)]
struct TomlWriter<'a> {
    lines: Vec<TextLine<'a>>,
    /// The line that is being written.
    line: String,
}

impl<'a> TomlWriter<'a> {
    /// Writes a group of keys and comments, or one other piece. The keys above the first header are
    /// not aligned.
    fn run(&mut self, run: &[Piece<'a>], is_root: bool) {
        let widths = run.iter().filter_map(|piece| match piece {
            Piece::Pair(pair) if !is_root && !is_list_of_tables(pair) => Some(key_chars(&pair.key)),
            Piece::Pair(_) | Piece::Blank | Piece::Remark(_) | Piece::Head(_) => None,
        });
        let width = widths.filter(|width| *width <= CELL_CHARS_MAX).max().unwrap_or(0);
        for piece in run {
            match piece {
                Piece::Blank => self.end(None),
                Piece::Remark(text) => {
                    self.line.push_str(text);
                    self.end(None);
                }
                Piece::Head(head) => self.head(head),
                Piece::Pair(pair) => {
                    let width = if is_list_of_tables(pair) { 0 } else { width };
                    self.pair(pair, width, ValuePosition::Lines(0));
                    self.end(pair.tail);
                }
            }
        }
    }

    /// Ends the line.
    fn end(&mut self, tail: Option<Tail<'a>>) {
        self.lines.push(TextLine { text: std::mem::take(&mut self.line), tail });
    }

    fn head(&mut self, head: &TomlHead<'a>) {
        let brackets = if head.is_array { ("[[", "]]") } else { ("[", "]") };
        self.line.push_str(brackets.0);
        key(&head.path, &mut self.line);
        self.line.push_str(brackets.1);
        self.end(head.tail);
    }

    fn pair(&mut self, pair: &TomlPair<'a>, width: usize, spot: ValuePosition) {
        key(&pair.key, &mut self.line);
        let gap = width.saturating_sub(key_chars(&pair.key));
        self.spaces(gap);
        self.line.push_str(" = ");
        self.value(&pair.value, spot);
    }

    fn spaces(&mut self, count: usize) {
        self.line.extend(std::iter::repeat_n(' ', count));
    }

    fn value(&mut self, value: &Content<'a>, spot: ValuePosition) {
        match value {
            Content::Scalar(text) => self.line.push_str(text),
            Content::Array(array) => match self.breaks(array, spot) {
                Some(indent) => self.split(array, indent),
                None => self.flat(array),
            },
            Content::Table(table) => self.table(&table.pairs, &[], spot.within_table()),
        }
    }

    /// The indent of an array on several lines; `None` if the array is on one line.
    fn breaks(&self, array: &TomlArray<'a>, spot: ValuePosition) -> Option<usize> {
        let (indent, is_free) = match spot {
            ValuePosition::Lines(indent) => (indent, true),
            ValuePosition::Line(indent) => (indent, false),
        };
        if array.has_remarks {
            return Some(indent);
        }
        (is_free && !array.is_empty() && (array.is_split || self.is_too_long(array)))
            .then_some(indent)
    }

    /// Whether the line would be too long with the array. An array that contains a string of
    /// several lines is never too long.
    fn is_too_long(&self, array: &TomlArray<'a>) -> bool {
        let mut trial = TomlWriter::default();
        trial.flat(array);
        let own = trial.line;
        let before = self.line.rsplit('\n').next().unwrap_or_default();
        // The comma behind an element.
        let comma = usize::from(before.starts_with(' '));
        !own.contains('\n') && before.chars().count() + own.chars().count() + comma > LINE_CHARS_MAX
    }

    fn flat(&mut self, array: &TomlArray<'a>) {
        self.line.push('[');
        let mut comma = "";
        for row in &array.rows {
            if let TomlRow::Element(value, _) = row {
                self.line.push_str(comma);
                self.value(value, ValuePosition::Line(0));
                comma = ", ";
            }
        }
        self.line.push(']');
    }

    fn split(&mut self, array: &TomlArray<'a>, indent: usize) {
        self.line.push('[');
        self.end(array.opening);
        let widths = columns(array);
        let last = array.rows.iter().rposition(|row| !matches!(row, TomlRow::Blank));
        for row in &array.rows[..last.map_or(0, |last| last + 1)] {
            match row {
                TomlRow::Blank => self.end(None),
                TomlRow::Remark(text) => {
                    self.spaces(indent + INDENT);
                    self.line.push_str(text);
                    self.end(None);
                }
                TomlRow::Element(value, tail) => {
                    self.spaces(indent + INDENT);
                    match value {
                        Content::Table(table) => {
                            self.table(&table.pairs, &widths, ValuePosition::Line(indent + INDENT));
                        }
                        Content::Array(_) | Content::Scalar(_) => {
                            self.value(value, ValuePosition::Lines(indent + INDENT));
                        }
                    }
                    self.line.push(',');
                    self.end(*tail);
                }
            }
        }
        self.spaces(indent);
        self.line.push(']');
    }

    /// Writes an inline table. `widths` are the widths of its pairs, with their commas.
    fn table(&mut self, pairs: &[TomlPair<'a>], widths: &[usize], spot: ValuePosition) {
        self.line.push('{');
        for (at, pair) in pairs.iter().enumerate() {
            self.line.push(' ');
            let start = self.line.len();
            self.pair(pair, 0, spot);
            if at + 1 < pairs.len() {
                self.line.push(',');
                let chars = self.line.get(start..).unwrap_or_default().chars().count();
                self.spaces(widths.get(at).map_or(0, |width| width.saturating_sub(chars)));
            }
        }
        self.line.push_str(if pairs.is_empty() { "}" } else { " }" });
    }
}

/// The position of a value: the indent of its line, and whether the value may take several lines.
#[derive(Clone, Copy)]
enum ValuePosition {
    Lines(usize),
    /// Within an inline table. Even there, an array with comments takes several lines.
    Line(usize),
}

impl ValuePosition {
    fn within_table(self) -> ValuePosition {
        match self {
            ValuePosition::Lines(indent) | ValuePosition::Line(indent) => {
                ValuePosition::Line(indent)
            }
        }
    }
}

/// Whether a value is a list of inline tables. The `=` of such a value is not aligned.
fn is_list_of_tables(pair: &TomlPair<'_>) -> bool {
    let Content::Array(array) = &pair.value else { return false };
    let is_table = |row: &TomlRow<'_>| matches!(row, TomlRow::Element(Content::Table(_), _));
    array.rows.iter().any(is_table)
}

fn key(parts: &[TextSlice<'_>], line: &mut String) {
    for (at, part) in parts.iter().enumerate() {
        line.push_str(if at == 0 { "" } else { "." });
        line.push_str(part);
    }
}

fn key_chars(parts: &[TextSlice<'_>]) -> usize {
    let chars: usize = parts.iter().map(|part| part.chars().count()).sum();
    chars + parts.len().saturating_sub(1)
}

/// The widths of the pairs in a list of inline tables that have the same keys and no arrays. Empty
/// for other arrays.
fn columns(array: &TomlArray<'_>) -> Vec<usize> {
    let mut widths: Vec<usize> = Vec::new();
    let mut keys: Option<Vec<&[TextSlice<'_>]>> = None;
    for row in &array.rows {
        let TomlRow::Element(value, _) = row else { continue };
        let Content::Table(InlineTable { pairs, .. }) = value else { return Vec::new() };
        let own: Vec<&[TextSlice<'_>]> = pairs.iter().map(|pair| &pair.key[..]).collect();
        if keys.get_or_insert_with(|| own.clone()) != &own {
            return Vec::new();
        }
        widths.resize(pairs.len(), 0);
        for (width, pair) in widths.iter_mut().zip(pairs) {
            let Content::Scalar(text) = pair.value else { return Vec::new() };
            let own = key_chars(&pair.key) + " = ,".len() + text.chars().count();
            *width = (*width).max(if own <= CELL_CHARS_MAX { own } else { 0 });
        }
    }
    widths
}
