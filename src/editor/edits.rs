//! The changes that an editor makes to a text.

use std::path::Path;

use lsp_types::TextDocumentContentChangeEvent;

use super::lines::Lines;
use super::project::Library;

/// Applies the changes to the text of an open file, in order.
pub(super) fn apply(
    library: &mut Library,
    path: &Path,
    changes: Vec<TextDocumentContentChangeEvent>,
) {
    let Some(file) = library.file(path) else { return };
    let mut text = file.text.to_string();
    for change in changes {
        match change.range {
            None => text = change.text,
            Some(place) => {
                let (lines, columns) = (Lines::of(&text), library.columns());
                let start = lines.offset(&text, columns, place.start);
                let end = lines.offset(&text, columns, place.end).max(start);
                text.replace_range(start..end, &change.text);
            }
        }
    }
    library.open(path, text.into());
}
