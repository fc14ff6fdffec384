//! Comments behind lines: in a group of lines without a blank line, they begin in one column.
//!
//! The column is the most frequent one in the group, if the lines are short enough. So the columns
//! of a file stay as its author chose them. Called by `write` with all lines.

use crate::source::toml_tree::Tail;

/// The minimum number of spaces between a line and its comment.
const GAP: usize = 2;
/// The maximum column to which a long line moves the comments of its neighbours.
const COLUMN_MAX: usize = 70;

/// A line, or all lines of a string that has several lines.
#[derive(Debug, Default)]
pub(super) struct TextLine<'a> {
    pub(super) text: String,
    /// The comment behind the line.
    pub(super) tail: Option<Tail<'a>>,
}

/// The text of all lines with their comments.
pub(super) fn joined(lines: &[TextLine<'_>], line_end: &str) -> String {
    let mut text = String::with_capacity(lines.iter().map(|line| line.text.len() + 24).sum());
    for group in lines.chunk_by(|a, b| !a.is_blank() && !b.is_blank()) {
        let column = column(group);
        for line in group {
            text.push_str(&line.text);
            if let Some(tail) = line.tail {
                let end = line.end();
                let column = column.unwrap_or(tail.column).max(end + GAP);
                text.extend(std::iter::repeat_n(' ', column - end));
                text.push_str(tail.text);
            }
            text.push_str(line_end);
        }
    }
    text
}

/// The common column of the comments of a group, if one is possible.
fn column(group: &[TextLine<'_>]) -> Option<usize> {
    let tails = || group.iter().filter_map(|line| line.tail);
    let mut columns: Vec<usize> = tails().map(|tail| tail.column).collect();
    columns.sort_unstable();
    let mut most: (usize, usize) = (0, 0);
    for same in columns.chunk_by(|a, b| a == b) {
        if same.len() > most.0 {
            most = (same.len(), same[0]);
        }
    }
    let ends = group.iter().filter(|line| line.tail.is_some()).map(TextLine::end);
    let least = ends.max()? + GAP;
    (least <= COLUMN_MAX).then_some(most.1.max(least))
}

impl TextLine<'_> {
    fn is_blank(&self) -> bool {
        self.text.is_empty()
    }

    /// The number of characters of its last line.
    fn end(&self) -> usize {
        self.text.rsplit('\n').next().unwrap_or_default().chars().count()
    }
}
