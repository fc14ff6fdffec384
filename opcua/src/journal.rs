//! The lines that `rungd-opcua` prints to standard error, for the journal: their subjects.

use rungd_fleet::journal::{JournalSubject, LimitedLines, say_as};

/// The program, as its lines begin.
const PROGRAM: &str = "rungd-opcua";

/// The subject of a line that a client can cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LineSubject {
    /// A user signs in.
    SignIn,
    /// A password is wrong.
    WrongPassword,
    /// The file of users cannot be read.
    UserFile,
    /// The controller carries out a write.
    Write,
    /// A write is refused.
    RefusedWrite,
    /// An alarm is acknowledged, or is not.
    Acknowledge,
    /// The past cannot be read.
    Past,
}

impl JournalSubject for LineSubject {
    const PROGRAM: &'static str = PROGRAM;

    fn name(self) -> &'static str {
        match self {
            LineSubject::SignIn => "users who signed in",
            LineSubject::WrongPassword => "wrong passwords",
            LineSubject::UserFile => "failures to read the file of users",
            LineSubject::Write => "writes of clients",
            LineSubject::RefusedWrite => "refused writes",
            LineSubject::Acknowledge => "acknowledgements",
            LineSubject::Past => "failures to read the past",
        }
    }
}

/// The lines that clients can cause, with limits.
pub type ServerLines = LimitedLines<LineSubject>;

/// Prints a line to standard error, for the journal.
pub fn say(text: &str) {
    say_as(PROGRAM, text);
}
