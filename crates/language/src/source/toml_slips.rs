//! Common slips that make a text no TOML: a decimal comma, and a quote that is missing before or
//! behind a text, or on both sides, or is one of print: `“b”`.
//!
//! Called by `strict` for the parser's error on a line. The parser reports where it gave up, which
//! is often far behind the slip; the findings of this module are at the slip, and show its
//! correction. Only one line is read.

use std::ops::Range;

use super::doc::Doc;
use super::finding::{Code, Finding};
use super::fix::certain;
use rungd_engine::isa::decimal_comma;

/// The longest line that is searched.
const LINE_MAX: usize = 1000;

/// The finding for a slip on the line of an error; `None` if the line has none.
pub(super) fn slip(doc: Doc<'_>, error_at: usize) -> Option<Finding> {
    let line = line_of(doc, error_at)?;
    let text = doc.slice(line.clone());
    if text.contains('\r') || text.contains("\"\"\"") {
        return None;
    }
    let place = |part: Range<usize>| doc.span(line.start + part.start..line.start + part.end);
    if let Some((part, word)) = printed_quotes(text) {
        let finding = Finding::new(Code::TomlSyntax, place(part), "quotes of print, not of TOML");
        return Some(finding.write(format!("\"{word}\"")));
    }
    if let Some((part, quote)) = unopened(text) {
        let word = text[part.start..part.end - 1].trim_end();
        let finding = Finding::new(Code::TomlSyntax, place(part.clone()), "no quote opens this");
        return Some(finding.write(format!("{quote}{word}{quote}")));
    }
    if let Some((part, word)) = doubled_quote(text) {
        let finding = Finding::new(Code::TomlSyntax, place(part), "a quote too many");
        return Some(finding.write(format!("\"{word}\"")));
    }
    // An apostrophe within a text, or a text in apostrophes.
    let is_mixed = text.contains('\'') && text.contains('"');
    if let Some(part) = open_quote(&text.replace('\'', "\"")).filter(|_| !is_mixed) {
        let word = text[part.start + 1..part.end].trim_end();
        let part = part.start..part.start + 1 + word.len();
        let finding = Finding::new(Code::TomlSyntax, place(part), "a quote is not closed");
        return Some(match word.contains('\\') {
            true => finding.help("close it on the same line"),
            false => finding.write(format!("\"{word}\"")),
        });
    }
    let part = number_with_comma(text)?;
    let right = decimal_comma::corrected(&text[part.clone()])?;
    let finding = Finding::new(Code::TomlSyntax, place(part), "a decimal comma in a number");
    Some(finding.write(right))
}

