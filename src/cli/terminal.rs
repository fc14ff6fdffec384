//! Prints to a terminal, so that no text acts as a control sequence.
//!
//! Every command prints through this module. Names, texts of a ladder, paths and a file's bytes
//! come from outside. Control characters, and characters that change the direction of writing, are
//! printed as escapes (`\u{1b}`). `source::render` draws findings, and escapes them itself.

use std::borrow::Cow;
use std::env;
use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write};
use std::os::fd::AsFd;
use std::sync::OnceLock;

use super::folded::{COLUMNS_MAX, folded};
use rungd_client::operator::SOCKET_VARIABLE;
use rungd_language::source::wording::{escaped, is_obeyed};

/// A text for a terminal. Line ends are not escaped, so it is only for texts whose line ends rungd
/// itself has written.
pub(crate) fn plain(text: &str) -> Cow<'_, str> {
    if !text.contains(|c| is_obeyed(c) && c != '\n') {
        return Cow::Borrowed(text);
    }
    text.split('\n').map(escaped).collect::<Vec<_>>().join("\n").into()
}

/// A text whose line ends are all rungd's own: those in what the user has written on the command
/// line, such as a path that a message repeats, become escapes.
pub(crate) fn with_own_lines(text: &str) -> Cow<'_, str> {
    static PARTS: OnceLock<Vec<String>> = OnceLock::new();
    let parts = PARTS.get_or_init(|| {
        let given = env::args_os().skip(1).chain(env::var_os(SOCKET_VARIABLE));
        parts_of_lines(given.map(|text| text.to_string_lossy().into_owned()))
    });
    escaped_parts(text, parts)
}

/// The parts of arguments that contain line ends: each part of a path, because a message may
/// repeat only some of them.
fn parts_of_lines(arguments: impl Iterator<Item = String>) -> Vec<String> {
    let has_lines = |part: &&str| part.contains('\n') && !part.trim().is_empty();
    // The command line's library leaves out what begins with an escape character.
    let ends = |c: char| c == '/' || (is_obeyed(c) && c != '\n');
    let mut parts: Vec<String> = Vec::new();
    for argument in arguments.filter(|argument| argument.contains('\n')) {
        let values = argument.split_once('=').map(|(_, value)| value);
        let values = values.into_iter().chain([argument.as_str()]);
        parts.extend(
            values.flat_map(|value| value.split(ends)).filter(has_lines).map(str::to_owned),
        );
    }
    // The longest first: it may contain a shorter one.
    parts.sort_by_key(|part| std::cmp::Reverse(part.len()));
    parts.dedup();
    parts
}

fn escaped_parts<'a>(text: &'a str, parts: &[String]) -> Cow<'a, str> {
    let found = parts.iter().filter(|part| text.contains(part.as_str()));
    found.fold(Cow::Borrowed(text), |text, part| text.replace(part.as_str(), &escaped(part)).into())
}

/// A text for one line of a terminal. Line ends are escaped too, so that a name that contains a
/// line end cannot add a line to an answer.
pub(crate) fn one_line(text: &str) -> Cow<'_, str> {
    escaped(text)
}

/// A text as a field of CSV (RFC 4180), in one line.
pub(crate) fn csv_field(text: &str) -> String {
    format!("\"{}\"", one_line(text).replace('"', "\"\""))
}

/// A line of JSON for a terminal, with the same meaning. Control characters occur only in its
/// strings, and `serde_json` already escapes those up to U+001F.
pub(crate) fn plain_json(json: &str) -> Cow<'_, str> {
    if !json.contains(is_obeyed) {
        return Cow::Borrowed(json);
    }
    let mut plain = String::with_capacity(json.len());
    for c in json.chars() {
        match is_obeyed(c) {
            // All these characters have at most four digits.
            true => {
                let _ = write!(plain, "\\u{:04x}", u32::from(c));
            }
            false => plain.push(c),
        }
    }
    Cow::Owned(plain)
}

/// Prints a result.
///
/// # Errors
/// Standard output cannot be written.
pub(crate) fn print(text: &str) -> io::Result<()> {
    io::stdout().lock().write_all(plain(&with_own_lines(text)).as_bytes())
}

/// Prints a text on standard error. A closed standard error is not a failure.
pub(crate) fn say(text: &str) {
    say_drawn(&plain(&with_own_lines(text)));
}

/// Prints one line on standard error.
pub(crate) fn say_line(text: &str) {
    say_drawn(&format!("{}\n", one_line(text)));
}

/// Prints findings on standard error, as they were drawn and with their colours. On a terminal,
/// long lines are folded.
pub(super) fn say_findings(text: &str) {
    let wide = is_wide_as();
    say_drawn(&wide.map_or(Cow::Borrowed(text), |columns| folded(text, columns).into()));
}

/// The columns of the terminal that standard error is, if it is one.
fn is_wide_as() -> Option<usize> {
    let errors = io::stderr();
    let columns = window(&errors).map(|(columns, _)| columns);
    errors.is_terminal().then(|| columns.unwrap_or(COLUMNS_MAX))
}

/// The columns and lines of a terminal, if it reports them.
pub(super) fn window(terminal: impl AsFd) -> Option<(usize, usize)> {
    let size = rustix::termios::tcgetwinsize(terminal).ok()?;
    let is_known = size.ws_col > 0 && size.ws_row > 0;
    is_known.then(|| (size.ws_col.into(), size.ws_row.into()))
}

/// Prints a text on standard error as it is.
pub(crate) fn say_drawn(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_of_csv_is_quoted_and_has_one_line() {
        assert_eq!(csv_field("say \"no\", twice\n"), "\"say \"\"no\"\", twice\\u{a}\"");
    }

    #[test]
    fn a_line_break_in_an_argument_is_escaped_in_a_message() {
        let arguments =
            ["run", "--socket=/tmp/a\nrungd: all is well/s", "x\ny\u{1b}[2J", "\n", "/\n/"];
        let parts = parts_of_lines(arguments.map(str::to_owned).into_iter());
        let shown = |text: &str| escaped_parts(text, &parts).into_owned();
        assert_eq!(
            shown("rungd: /tmp/a\nrungd: all is well/s: no\nrungd: x\ny\n"),
            "rungd: /tmp/a\\u{a}rungd: all is well/s: no\nrungd: x\\u{a}y\n"
        );
        assert_eq!(shown("two\nlines\n"), "two\nlines\n");
    }

    #[test]
    fn control_characters_are_shown_escaped() {
        assert_eq!(plain("Füllstand: 3 mm\nok\n"), "Füllstand: 3 mm\nok\n");
        assert_eq!(plain("a\u{1b}[2Jb\rc\u{9b}d"), "a\\u{1b}[2Jb\\u{d}c\\u{9b}d");
        assert_eq!(plain("on\u{202e}ffo"), "on\\u{202e}ffo");
        assert_eq!(one_line("jam\n  mode RUN"), "jam\\u{a}  mode RUN");
        let json = serde_json::json!({ "doc": "\u{1b}\u{7f}\u{9b}\u{202e}é" });
        let shown = plain_json(&json.to_string()).into_owned();
        assert!(!shown.contains(is_obeyed), "{shown}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).ok(), Some(json));
    }
}
