//! The lines of a text, and the positions of the protocol: a line, and a column in UTF-16 units, or
//! in bytes if editor and server agreed on bytes.

use std::ops::Range;

use lsp_types::{Position, PositionEncodingKind, Range as Place};

/// The unit of a column.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum ColumnUnit {
    /// UTF-16 units, which every editor supports.
    #[default]
    Utf16,
    /// Bytes.
    Utf8,
}

impl ColumnUnit {
    /// The best unit that an editor offers.
    pub fn of(offered: Option<&Vec<PositionEncodingKind>>) -> ColumnUnit {
        match offered.is_some_and(|offered| offered.contains(&PositionEncodingKind::UTF8)) {
            true => ColumnUnit::Utf8,
            false => ColumnUnit::Utf16,
        }
    }

    /// Its name in the protocol.
    pub fn kind(self) -> PositionEncodingKind {
        match self {
            ColumnUnit::Utf16 => PositionEncodingKind::UTF16,
            ColumnUnit::Utf8 => PositionEncodingKind::UTF8,
        }
    }
}

/// The number of bytes between two marks of a text that is not ASCII.
const MARKED_BYTES: usize = 256;

/// Where the lines of a text begin. A line ends with `\n`, `\r\n` or `\r`.
#[derive(Clone, Debug)]
pub(super) struct LineIndex {
    starts: Vec<usize>,
    /// The number of UTF-16 units before every 256th byte, so that a position in a line of a
    /// megabyte costs no more than a position in a short line. Empty if every unit is a byte.
    marks: Vec<UnitMark>,
}

/// A byte at the start of a character.
#[derive(Clone, Copy, Debug)]
struct UnitMark {
    offset: usize,
    /// The number of units before that byte.
    units: usize,
}

impl LineIndex {
    /// The lines of a text.
    pub fn of(text: &str) -> LineIndex {
        let mut starts = vec![0];
        starts.extend(text.match_indices('\n').map(|(at, _)| at + 1));
        let lone = text.match_indices('\r').map(|(at, _)| at + 1);
        let lone: Vec<usize> = lone.filter(|at| !text[*at..].starts_with('\n')).collect();
        if !lone.is_empty() {
            starts.extend(lone);
            starts.sort_unstable();
        }
        let marks = if text.is_ascii() { Vec::new() } else { marks(text) };
        LineIndex { starts, marks }
    }

    /// The number of units of a text before a byte at the start of a character.
    fn units(&self, text: &str, offset: usize) -> usize {
        match self.marks.get(offset / MARKED_BYTES) {
            None => offset,
            Some(mark) => mark.units + text[mark.offset..offset].encode_utf16().count(),
        }
    }

    /// The number of the line that contains a byte.
    pub fn line(&self, offset: usize) -> usize {
        self.starts.partition_point(|start| *start <= offset).saturating_sub(1)
    }

    /// The bytes of a line, without the line end.
    pub fn span(&self, text: &str, line: usize) -> Range<usize> {
        let start = self.starts.get(line).copied().unwrap_or(text.len());
        let end = self.starts.get(line + 1).map_or(text.len(), |next| *next);
        start..start + text[start..end.max(start)].trim_end_matches(['\r', '\n']).len()
    }

    /// The lines with their line ends, without an empty line after the last line end.
    pub fn whole<'t>(&self, text: &'t str) -> impl DoubleEndedIterator<Item = &'t str> {
        let ends = self.starts.iter().skip(1).copied().chain([text.len()]);
        let bounds: Vec<(usize, usize)> = self.starts.iter().copied().zip(ends).collect();
        let lines = bounds.into_iter().map(|(start, end)| &text[start..end]);
        lines.filter(|line| !line.is_empty())
    }

    /// The position of a byte; for a byte within a character, the position of the character.
    pub fn position(&self, text: &str, columns: ColumnUnit, offset: usize) -> Position {
        let mut offset = offset.min(text.len());
        while !text.is_char_boundary(offset) {
            offset -= 1;
        }
        let line = self.line(offset);
        let start = self.starts[line];
        let column = match columns {
            ColumnUnit::Utf8 => offset - start,
            ColumnUnit::Utf16 => self.units(text, offset) - self.units(text, start),
        };
        Position::new(line as u32, column as u32)
    }

    /// The place of some bytes.
    pub fn place(&self, text: &str, columns: ColumnUnit, range: Range<usize>) -> Place {
        let position = |offset| self.position(text, columns, offset);
        Place::new(position(range.start), position(range.end))
    }

    /// The byte at a position. A column after the end of a line means the end of the line; a line
    /// after the end of the text means the end of the text.
    pub fn offset(&self, text: &str, columns: ColumnUnit, position: Position) -> usize {
        let line = self.span(text, position.line as usize);
        let wanted = position.character as usize;
        let is_bytes = columns == ColumnUnit::Utf8 || self.marks.is_empty();
        let offset = match is_bytes {
            true => line.start.saturating_add(wanted),
            false => self.offset_of_unit(text, self.units(text, line.start) + wanted),
        };
        (offset.min(line.end)..=line.end).find(|at| text.is_char_boundary(*at)).unwrap_or(line.end)
    }

    /// The first character that has at least `wanted` units before it.
    fn offset_of_unit(&self, text: &str, wanted: usize) -> usize {
        let behind = self.marks.partition_point(|mark| mark.units <= wanted);
        let mark = self.marks[behind.saturating_sub(1)];
        let mut units = mark.units;
        for (at, c) in text[mark.offset..].char_indices() {
            if units >= wanted {
                return mark.offset + at;
            }
            units += c.len_utf16();
        }
        text.len()
    }
}

/// The marks of a text, the first one at its start.
fn marks(text: &str) -> Vec<UnitMark> {
    let mut marks = Vec::with_capacity(text.len() / MARKED_BYTES + 1);
    let (mut units, mut offset) = (0, 0);
    for due in (0..=text.len()).step_by(MARKED_BYTES) {
        let start = (0..=due).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0);
        units += text[offset..start].encode_utf16().count();
        offset = start;
        marks.push(UnitMark { offset, units });
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_utf_16_units_and_exclude_the_carriage_return() {
        let text = "a\u{1F600}b\r\n\u{e4}c";
        let lines = LineIndex::of(text);
        let at = |offset| lines.position(text, ColumnUnit::Utf16, offset);
        assert_eq!((at(5), at(6)), (Position::new(0, 3), Position::new(0, 4)));
        assert_eq!(at(10), Position::new(1, 1));
        assert_eq!(lines.position(text, ColumnUnit::Utf8, 10), Position::new(1, 2));
        for offset in [0, 1, 5, 6, 8, 10, 11] {
            for columns in [ColumnUnit::Utf16, ColumnUnit::Utf8] {
                assert_eq!(
                    lines.offset(text, columns, lines.position(text, columns, offset)),
                    offset
                );
            }
        }
        assert_eq!(lines.offset(text, ColumnUnit::Utf16, Position::new(0, 99)), 6);
        assert_eq!(lines.offset(text, ColumnUnit::Utf16, Position::new(9, 9)), text.len());
        assert_eq!(lines.offset(text, ColumnUnit::Utf16, Position::new(0, 2)), 5);
        let lone = LineIndex::of("a\rb\n");
        assert_eq!(lone.position("a\rb\n", ColumnUnit::Utf8, 2), Position::new(1, 0));
    }
}