/// The finding for a text without quotes at the place of an error: `[OUT r]`.
pub(super) fn unquoted(doc: Doc<'_>, error_at: usize) -> Option<Finding> {
    let line = line_of(doc, error_at)?;
    let text = doc.slice(line.clone());
    let start = error_at.checked_sub(line.start)?;
    let rest = text.get(start..)?;
    let word = rest[..text_end(rest.split('#').next()?)].split(',').next()?.trim_end();
    let is_plain = word.starts_with(|c: char| c.is_ascii_alphanumeric() || matches!(c, '!' | '$'));
    if !is_plain || word.contains(['"', '\'', '\\']) {
        return None;
    }
    let place = doc.span(error_at..error_at + word.len());
    let folded = word.to_ascii_lowercase();
    if ["true", "false"].contains(&folded.as_str()) {
        let finding = Finding::new(Code::TomlSyntax, place, "`true` and `false` are in lower case");
        return Some(finding.write(certain(folded)));
    }
    let finding = Finding::new(Code::TomlSyntax, place, "a text without quotes");
    Some(finding.write(format!("\"{word}\"")))
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

/// The first text in quotes of print (`“b”`, `„b“`, `«b»`), outside of a text and a comment.
fn printed_quotes(line: &str) -> Option<(Range<usize>, &str)> {
    const OPENING: [char; 6] = ['“', '”', '„', '‟', '«', '»'];
    const CLOSING: [char; 4] = ['“', '”', '«', '»'];
    let start = line.find(OPENING)?;
    if line[..start].contains(['"', '\'', '#']) || begin_of_value(&line[..start]) != start {
        return None;
    }
    let inner = start + line[start..].chars().next().map_or(0, char::len_utf8);
    let length = line[inner..].find(CLOSING)?;
    let close = line[inner + length..].chars().next().map_or(0, char::len_utf8);
    Some((start..inner + length + close, &line[inner..inner + length]))
}

/// The text before a quote that closes a string which no quote opens, with this quote: `b"` in
/// `[b"]`; and the quote.
fn unopened(line: &str) -> Option<(Range<usize>, char)> {
    let mut at = 0;
    loop {
        let quote = line[at..].find(['"', '\''])? + at;
        let sign = if line[quote..].starts_with('"') { '"' } else { '\'' };
        if line[at..quote].contains('#') {
            return None;
        }
        let start = at + begin_of_value(&line[at..quote]);
        if start < quote {
            let behind = line[quote + 1..].trim_start();
            let ends = behind.is_empty() || behind.starts_with([',', ']', '}', '#']);
            return ends.then_some((start..quote + 1, sign));
        }
        let inner = quote + 1;
        let length = match sign {
            '"' => closing_quote(&line[inner..])?,
            _ => line[inner..].find('\'')?,
        };
        let behind = line[inner + length + 1..].trim_start();
        if behind.starts_with(|c: char| c.is_alphanumeric()) {
            return None;
        }
        at = inner + length + 1;
    }
}

/// A text with two quotes in the place of one: `""b"`, `"b""`; and what stands between them.
fn doubled_quote(line: &str) -> Option<(Range<usize>, &str)> {
    let at = line.find("\"\"").filter(|_| !line.contains(['\'', '\\', '#']))?;
    let quotes: Vec<usize> = line.match_indices('"').map(|(at, _)| at).collect();
    let first = quotes.iter().position(|quote| *quote == at)?;
    let (from, to) = match first % 2 {
        0 => (at + 1, *quotes.get(first + 2)?),
        _ => (*quotes.get(first.checked_sub(1)?)?, at),
    };
    let word = &line[from + 1..to];
    let is_text = !word.trim().is_empty() && !word.contains([',', '"']) && quotes.len() % 2 == 1;
    let whole = from.min(at)..(to + 1).max(at + 2);
    is_text.then_some((whole, word))
}

/// Where a value begins behind keys, commas and opening brackets.
fn begin_of_value(text: &str) -> usize {
    let is_key = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    let mut rest = text;
    loop {
        rest = rest.trim_start_matches([' ', '\t', ',', '[', '{', ']', '}', '=']);
        let behind = rest.trim_start_matches(is_key).trim_start();
        match behind.strip_prefix('=') {
            Some(value) if behind.len() < rest.len() && !value.starts_with('=') => rest = value,
            Some(_) | None => return text.len() - rest.len(),
        }
    }
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
    use super::{doubled_quote, number_with_comma, open_quote, printed_quotes, unopened};

    #[test]
    fn a_doubled_quote_is_found() {
        let lines = [
            (r#"when = [""b"]"#, Some((r#"""b""#, "b"))),
            (r#"when = ["b""]"#, Some((r#""b"""#, "b"))),
            (r#"when = ["a", "b""]"#, Some((r#""b"""#, "b"))),
            (r#"doc = """#, None),
            (r#"doc = "", at = "X0""#, None),
        ];
        for (line, wanted) in lines {
            let found = doubled_quote(line).map(|(part, word)| (&line[part], word));
            assert_eq!(found, wanted, "{line}");
        }
    }

    #[test]
    fn a_text_without_its_opening_quote_begins_after_the_key_or_bracket() {
        let lines = [
            (r#"when = [b"]"#, Some("b\"")),
            (r#"do = [OUT r"]"#, Some("OUT r\"")),
            (r#"when = ["a", flags == 3", "c"]"#, Some("flags == 3\"")),
            (r#"rung = [{ when = [!b"], do = ["OUT Y0"] }]"#, Some("!b\"")),
            (r#"do = [OUT r", "OUT s"]"#, Some("OUT r\"")),
            (r#"do = [MATH a = 3"]"#, Some("MATH a = 3\"")),
            ("name = Main\"", Some("Main\"")),
            ("when = [b']", Some("b'")),
            (r#"when = ["X0, "X1"]"#, None),
            (r#"when = ["X0", "X1"]"#, None),
            (r#"when = ["X0" "X1"]"#, None),
            (r#"when = ["X0"] # a "quote"#, None),
            (r#"doc = "it's", at = "X0""#, None),
            (r#""a.b" = "X0""#, None),
        ];
        for (line, wanted) in lines {
            let found = unopened(line).map(|(part, _)| &line[part]);
            assert_eq!(found, wanted, "{line}");
        }
    }

    #[test]
    fn typographic_quotes_around_a_value_are_found() {
        let lines = [
            ("when = [“b”]", Some("“b”")),
            ("when = [„!b“, „c“]", Some("„!b“")),
            ("name = «Main»", Some("«Main»")),
            ("doc = \"the “b”\"", None),
            ("a = 1 # “b”", None),
        ];
        for (line, wanted) in lines {
            assert_eq!(printed_quotes(line).map(|(part, _)| &line[part]), wanted, "{line}");
        }
    }

    #[test]
    fn a_missing_closing_quote_is_found_at_its_opening_quote() {
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
    fn a_decimal_comma_is_found_only_in_the_value_of_a_key() {
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
