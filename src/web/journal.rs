//! The messages of `rungd web` on standard error, for the journal.

/// Prints a line on standard error, for the journal.
pub(super) fn say(text: &str) {
    let is_odd = |c: char| if c.is_control() { '?' } else { c };
    eprintln!("rungd web: {}", text.chars().map(is_odd).collect::<String>());
}
