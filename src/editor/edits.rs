//! The changes that an editor makes to a text.

use std::path::Path;
use std::sync::Arc;

use lsp_types::TextDocumentContentChangeEvent;

use super::lines::Lines;
use super::project::Library;

/// The text of an open file after some changes, in order; `None` if it is not open.
pub(super) fn applied(
    library: &Library,
    path: &Path,
    changes: Vec<TextDocumentContentChangeEvent>,
) -> Option<Arc<str>> {
    let file = library.file(path).filter(|_| library.is_open(path))?;
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
    Some(text.into())
}
