//! Exit codes, for scripts and systemd. `docs/exit-codes.md` describes them for people; a test
//! compares that page with this file.

use std::{fmt, io};

use rungd_base::variants::all_variants;

/// The exit code of the process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// The request is done.
    Ok = 0,
    /// A running controller refuses the request in its present state; or its mode is not the
    /// required one.
    Refused = 1,
    /// The command line is wrong.
    Usage = 2,
    /// No running controller answers.
    Unavailable = 69,
    /// A bug in rungd.
    Software = 70,
    /// A file, port or device could not be read, written or opened.
    Io = 74,
    /// A controller did not end in an orderly way: there was a fault before the last of `--scans`,
    /// or a second signal before the termination passes.
    Fault = 75,
    /// The user has no permission for this request to a running controller.
    NoPerm = 77,
    /// A file of rungd is wrong, or any other failure without a code of its own. A restart does
    /// not help.
    Config = 78,
}

/// A mistake in the command line that is detected only after the files are read.
#[derive(Debug)]
pub struct CommandLine(pub String);

impl fmt::Display for CommandLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for CommandLine {}

impl Exit {
    /// `rungd prove` has decided nothing against a line, but not every line.
    pub const UNDECIDED: Exit = Exit::Usage;

    /// All codes with their names.
    pub const ALL: [(Exit, &'static str); 9] = all_variants![
        (Exit::Ok, "OK"),
        (Exit::Refused, "REFUSED"),
        (Exit::Usage, "USAGE"),
        (Exit::Unavailable, "UNAVAILABLE"),
        (Exit::Software, "SOFTWARE"),
        (Exit::Io, "IO"),
        (Exit::Fault, "FAULT"),
        (Exit::NoPerm, "NOPERM"),
        (Exit::Config, "CONFIG"),
    ];

    /// The code of a failure: `Usage` for a [`CommandLine`], `Io` if an I/O error is among the
    /// causes, else `Config`.
    pub fn of(error: &anyhow::Error) -> Exit {
        if error.is::<CommandLine>() {
            return Exit::Usage;
        }
        match error.chain().find_map(|cause| cause.downcast_ref::<io::Error>()) {
            Some(_) => Exit::Io,
            None => Exit::Config,
        }
    }
}

/// Whether a failure only means that the reader of the output has ended (`… | head`).
pub fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let io = error.chain().find_map(|cause| cause.downcast_ref::<io::Error>());
    io.is_some_and(|io| io.kind() == io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_lists_every_exit_code() {
        let page = include_str!("../../docs/exit-codes.md");
        for (exit, name) in Exit::ALL {
            let row = format!("| {} | `{name}` |", exit as i32);
            assert!(page.contains(&row), "{row}");
        }
    }
}
