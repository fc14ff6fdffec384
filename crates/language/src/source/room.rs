//! Limits the TOML tokens and string bytes of one load, before the files are parsed.
//!
//! A parsed file takes many times the memory of its text: without a limit, 256 MiB of `[` would be
//! refused only after minutes and gigabytes. `LoadRoom::take` counts marks, values, spaces and line
//! ends in one pass that stops at the limit, and adds up the lengths of all strings (the contacts
//! and instructions of a ladder). `reader` calls it for every file. Comments do not count. Files
//! that are together shorter than the limit are not counted.

use toml_parser::Source;
use toml_parser::lexer::TokenKind;

use super::finding::{Code, Finding};
use super::span::{FileId, Span};
use rungd_base::progress::Progress;

/// Maximum number of tokens in all files of one load: enough for 200,000 rungs with two contacts
/// and two instructions each.
pub const TOKENS_MAX: usize = 6_000_000;
/// Maximum number of string bytes in all files of one load.
pub const STRING_BYTES_MAX: usize = 32 << 20;

/// The room left for further files of one load.
#[derive(Clone, Debug)]
pub struct LoadRoom {
    tokens: usize,
    string_bytes: usize,
    /// Whether the files of the load are too short to reach a limit: then nothing is counted.
    is_ample: bool,
    /// The progress of the load.
    pub(super) progress: Progress,
}

impl Default for LoadRoom {
    fn default() -> LoadRoom {
        LoadRoom::of(Progress::default())
    }
}

impl LoadRoom {
    /// The whole room, for a load with this progress.
    pub fn of(progress: Progress) -> LoadRoom {
        LoadRoom { tokens: TOKENS_MAX, string_bytes: STRING_BYTES_MAX, is_ample: false, progress }
    }

    /// The room for files of this length together, in bytes. A token has a byte, but for the end of
    /// each file.
    pub fn for_bytes(self, bytes: usize) -> LoadRoom {
        LoadRoom { is_ample: bytes <= TOKENS_MAX / 2, ..self }
    }

    /// Subtracts the room that a file needs.
    ///
    /// # Errors
    /// A finding if too little room is left; its place is where the room ends.
    pub(super) fn take(&mut self, source: &str, file: FileId) -> Result<(), Box<Finding>> {
        if self.is_ample {
            return Ok(());
        }
        let over = self.progress.clone();
        for token in Source::new(source).lex().take_while(|_| !over.is_over()) {
            let (start, end) = (token.span().start(), token.span().end());
            let place = Span { file, start: start as u32, end: start as u32 };
            let Some(tokens) = self.tokens.checked_sub(1) else {
                let limit = format!("{TOKENS_MAX} marks, values, spaces and ends of lines");
                return Err(refusal(place, &limit));
            };
            let length = if is_string(token.kind()) { end - start } else { 0 };
            let Some(string_bytes) = self.string_bytes.checked_sub(length) else {
                let limit = format!("{} MiB of texts in quotes", STRING_BYTES_MAX >> 20);
                return Err(refusal(place, &limit));
            };
            (self.tokens, self.string_bytes) = (tokens, string_bytes);
        }
        Ok(())
    }
}

fn is_string(kind: TokenKind) -> bool {
    use TokenKind::{BasicString, LiteralString, MlBasicString, MlLiteralString};
    matches!(kind, BasicString | LiteralString | MlBasicString | MlLiteralString)
}

fn refusal(place: Span, limit: &str) -> Box<Finding> {
    let message = format!("too large: the files of a program have at most {limit} together");
    let finding = Finding::new(Code::TomlSyntax, place, message).label("the limit is reached here");
    Box::new(finding.help("a program of this size is mostly a mistake of the tool that wrote it"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(source: &str) -> LoadRoom {
        let mut room = LoadRoom::default();
        room.take(source, FileId(0)).expect("there is room");
        room
    }

    #[test]
    fn tokens_and_strings_are_counted_and_comments_are_not() {
        let empty = taken("");
        let room = taken("when = [\"X0\", 'X1'] # \"a, b, c\"\n");
        assert_eq!(empty.tokens - room.tokens, 13);
        assert_eq!(STRING_BYTES_MAX - room.string_bytes, 8);
    }

    #[test]
    fn a_text_beyond_a_limit_is_refused_with_the_limit_and_its_place() {
        let refused = |mut room: LoadRoom, text: &str| room.take(text, FileId(0)).unwrap_err();
        let few = LoadRoom { tokens: 3, ..LoadRoom::default() };
        let finding = refused(few, "a=[1,1]");
        assert_eq!(finding.span.start, 3);
        assert!(finding.message.contains("6000000 marks"), "{}", finding.message);
        let short = LoadRoom { string_bytes: 5, ..LoadRoom::default() };
        let finding = refused(short, "a='123'\nb='1'");
        assert_eq!(finding.span.start, 10);
        assert!(finding.message.contains("32 MiB of texts"), "{}", finding.message);
    }

    #[test]
    fn files_of_few_bytes_cannot_reach_a_limit_and_are_not_counted() {
        let mut room = LoadRoom::default().for_bytes(TOKENS_MAX / 2);
        assert!(room.take("a=1\n", FileId(0)).is_ok());
        assert_eq!(room.tokens, TOKENS_MAX);
        assert!(!LoadRoom::default().for_bytes(TOKENS_MAX / 2 + 1).is_ample);
    }

    #[test]
    fn the_files_of_one_load_share_the_limit() {
        let mut room = LoadRoom { tokens: 8, ..LoadRoom::default() };
        assert!(room.take("a=1\n", FileId(0)).is_ok());
        assert!(room.take("a=1\n", FileId(1)).is_err());
    }
}
