//! Divides a text into statements (headers, and keys with their values), and determines which of
//! them are TOML by themselves.
//!
//! [`super::mend`] calls it for a file that the parser refuses. A value whose bracket or quote is
//! never closed would swallow the rest of the file. So a statement that is not TOML ends before the
//! next line that begins like a statement.
// `_` matches all other tokens; the enum is the parser's.
#![allow(clippy::wildcard_enum_match_arm)]

use std::ops::Range;

use toml::de::DeTable;
use toml_parser::Source;
use toml_parser::lexer::TokenKind;

/// A header, or a key with its value; lines that are neither are statements too.
#[derive(Clone, Debug)]
pub(super) struct Statement {
    /// Its place, from the start of a line to the end of a line.
    pub range: Range<usize>,
    /// The number of parts of a header's name, even if the header is not closed.
    pub header: Option<usize>,
    /// Whether it is TOML by itself.
    pub is_toml: bool,
}

/// Maximum number of bytes that are lexed again for values that seem to continue over further
/// statements, as a multiple of the text's length.
const LEXED_AGAIN_MAX: usize = 4;

/// All statements of a text, in order. Blank lines and comments belong to none.
pub(super) fn statements(source: &str) -> Vec<Statement> {
    let mut statements = Vec::new();
    let mut division =
        Division { source, next_beginning: 0, lexable: LEXED_AGAIN_MAX * source.len() };
    let mut at = 0;
    while at < source.len() {
        let line = first_line(&source[at..]);
        if is_idle(line) {
            at += line.len();
            continue;
        }
        let mut statement = division.statement(at);
        at = statement.range.end;
        // An array on the line below its key would be taken for a header.
        let is_apart = statements.last().is_some_and(|before: &Statement| !before.is_toml);
        if is_apart && is_array_of_texts(line) {
            statement = Statement { header: None, is_toml: false, ..statement };
        }
        statements.push(statement);
    }
    statements
}

/// Whether a text is TOML by itself.
pub(super) fn is_toml(text: &str) -> bool {
    DeTable::parse_recoverable(text).1.is_empty()
}

/// The first line of a text, with its end.
pub(super) fn first_line(text: &str) -> &str {
    text.split_inclusive('\n').next().unwrap_or("")
}

/// Whether a line is blank, or a comment.
pub(super) fn is_idle(line: &str) -> bool {
    let line = line.trim_start();
    let is_obeyed = |c: char| c.is_control() && c != '\t';
    line.is_empty() || line.starts_with('#') && !line.trim_end().contains(is_obeyed)
}

fn is_array_of_texts(line: &str) -> bool {
    let items = line.trim_start().strip_prefix('[');
    items.is_some_and(|items| items.trim_start().starts_with(['"', '\'']))
}

/// The length of the first lines up to the line on which all brackets and quotes are closed; `None`
/// if the text ends before that.
pub(super) fn closed_lines(text: &str) -> Option<usize> {
    let mut depth = 0_usize;
    for token in Source::new(text).lex() {
        match token.kind() {
            TokenKind::LeftSquareBracket | TokenKind::LeftCurlyBracket => depth += 1,
            TokenKind::RightSquareBracket | TokenKind::RightCurlyBracket => {
                depth = depth.saturating_sub(1);
            }
            TokenKind::Newline if depth == 0 => return Some(token.span().end()),
            TokenKind::Eof if depth == 0 => return Some(text.len()),
            TokenKind::MlBasicString | TokenKind::MlLiteralString => {
                let string = &text[token.span().start()..token.span().end()];
                if string.len() < 6 || !string.ends_with(&string[..3]) {
                    return None;
                }
            }
            _ => {}
        }
    }
    None
}

/// A text that is being divided.
struct Division<'a> {
    source: &'a str,
    /// The start of the line that the last search of `beginning_behind` found.
    next_beginning: usize,
    /// The number of bytes that may still be lexed again.
    lexable: usize,
}

impl Division<'_> {
    /// The statement that begins at a line.
    fn statement(&mut self, start: usize) -> Statement {
        let next = self.beginning_behind(start);
        let closed = closed_lines(&self.source[start..next]).map(|length| start + length);
        let end = closed.or_else(|| self.end_beyond(start, next)).unwrap_or(next);
        let text = &self.source[start..end];
        let is_toml = is_toml(text);
        Statement { range: start..end, header: header_depth(text, is_toml), is_toml }
    }

    /// The start of the next line that looks like the start of a statement.
    fn beginning_behind(&mut self, start: usize) -> usize {
        if self.next_beginning > start {
            return self.next_beginning;
        }
        let mut at = start + first_line(&self.source[start..]).len();
        for line in self.source[at..].split_inclusive('\n') {
            if looks_begun(line) {
                break;
            }
            at += line.len();
        }
        self.next_beginning = at;
        at
    }

    /// The end of a statement in which a line looks like the start of a different statement; a
    /// string of several lines may have such a line. `None` if the whole is not TOML.
    fn end_beyond(&mut self, start: usize, next: usize) -> Option<usize> {
        let mut most = self.source.len().min(next + self.lexable);
        while !self.source.is_char_boundary(most) {
            most -= 1;
        }
        let length = closed_lines(&self.source[start..most]);
        let end = start + length.unwrap_or(most - start);
        self.lexable -= end.saturating_sub(next).min(self.lexable);
        length.filter(|length| is_toml(&self.source[start..start + length]))?;
        Some(end)
    }
}

