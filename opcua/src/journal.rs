//! The lines that `rungd-opcua` prints to standard error, for the journal: their subjects.

use rungd_fleet::journal::{JournalSubject, LimitedLines, say_as};

/// The program, as its lines begin.
const PROGRAM: &str = "rungd-opcua";

/// The subject of a line that a client can cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ClientLine {
    /// A user signs in.
    SignIn,
    /// A password is wrong.
    WrongPassword,
    /// The file of users cannot be read.
    UserDirectory,
    /// The controller carries out a write.
    Write,
    /// A write is refused.
    RefusedWrite,
    /// An alarm is acknowledged, or is not.
    Acknowledge,
    /// An alarm is shelved or brought back, or is not.
    Shelve,
    /// The past cannot be read.
    Past,
    /// A connection is closed at the gate.
    Closed,
}

impl JournalSubject for ClientLine {
    const PROGRAM: &'static str = PROGRAM;

    fn name(self) -> &'static str {
        match self {
            ClientLine::SignIn => "users who signed in",
            ClientLine::WrongPassword => "wrong passwords",
            ClientLine::UserDirectory => "failures to read the file of users",
            ClientLine::Write => "writes of clients",
            ClientLine::RefusedWrite => "refused writes",
            ClientLine::Acknowledge => "acknowledgements",
            ClientLine::Shelve => "shelves of alarms",
            ClientLine::Past => "failures to read the past",
            ClientLine::Closed => "closed connections",
        }
    }
}

/// The lines that clients can cause, with limits.
pub type ServerLines = LimitedLines<ClientLine>;

/// Prints a line to standard error, for the journal.
pub fn say(text: &str) {
    say_as(PROGRAM, text);
}
