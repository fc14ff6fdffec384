//! The messages of `rungd metrics` on standard error, for the journal.

/// Prints a line on standard error.
pub(super) fn say(text: &str) {
    let is_odd = |c: char| if c.is_control() { '?' } else { c };
    eprintln!("rungd metrics: {}", text.chars().map(is_odd).collect::<String>());
}
