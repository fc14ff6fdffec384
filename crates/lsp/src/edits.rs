//! Applies the changes that an editor makes to a text.
//!
//! `server` calls [`applied`] for each message. A message that formats a file or edits at many
//! cursors has thousands of changes, in the order of the text or in reverse order. All of them
//! together cost about as much as reading the text.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use lsp_types::{Position, Range as Place, TextDocumentContentChangeEvent};

use super::lines::{ColumnUnit, LineIndex};
use super::project::Library;

/// The text of an open file after some changes, in order; `None` if it is not open.
pub(super) fn applied(
    library: &Library,
    path: &Path,
    changes: Vec<TextDocumentContentChangeEvent>,
) -> Option<Arc<str>> {
    let file = library.file(path).filter(|_| library.is_open(path))?;
    let columns = library.columns();
    let whole = changes.iter().rposition(|change| change.range.is_none());
    let first = whole.map_or(0, |at| at + 1);
    let text = whole.map_or(&*file.text, |at| &changes[at].text);
    let parts: Vec<(Place, &str)> = changes[first..]
        .iter()
        .filter_map(|change| Some((change.range?, change.text.as_str())))
        .collect();
    Some(match parts.as_slice() {
        [] => text.into(),
        [(place, new)] => replaced(text, columns, *place, new).into(),
        several => {
            let mut edited = EditedText::of(text, columns);
            several.iter().for_each(|(place, new)| edited.replace(*place, new));
            edited.text().into()
        }
    })
}

fn replaced(text: &str, columns: ColumnUnit, place: Place, new: &str) -> String {
    let lines = LineIndex::of(text);
    let start = lines.offset(text, columns, place.start);
    let end = lines.offset(text, columns, place.end).max(start);
    [&text[..start], new, &text[end..]].concat()
}

/// A text divided at the line of the last change, so that the next change moves only the lines
/// between the two changes.
struct EditedText<'t> {
    columns: ColumnUnit,
    /// The lines before the division, each with its line end.
    before: Vec<Cow<'t, str>>,
    /// The other lines, the last one first.
    behind: Vec<Cow<'t, str>>,
}

impl<'t> EditedText<'t> {
    fn of(text: &'t str, columns: ColumnUnit) -> EditedText<'t> {
        let behind = LineIndex::of(text).whole(text).rev().map(Cow::Borrowed).collect();
        EditedText { columns, before: Vec::new(), behind }
    }

    fn replace(&mut self, place: Place, new: &str) {
        self.go_to(place.start.line as usize);
        let first = self.before.len();
        let count = (place.end.line as usize).saturating_sub(first) + 1;
        let from = self.behind.len() - count.min(self.behind.len());
        let touched: String = self.behind.drain(from..).rev().collect();
        let within =
            |at: Position| Position::new(at.line.saturating_sub(first as u32), at.character);
        let place = Place::new(within(place.start), within(place.end.max(place.start)));
        let mut changed = replaced(&touched, self.columns, place, new);
        // A `\n` after a `\r` belongs to the same line end.
        if changed.starts_with('\n')
            && let Some(last) = self.before.pop_if(|line| line.ends_with('\r'))
        {
            changed.insert_str(0, &last);
        }
        let lines = LineIndex::of(&changed);
        self.behind.extend(lines.whole(&changed).rev().map(|line| Cow::Owned(line.to_owned())));
    }

    /// Moves the division to a line, at most to the last line: a change may still extend that line.
    fn go_to(&mut self, line: usize) {
        while self.before.len() > line {
            self.behind.extend(self.before.pop());
        }
        let is_whole = |line: &mut Cow<str>| line.ends_with(['\n', '\r']);
        while self.before.len() < line {
            let Some(next) = self.behind.pop_if(is_whole) else { return };
            self.before.push(next);
        }
    }

    fn text(mut self) -> String {
        self.go_to(0);
        self.behind.iter().rev().map(AsRef::as_ref).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_base::random::SplitMix64;

    #[test]
    fn applying_many_changes_together_equals_applying_them_in_order() {
        let mut random = SplitMix64(1);
        let pieces = ["a", "\n", "\r", "\r\n", "\u{e4}", "\u{1F600}", "b\n", ""];
        for _ in 0..2_000 {
            let mut number = |below: usize| (random.next() % below as u64) as usize;
            let mut text = |pieces_count: usize| -> String {
                (0..pieces_count).map(|_| pieces[number(pieces.len())]).collect()
            };
            let (first, news) = (text(12), [text(1), text(3), text(0), text(2)]);
            let mut one_by_one = first.clone();
            let mut edited = EditedText::of(&first, ColumnUnit::Utf16);
            for new in &news {
                let mut position = || Position::new(number(9) as u32, number(4) as u32);
                let place = Place::new(position(), position());
                one_by_one = replaced(&one_by_one, ColumnUnit::Utf16, place, new);
                edited.replace(place, new);
            }
            assert_eq!(edited.text(), one_by_one, "{first:?} {news:?}");
        }
    }
}
