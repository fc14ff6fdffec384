//! The words of a step, each with its place. Called by `step_text`.

use std::num::ParseIntError;

use rungd_language::source::span::{Located, Span};

/// A word of a step.
pub(super) type StepWord = Located<String>;

/// A count: decimal, or `0x1F`.
pub(super) fn count(text: &str) -> Result<u64, ParseIntError> {
    match text.strip_prefix("0x") {
        Some(digits) if !digits.starts_with('+') => u64::from_str_radix(digits, 16),
        Some(_) | None => text.parse(),
    }
}

/// The words of a step that have not been read yet; spaces separate them.
pub(super) struct StepWords<'t> {
    text: &'t str,
    span: Span,
    at: usize,
}

impl<'t> StepWords<'t> {
    /// The words of a text at a place.
    pub fn new(text: &'t str, span: Span) -> StepWords<'t> {
        StepWords { text, span, at: 0 }
    }

    /// The place after the last byte.
    pub fn end(&self) -> Span {
        Span { start: self.span.end, ..self.span }
    }

    /// The next word.
    pub fn next(&mut self) -> Option<StepWord> {
        let rest = &self.text[self.at..];
        let begin = self.at + rest.len() - rest.trim_start().len();
        let rest = &self.text[begin..];
        let length = rest.find(char::is_whitespace).unwrap_or(rest.len());
        self.at = begin + length;
        let span = self.span.part(begin, begin + length);
        (length > 0).then(|| Located { value: rest[..length].to_owned(), span })
    }
}
