//! The lines that `rungd edge` prints to standard error, for the journal.
//!
//! A line that a stranger can cause has a kind, and each kind has its own limit: a flood of one
//! kind hides no other. The number of withheld lines is printed later, even if no further line of
//! that kind follows. `shell` and `log_thread` decide which lines to print.

use std::io::Write as _;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use rungd_base::locked::locked;
use rungd_language::source::wording::is_obeyed;
use rungd_runtime::events::limit::{Limiter, LineLimit, WithheldLines};

/// The maximum number of characters of a line: text from a stranger may be longer.
const LINE_CHARS_MAX: usize = 1000;

/// The limit of each kind.
const LIMIT: LineLimit = LineLimit::CLIENTS;

/// The subject of a line that a stranger can cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LineSubject {
    /// The state of a host cannot be read.
    HostState,
    /// A command cannot be read.
    UnreadCommand,
    /// A command is retained by the broker.
    RetainedCommand,
    /// A command is for a tag that is not published.
    UnknownTag,
    /// A command is for a tag that may not be written.
    UnlistedTag,
    /// A command's value does not fit.
    WrongValue,
    /// There are too many writes.
    FastCommand,
    /// The controller carries out a write.
    Write,
    /// The controller refuses a write.
    RefusedWrite,
    /// A write has waited too long for its turn.
    OldWrite,
    /// A message has a topic that was not subscribed to.
    UnaskedMessage,
    /// A message is too long.
    LongMessage,
    /// The folder of the state cannot be written.
    Unkept,
}

impl LineSubject {
    /// The subject of the lines of this kind, for people.
    fn name(self) -> &'static str {
        match self {
            LineSubject::HostState => "states of hosts that cannot be read",
            LineSubject::UnreadCommand => "commands that cannot be read",
            LineSubject::RetainedCommand => "retained commands",
            LineSubject::UnknownTag => "commands for tags that are not published",
            LineSubject::UnlistedTag => "commands for tags that `[commands] tags` does not list",
            LineSubject::WrongValue => "commands whose value does not fit",
            LineSubject::FastCommand => "too many writes in a second",
            LineSubject::Write => "writes of hosts",
            LineSubject::RefusedWrite => "writes that the controller refuses",
            LineSubject::OldWrite => "writes that are too old",
            LineSubject::UnaskedMessage => "messages of other topics",
            LineSubject::LongMessage => "messages that are too long",
            LineSubject::Unkept => "files that cannot be written",
        }
    }
}

/// Prints a line to standard error, for the journal. If nobody reads it, it is lost.
pub(super) fn say(text: &str) {
    let line = format!("rungd edge: {}\n", shown(text));
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
pub(super) struct LimitedLines {
    began: Instant,
    kinds: Arc<Mutex<SubjectLimits>>,
}

impl LimitedLines {
    /// The state before the first line.
    pub fn new() -> LimitedLines {
        LimitedLines { began: Instant::now(), kinds: Arc::default() }
    }

    /// Prints a line, or counts it as withheld.
    pub fn say(&self, kind: LineSubject, text: &str) {
        if self.with(|kinds, now_ns| kinds.take(kind, now_ns)) {
            say(text);
        }
    }

    /// Prints the numbers of withheld lines that are due; `all`: all of them, at the end.
    pub fn report_withheld(&self, all: bool) {
        self.with(|kinds, now_ns| kinds.due_reports(now_ns, all)).iter().for_each(|line| say(line));
    }

    fn with<T>(&self, act: impl FnOnce(&mut SubjectLimits, u64) -> T) -> T {
        let now_ns = u64::try_from(self.began.elapsed().as_nanos()).unwrap_or(u64::MAX);
        act(&mut locked(&self.kinds), now_ns)
    }
}

/// The limits, without a clock.
struct SubjectLimits(Limiter<LineSubject>);

impl Default for SubjectLimits {
    fn default() -> SubjectLimits {
        SubjectLimits(Limiter::new())
    }
}

impl SubjectLimits {
    fn take(&mut self, kind: LineSubject, now_ns: u64) -> bool {
        self.0.take(kind, LIMIT, now_ns)
    }

    fn due_reports(&mut self, now_ns: u64, all: bool) -> Vec<String> {
        let line = |(kind, withheld): (LineSubject, WithheldLines)| {
            let seconds = withheld.lasted_ns / 1_000_000_000;
            let (lines, name) = (withheld.lines, kind.name());
            format!("{lines} more lines were left out in the last {seconds} s: {name}")
        };
        self.0.due_reports(now_ns, all).into_iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: u64 = 1_000_000_000;

    #[test]
    fn a_flood_of_one_subject_hides_no_other_and_is_reported_by_name() {
        let mut kinds = SubjectLimits::default();
        let flood = |n: u64| SECOND_NS + n * 1_000_000;
        let said = (0..5000).filter(|n| kinds.take(LineSubject::FastCommand, flood(*n))).count();
        assert!((20..=25).contains(&said), "{said}");
        assert!(kinds.take(LineSubject::UnlistedTag, flood(5000)));
        assert_eq!(kinds.due_reports(flood(5000), false), [""; 0]);
        // The number is printed even if no further line follows.
        let told = kinds.due_reports(flood(5000) + 10 * SECOND_NS, false);
        let lines = 5000 - said as u64;
        let [told] = &told[..] else { panic!("{told:?}") };
        assert!(told.starts_with(&format!("{lines} more lines were left out")), "{told}");
        assert!(told.ends_with(": too many writes in a second"), "{told}");
    }

    #[test]
    fn withheld_log_lines_are_reported_at_the_end() {
        let mut kinds = SubjectLimits::default();
        (0..30).for_each(|_| _ = kinds.take(LineSubject::HostState, SECOND_NS));
        (0..25).for_each(|_| _ = kinds.take(LineSubject::Write, SECOND_NS));
        let told = kinds.due_reports(SECOND_NS, true);
        assert_eq!(told.len(), 2, "{told:?}");
        assert_eq!(kinds.due_reports(SECOND_NS, true), [""; 0]);
    }

    #[test]
    fn a_text_of_a_stranger_is_logged_short_and_without_control_characters() {
        assert_eq!(shown("a\nb\u{202e}c\u{1b}[2J"), "a?b?c?[2J");
        assert_eq!(shown(&"é".repeat(5000)).chars().count(), LINE_CHARS_MAX + 1);
    }
}
