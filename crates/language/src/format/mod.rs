//! One layout for ladder files, controller files and test files: spaces, blank lines, line breaks
//! in arrays, and the order of keys in the tables of a ladder. `docs/fmt.md` has the rules.
//!
//! Called by `rungd fmt`. The tree of a text goes through [`blanks`], [`order`] and `write`; then
//! [`same`] compares the contents of the two texts. Formatting changes neither a value nor a
//! comment, depends only on the names of the ladder's tables, and reads and writes no files.

mod blanks;
mod order;
mod same;
mod tails;
mod write;

#[cfg(test)]
mod tests;

use toml::de::DeTable;

use crate::source::finding::{Code, Finding};
use crate::source::reader;
use crate::source::span::FileId;
use crate::source::toml_tree::TomlTree;

/// The mark that some editors write at the beginning of a file.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// The text in the common layout. The time is linear in the length of the text.
///
/// # Errors
/// The findings of a text that is not TOML.
pub fn formatted(text: &str) -> Result<String, Vec<Finding>> {
    let (read, mut findings) = reader::document(text, FileId(0), |_| ());
    // A header above its parent may be misplaced, or may not be valid TOML.
    let is_out_of_place = findings.iter().any(|finding| finding.code == Code::OutOfPlace);
    let is_toml = !is_out_of_place || DeTable::parse_recoverable(text).1.is_empty();
    let refuses = |code| code == Code::TomlSyntax || !is_toml && code == Code::OutOfPlace;
    findings.retain(|finding| read.is_none() || refuses(finding.code));
    if !findings.is_empty() {
        return Err(findings);
    }
    let laid_out = laid_out(text);
    let is_same = laid_out == text || same::is_same(text, &laid_out);
    debug_assert!(is_same, "formatting changes what this says:\n{text}");
    Ok(if is_same { laid_out } else { text.to_owned() })
}

fn laid_out(text: &str) -> String {
    let line_end = match text.split_once('\n') {
        Some((first, _)) if first.ends_with('\r') => "\r\n",
        Some(_) | None => "\n",
    };
    // The mark is removed first, because it would count as a column for the comments.
    let unmarked = text.strip_prefix(BYTE_ORDER_MARK);
    let pieces = order::order(blanks::space(TomlTree::read(unmarked.unwrap_or(text)).pieces));
    let laid_out = write::write(&pieces, line_end);
    match unmarked {
        Some(_) => format!("{BYTE_ORDER_MARK}{laid_out}"),
        None => laid_out,
    }
}
