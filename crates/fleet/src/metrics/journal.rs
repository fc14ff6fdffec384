//! The messages of `rungd metrics` on standard error, for the journal.

use rungd_language::source::wording::is_unseen;

/// Prints a line on standard error.
pub(super) fn say(text: &str) {
    let is_odd = |c: char| if is_unseen(c) { '?' } else { c };
    eprintln!("rungd metrics: {}", text.chars().map(is_odd).collect::<String>());
}
