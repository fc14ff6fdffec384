//! The lines that a program beside the controller prints to standard error, for the journal.
//!
//! A line that a stranger can cause has a subject, and each subject has its own limit: a flood of
//! one subject hides no other. The number of withheld lines is printed later, even if no further
//! line of that subject follows. Used by `edge` and by the OPC UA server, which have the subjects.

use std::io::Write as _;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use rungd_base::locked::locked;
use rungd_language::source::wording::is_obeyed;
use rungd_runtime::events::limit::{Limiter, LineLimit, WithheldLines};

/// The maximum number of characters of a line: text from a stranger may be longer.
const LINE_CHARS_MAX: usize = 1000;

/// The limit of each subject.
const LIMIT: LineLimit = LineLimit::CLIENTS;

/// The subjects of the lines of a program.
pub trait JournalSubject: Copy + Ord {
    /// The program, as its lines begin: `rungd edge`.
    const PROGRAM: &'static str;

    /// The subject of the lines of this kind, for people.
    fn name(self) -> &'static str;
}

/// Prints a line of a program to standard error. If nobody reads it, it is lost.
pub fn say_as(program: &str, text: &str) {
    let line = format!("{program}: {}\n", shown(text));
    let _ = std::io::stderr().lock().write_all(line.as_bytes());
}

/// The text as one short line, without characters that a terminal would obey.
fn shown(text: &str) -> String {
    let plain = |c: char| if is_obeyed(c) { '?' } else { c };
    let mut line: String = text.chars().take(LINE_CHARS_MAX).map(plain).collect();
    if text.chars().nth(LINE_CHARS_MAX).is_some() {
        line.push('…');
    }
    line
}

/// Lines with limits, for all threads of the process.
#[derive(Clone)]
pub struct LimitedLines<S> {
    began: Instant,
    limits: Arc<Mutex<SubjectLimits<S>>>,
}

impl<S: JournalSubject> LimitedLines<S> {
    /// The state before the first line.
    #[allow(clippy::new_without_default)]
    pub fn new() -> LimitedLines<S> {
        LimitedLines { began: Instant::now(), limits: Arc::new(Mutex::new(SubjectLimits::new())) }
    }

    /// Prints a line, or counts it as withheld.
    pub fn say(&self, subject: S, text: &str) {
        if self.with(|limits, now_ns| limits.take(subject, now_ns)) {
            say_as(S::PROGRAM, text);
        }
    }

    /// Prints the numbers of withheld lines that are due; `all`: all of them, at the end.
    pub fn report_withheld(&self, all: bool) {
        let lines = self.with(|limits, now_ns| limits.due_reports(now_ns, all));
        lines.iter().for_each(|line| say_as(S::PROGRAM, line));
    }

    fn with<T>(&self, act: impl FnOnce(&mut SubjectLimits<S>, u64) -> T) -> T {
        let now_ns = u64::try_from(self.began.elapsed().as_nanos()).unwrap_or(u64::MAX);
        act(&mut locked(&self.limits), now_ns)
    }
}

/// The limits, without a clock.
pub(crate) struct SubjectLimits<S>(Limiter<S>);

impl<S: JournalSubject> SubjectLimits<S> {
    pub(crate) fn new() -> SubjectLimits<S> {
        SubjectLimits(Limiter::new())
    }

    pub(crate) fn take(&mut self, subject: S, now_ns: u64) -> bool {
        self.0.take(subject, LIMIT, now_ns)
    }

    pub(crate) fn due_reports(&mut self, now_ns: u64, all: bool) -> Vec<String> {
        let line = |(subject, withheld): (S, WithheldLines)| {
            let seconds = withheld.lasted_ns / 1_000_000_000;
            let (lines, name) = (withheld.lines, subject.name());
            format!("{lines} more lines were left out in the last {seconds} s: {name}")
        };
        self.0.due_reports(now_ns, all).into_iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_of_a_stranger_is_logged_short_and_without_control_characters() {
        assert_eq!(shown("a\nb\u{202e}c\u{1b}[2J"), "a?b?c?[2J");
        assert_eq!(shown(&"é".repeat(5000)).chars().count(), LINE_CHARS_MAX + 1);
    }
}
