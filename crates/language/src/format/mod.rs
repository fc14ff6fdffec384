//! One layout for ladder files, controller files and test files: spaces, blank lines, line breaks
//! in arrays, and the order of keys in the tables of a ladder. `docs/fmt.md` has the rules.
//!
//! Called by `rungd fmt`, and [`upgraded`] by `rungd fmt --upgrade`. The tree of a text goes
//! through [`blanks`], [`order`] and `write`; then [`same`] compares the contents of the two texts.
//! Formatting changes neither a value nor a comment, depends only on the names of the ladder's
//! tables, and reads and writes no files. An upgrade rewrites pieces ([`upgrade`]) in between.

mod blanks;
mod order;
mod record_indexes;
mod same;
mod tails;
mod upgrade;
mod write;

#[cfg(test)]
mod tests;

#[cfg(test)]
mod upgrade_tests;

use toml::de::DeTable;

use upgrade::UpgradeNames;

use crate::source::finding::{Code, Finding};
use crate::source::reader;
use crate::source::span::FileId;
use crate::source::toml_tree::{Piece, TomlTree};

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
    let moved = record_indexes::moved(text);
    let text = moved.as_deref().unwrap_or(text);
    let laid_out = laid_out(text);
    let is_same = laid_out == text || same::is_same(text, &laid_out);
    debug_assert!(is_same, "formatting changes what this says:\n{text}");
    Ok(if is_same { laid_out } else { text.to_owned() })
}

/// A file in the present form.
#[derive(Debug, PartialEq, Eq)]
pub struct Upgraded {
    /// Its text, in the common layout.
    pub text: String,
    /// The changes, and the tables that stay as they are: a sentence each.
    pub notes: Vec<String>,
}

/// The text in the present form, in the common layout. A text in the present form is not changed
/// again.
///
/// # Errors
/// The findings of a text that is not TOML.
pub fn upgraded(text: &str) -> Result<Upgraded, Vec<Finding>> {
    let before = formatted(text)?;
    let (mut names, mut notes) = (UpgradeNames::default(), Vec::new());
    laid_out_by(&before, |pieces| {
        names = UpgradeNames::of(&pieces);
        pieces
    });
    let after = laid_out_by(&before, |pieces| {
        let (pieces, said) = upgrade::rewritten(&names, pieces);
        notes = said;
        pieces
    });
    let is_sound = same::has_same_comments(&before, &after)
        && formatted(&after).is_ok_and(|again| again == after);
    match is_sound {
        true => Ok(Upgraded { text: after, notes }),
        false => {
            let note = "stays in the older form: the newer one has no place in this file";
            Ok(Upgraded { text: before, notes: vec![note.to_owned()] })
        }
    }
}

fn laid_out(text: &str) -> String {
    laid_out_by(text, |pieces| pieces)
}

/// The text in the common layout, with changed pieces.
fn laid_out_by<'a>(text: &'a str, change: impl FnOnce(Vec<Piece<'a>>) -> Vec<Piece<'a>>) -> String {
    let line_end = match text.split_once('\n') {
        Some((first, _)) if first.ends_with('\r') => "\r\n",
        Some(_) | None => "\n",
    };
    // The mark is removed first, because it would count as a column for the comments.
    let unmarked = text.strip_prefix(BYTE_ORDER_MARK);
    let pieces = change(TomlTree::read(unmarked.unwrap_or(text)).pieces);
    let laid_out = write::write(&order::order(blanks::space(pieces)), line_end);
    match unmarked {
        Some(_) => format!("{BYTE_ORDER_MARK}{laid_out}"),
        None => laid_out,
    }
}
