//! The lines that `rungd edge` prints to standard error, for the journal: their subjects.
//!
//! `shell` and `log_thread` decide which lines to print; [`crate::journal`] prints and limits them.

use crate::journal::{JournalSubject, LimitedLines, say_as};

/// The program, as its lines begin.
const PROGRAM: &str = "rungd edge";

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

impl JournalSubject for LineSubject {
    const PROGRAM: &'static str = PROGRAM;

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

/// The lines of strangers, with limits.
pub(super) type EdgeLines = LimitedLines<LineSubject>;

/// Prints a line to standard error, for the journal. If nobody reads it, it is lost.
pub(super) fn say(text: &str) {
    say_as(PROGRAM, text);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::journal::SubjectLimits;

    const SECOND_NS: u64 = 1_000_000_000;

    #[test]
    fn a_flood_of_one_subject_hides_no_other_and_is_reported_by_name() {
        let mut kinds = SubjectLimits::<LineSubject>::new();
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
        let mut kinds = SubjectLimits::<LineSubject>::new();
        (0..30).for_each(|_| _ = kinds.take(LineSubject::HostState, SECOND_NS));
        (0..25).for_each(|_| _ = kinds.take(LineSubject::Write, SECOND_NS));
        let told = kinds.due_reports(SECOND_NS, true);
        assert_eq!(told.len(), 2, "{told:?}");
        assert_eq!(kinds.due_reports(SECOND_NS, true), [""; 0]);
    }
}