/// Whether a line looks like a header or like a key with its value. No line within an array of TOML
/// does.
pub(super) fn looks_begun(line: &str) -> bool {
    let line = line.trim_start();
    match line.strip_prefix('[') {
        Some(name) => is_name(name.trim_start_matches([' ', '\t', '['])),
        None => plain_key(line).is_some(),
    }
}

/// Whether a text begins with a bare word other than a value.
pub(super) fn is_name(text: &str) -> bool {
    let length = text.find(|c: char| !c.is_ascii_alphanumeric() && c != '_' && c != '-');
    let word = &text[..length.unwrap_or(text.len())];
    let begins = word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    begins && !["true", "false", "inf", "nan"].contains(&word)
}

/// The first part of the key that a line begins with, if the line is a key with a value.
pub(super) fn plain_key(line: &str) -> Option<&str> {
    let mut rest = line.trim_start();
    let mut first = None;
    loop {
        let length = key_part(rest)?;
        first = first.or(Some(&rest[..length]));
        rest = rest[length..].trim_start_matches([' ', '\t']);
        if let Some(value) = rest.strip_prefix('=') {
            return first.filter(|_| !value.starts_with('='));
        }
        rest = rest.strip_prefix('.')?.trim_start_matches([' ', '\t']);
    }
}

/// The length of the part of a key at the start of a text, with its quotes.
fn key_part(text: &str) -> Option<usize> {
    let quote = text.chars().next()?;
    if matches!(quote, '"' | '\'') {
        let inner = first_line(&text[1..]);
        return Some(inner.find(quote)? + 2);
    }
    let length = text.find(|c: char| !c.is_ascii_alphanumeric() && c != '_' && c != '-');
    length.or(Some(text.len())).filter(|length| *length > 0)
}

/// The number of parts of a header's name, even of a broken header; `None` for other statements.
/// The number is never too large, so that no table below a broken header seems to be beside it.
fn header_depth(text: &str, is_toml: bool) -> Option<usize> {
    let line = first_line(text).split('#').next().unwrap_or("").trim();
    let name = line.trim_start_matches(|c: char| !c.is_ascii_alphanumeric());
    let lead = &line[..line.len() - name.len()];
    let is_value = lead.contains('=') && lead.contains(['"', '\'']);
    let is_closed = line.ends_with(']') && !name.contains('=');
    let is_header = match is_toml {
        true => line.starts_with('['),
        false if lead.contains('[') => !is_value,
        false => line == "]]" || is_closed && (lead.is_empty() || is_tail_of_header(name)),
    };
    let is_part = |part: &&str| part.contains(|c: char| c.is_ascii_alphanumeric());
    is_header.then(|| line.split('.').filter(is_part).count().max(1))
}

/// Whether a text is a name with closing brackets: not the last lines of an array.
fn is_tail_of_header(text: &str) -> bool {
    let name = text.trim_end_matches(']');
    !name.contains(',') && name.ends_with(|c: char| c.is_ascii_alphanumeric())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(source: &str, expected: &[(&str, bool)]) {
        let found = statements(source);
        let found: Vec<(&str, bool)> =
            found.iter().map(|of| (source[of.range.clone()].trim_end(), of.is_toml)).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn an_unclosed_statement_ends_before_the_next_statement() {
        check(
            "a = [1,\n 2]\nb = [\"x\n# note\nc = \"\"\"y\n\n[t]\nd = { e = [\n[[u]]\n",
            &[
                ("a = [1,\n 2]", true),
                ("b = [\"x\n# note", false),
                ("c = \"\"\"y", false),
                ("[t]", true),
                ("d = { e = [", false),
                ("[[u]]", true),
            ],
        );
    }

    #[test]
    fn a_multi_line_value_is_one_statement() {
        let (doc, array) = ("doc = '''\na = 1\n[x]\n'''", "b = [\n[1],\n{ c = 2,\nd = 3 },\n]");
        check(&format!("{doc}\n{array}\n"), &[(doc, true), (array, true)]);
    }

    #[test]
    fn a_line_that_is_no_statement_stands_alone() {
        check(
            "a = 1\n]\nfoo\nb = 2",
            &[("a = 1", true), ("]", false), ("foo", false), ("b = 2", true)],
        );
    }

    #[test]
    fn the_depth_of_a_header_is_never_too_large() {
        let depth = |text| header_depth(text, is_toml(text));
        let broken =
            ["[[a.b", "a.b]]", "[[a..b]", "[[a.]", ".[[a.b]]", "=[[a]]", "\"\"\"a.b]", "[[", "=a]"];
        assert_eq!(broken.map(depth), [2, 2, 2, 1, 2, 1, 2, 1, 1].map(Some));
        assert_eq!(["[a]", "[[a.b]]"].map(depth), [Some(1), Some(2)]);
        assert_eq!(["a = [1]", "\"[a]\" = 1", "a", "= [\"a\"]", "\"a\"]"].map(depth), [None; 5]);
    }
}
