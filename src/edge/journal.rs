//! What `rungd edge` tells on standard error, for the journal.

use std::time::{Duration, Instant};

/// The most lines that others can cause in [`LINES_EVERY`].
const LINES_MAX: u32 = 10;

/// The time that [`LINES_MAX`] is for.
const LINES_EVERY: Duration = Duration::from_secs(10);

/// A line on standard error, for the journal.
pub(super) fn say(text: &str) {
    let is_odd = |c: char| if c.is_control() { '?' } else { c };
    eprintln!("rungd edge: {}", text.chars().map(is_odd).collect::<String>());
}

/// Lines that a stranger can cause without limit: some, then how many were left out.
#[derive(Debug, Default)]
pub(super) struct LimitedLines {
    began: Option<Instant>,
    said: u32,
    left_out: u32,
}

impl LimitedLines {
    /// Says a line, or counts it.
    pub fn say(&mut self, text: &str) {
        if self.began.is_none_or(|began| began.elapsed() > LINES_EVERY) {
            if self.left_out > 0 {
                say(&format!("{} more lines of this kind were left out", self.left_out));
            }
            *self = LimitedLines { began: Some(Instant::now()), said: 0, left_out: 0 };
        }
        if self.said < LINES_MAX {
            self.said += 1;
            say(text);
        } else {
            self.left_out += 1;
        }
    }
}
