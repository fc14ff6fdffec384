//! Common slips that make a text no TOML: a decimal comma, and a quote that is not closed.
//!
//! Called by `strict` for the parser's error on a line. The parser reports where it gave up, which
//! is often far behind the slip; the findings of this module are at the slip, and show its
//! correction. Only one line is read.

use std::ops::Range;

use super::doc::Doc;
use super::finding::{Code, Finding};
use crate::isa::decimal_comma;

/// The longest line that is searched.
const LINE_MAX: usize = 1000;

/// The finding for a slip on the line of an error; `None` if the line has none.
pub(super) fn slip(doc: Doc<'_>, error_at: usize) -> Option<Finding> {
    let line = line_of(doc, error_at)?;
    let text = doc.slice(line.clone());
    if text.contains(['\'', '\r']) || text.contains("\"\"\"") {
        return None;
    }
    let place = |part: Range<usize>| doc.span(line.start + part.start..line.start + part.end);
    if let Some(part) = open_quote(text) {
        let word = text[part.start + 1..part.end].trim_end();
        let part = part.start..part.start + 1 + word.len();
        let finding = Finding::new(Code::TomlSyntax, place(part), "a quote is not closed");
        return Some(match word.contains('\\') {
            true => finding.help("close it on the same line"),
            false => finding.help(format!("write `\"{word}\"`")),
        });
    }
    let part = number_with_comma(text)?;
    let right = decimal_comma::corrected(&text[part.clone()])?;
    let finding = Finding::new(Code::TomlSyntax, place(part), "a decimal comma in a number");
    Some(finding.help(format!("write `{right}`")))
}

/// The line of a place, without its end; `None` if it is long.
fn line_of(doc: Doc<'_>, at: usize) -> Option<Range<usize>> {
    let at = at.min(doc.len());
    let bytes = doc.slice(0..doc.len()).as_bytes();
    let back = at.saturating_sub(LINE_MAX);
    let start = bytes[back..at].iter().rposition(|byte| *byte == b'\n').map(|n| back + n + 1);
    let start = start.or((back == 0).then_some(0))?;
    let ahead = bytes.len().min(at + LINE_MAX);
    let end = bytes[at..ahead].iter().position(|byte| *byte == b'\n').map(|n| at + n);
    let end = end.or((ahead == bytes.len()).then_some(ahead))?;
    Some(start..end)
}

/// The text from a quote that is not closed to where it should be closed.
fn open_quote(line: &str) -> Option<Range<usize>> {
    let mut at = 0;
    loop {
        let start = at + next_quote(&line[at..])?;
        if line[at..start].contains('#') {
            return None;
        }
        let inner = start + 1;
        let Some(length) = closing_quote(&line[inner..]) else {
            return Some(start..inner + text_end(&line[inner..]));
        };
        let behind = line[inner + length + 1..].trim_start();
        let may_follow = |c: char| matches!(c, ',' | ']' | '}' | '#' | '=' | '.' | '"');
        if !behind.is_empty() && !behind.starts_with(may_follow) {
            return Some(start..inner + text_end(&line[inner..inner + length]));
        }
        at = inner + length + 1;
    }
}

fn next_quote(text: &str) -> Option<usize> {
    text.find('"')
}

/// The place of the quote that closes a string.
fn closing_quote(text: &str) -> Option<usize> {
    let mut escaped = false;
    text.bytes().position(|byte| {
        let closes = byte == b'"' && !escaped;
        escaped = byte == b'\\' && !escaped;
        closes
    })
}

/// Where the text of an open quote ends: before the bracket that closes the array or table around
/// it, else before the last comma or comment, else at the end.
fn text_end(text: &str) -> usize {
    let mut depth = 0_usize;
    for (at, c) in text.char_indices() {
        match c {
            '[' | '{' => depth += 1,
            ']' | '}' if depth == 0 => return at,
            ']' | '}' => depth -= 1,
            _ => {}
        }
    }
    let text = text.trim_end();
    text.strip_suffix(',').map_or(text.len(), str::len)
}

/// A number with a decimal comma as the value of a key: in TOML, no key follows it.
fn number_with_comma(line: &str) -> Option<Range<usize>> {
    let line = line.split('#').next().unwrap_or(line);
    line.match_indices('=').find_map(|(at, _)| {
        let behind = &line[at + 1..];
        let start = at + 1 + behind.len() - behind.trim_start().len();
        let is_number = |c: char| c.is_ascii_alphanumeric() || matches!(c, ',' | '-' | '+');
        let length = line[start..].find(|c| !is_number(c)).unwrap_or(line.len() - start);
        let word = line[start..start + length].trim_end_matches(',');
        let behind = line[start + word.len()..].trim_start();
        let ends = behind.is_empty() || behind.starts_with([',', '}']);
        (ends && decimal_comma::corrected(word).is_some()).then(|| start..start + word.len())
    })
}

#[cfg(test)]
mod tests {
    use super::{number_with_comma, open_quote};

    #[test]
    fn the_open_quote_is_the_one_before_the_text_that_runs_on() {
        let lines = [
            (r#"rung = [{ when = ["X0], do = ["OUT Y0"] }]"#, Some("\"X0")),
            (r#"do = ["OUT Y0]"#, Some("\"OUT Y0")),
            (r#"when = ["X0, "X1"]"#, Some("\"X0")),
            (r#"name = "Main"#, Some("\"Main")),
            (r#"when = ["recipe[3], "X1"]"#, Some("\"recipe[3]")),
            (r#"do = ["OUT Y0", "OUT Y1]"#, Some("\"OUT Y1")),
            (r#"doc = "a \"b\" c""#, None),
            (r#"when = ["X0"] # a "quote"#, None),
            (r#"when = ["X0" "X1"]"#, None),
        ];
        for (line, wanted) in lines {
            let found = open_quote(line).map(|part| line[part].trim_end());
            assert_eq!(found, wanted, "{line}");
        }
    }

    #[test]
    fn a_decimal_comma_is_the_value_of_a_key() {
        let lines = [
            ("period = 1,5", Some("1,5")),
            ("a = { at = \"R0\", max=1,5 }", Some("1,5")),
            ("a = { min = 0,5, max = 2 }", Some("0,5")),
            ("at = -1,5 # cold", Some("-1,5")),
            ("list = [1,5]", None),
            ("a = { x = 1,5 = 2 }", None),
            ("a = 1.5", None),
        ];
        for (line, wanted) in lines {
            assert_eq!(number_with_comma(line).map(|part| &line[part]), wanted, "{line}");
        }
    }
}
