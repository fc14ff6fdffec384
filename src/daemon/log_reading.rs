//! Reads lines of the log back: text, JSON, and entries of the journal as `journalctl -o json` or
//! `-o cat` prints them.
//!
//! Called by `rungd audit`. `log_form` writes what is read here. A line that is none of rungd's has
//! no event, and is skipped: a file of a service may have lines of others.

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::Value;

use super::log_chain::{ChainLink, JSON_LINK, TEXT_LINK};
use rungd_base::calendar::parse_seconds;
use rungd_runtime::events::{self, Event};

/// A line of the log.
#[derive(Debug)]
pub(crate) struct LoggedLine {
    /// When it was written, µs since 1970 (UTC), if the line says so.
    pub unix_us: Option<i64>,
    pub event: &'static Event,
    /// The sentence.
    pub message: String,
    /// The fields, in the order of the line.
    fields: Vec<(String, String)>,
    /// The link of a chained line.
    pub link: Option<ChainLink>,
    /// The part of the line for which the link stands.
    pub covered: String,
}

impl LoggedLine {
    /// Reads a line; `None` if it is no line of rungd's log.
    pub fn read(line: &str) -> Option<LoggedLine> {
        let line = line.trim_end_matches(['\n', '\r']);
        if !line.starts_with('{') {
            return of_text(line);
        }
        let JsonObject(members) = serde_json::from_str(line).ok()?;
        match text_of(&members, "RUNGD_EVENT") {
            Some(_) => of_entry(&members),
            None => of_json(line, members),
        }
    }

    /// The value of a field.
    pub fn field(&self, name: &str) -> Option<&str> {
        // A sentence may have words that look like a field: the last one is the field.
        let found = self.fields.iter().rev().find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str())
    }
}

/// A line of text: whatever its beginning, `RUNGD-0801 operator-write: ` is the head.
fn of_text(line: &str) -> Option<LoggedLine> {
    let (line, link) = split_link(line, TEXT_LINK, "");
    let at = line.match_indices("RUNGD-").find_map(|(at, _)| Some((at, head(&line[at..])?)));
    let (at, (event, rest)) = at?;
    let (message, fields) = sentence_and_fields(rest);
    let stamp = line[..at].split_whitespace().next().map(plain);
    let of_field = fields.iter().find(|(name, _)| name == "at").map(|(_, value)| value.clone());
    let unix_us = stamp.as_deref().and_then(parse_stamp).or_else(|| parse_stamp(&of_field?));
    // A journal that reads lines takes the priority away.
    let covered = if line.starts_with('<') { &line[at..] } else { line };
    Some(LoggedLine { unix_us, event, message, fields, link, covered: covered.to_owned() })
}

/// The event at the beginning of a text, and what follows.
fn head(text: &str) -> Option<(&'static Event, &str)> {
    let (code, rest) = text.split_once(' ')?;
    let (name, rest) = rest.split_once(": ")?;
    let event = events::coded(code).filter(|event| event.name == name)?;
    Some((event, rest))
}

/// A line without the link at its end, and the link.
fn split_link<'a>(line: &'a str, before: &str, behind: &str) -> (&'a str, Option<ChainLink>) {
    let parts = line.strip_suffix(behind).and_then(|line| line.rsplit_once(before));
    let found = parts.and_then(|(line, link)| Some((line, ChainLink::parse(link)?)));
    found.map_or((line, None), |(line, link)| (line, Some(link)))
}

/// An entry of the journal: its MESSAGE is the line.
fn of_entry(members: &[(String, Value)]) -> Option<LoggedLine> {
    let mut line = of_text(&text_of(members, "MESSAGE")?)?;
    if let Some(link) = text_of(members, "RUNGD_CHAIN") {
        line.link = ChainLink::parse(&link);
    }
    let of_journal = text_of(members, "__REALTIME_TIMESTAMP").and_then(|us| us.parse().ok());
    line.unix_us = line.unix_us.or(of_journal);
    Some(line)
}

/// A line of JSON.
fn of_json(line: &str, members: Vec<(String, Value)>) -> Option<LoggedLine> {
    let event = events::named(&text_of(&members, "event")?)?;
    let message = text_of(&members, "message")?;
    let unix_us = text_of(&members, "timestamp").as_deref().and_then(parse_stamp);
    let (covered, link) = split_link(line, JSON_LINK, "\"}");
    let fields = members.into_iter().map(|(name, value)| (name, shown(&value))).collect();
    Some(LoggedLine { unix_us, event, message, fields, link, covered: covered.to_owned() })
}

fn text_of(members: &[(String, Value)], name: &str) -> Option<String> {
    members.iter().find(|(known, _)| known == name).map(|(_, value)| shown(value))
}

fn shown(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// An object of JSON, with its members in their order.
struct JsonObject(Vec<(String, Value)>);

impl<'de> Deserialize<'de> for JsonObject {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<JsonObject, D::Error> {
        struct MembersVisitor;
        impl<'de> Visitor<'de> for MembersVisitor {
            type Value = JsonObject;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<JsonObject, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(JsonObject(members))
            }
        }
        deserializer.deserialize_map(MembersVisitor)
    }
}

/// The field that comes first in each line by a person.
const FIRST_FIELD: &str = "who";

/// The sentence of a line, and the fields behind it: ` name=value`, where a value that is not one
/// plain word is a text in quotes.
fn sentence_and_fields(text: &str) -> (String, Vec<(String, String)>) {
    let (mut sentence, mut fields) = (text, Vec::new());
    while let Some((before, field)) = last_field(sentence) {
        // The first field of a line by a person: what stands before it is the sentence, which may
        // end with a reason that looks like fields.
        let is_first = field.0 == FIRST_FIELD;
        fields.push(field);
        sentence = before;
        if is_first {
            break;
        }
    }
    fields.reverse();
    (sentence.to_owned(), fields)
}

/// The text before the last field, and the field.
fn last_field(text: &str) -> Option<(&str, (String, String))> {
    let (before, name, value) = match text.strip_suffix('"') {
        None => {
            let (before, field) = text.rsplit_once(' ')?;
            let (name, value) = field.split_once('=')?;
            (before, name, value.to_owned())
        }
        Some(body) => {
            // In a value, a backslash stands before each quote.
            let at = body.rfind("=\"")?;
            let (before, name) = body[..at].rsplit_once(' ')?;
            (before, name, unquoted(&body[at + 2..])?)
        }
    };
    let is_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let fits = !name.is_empty() && name.chars().all(is_name) && !value.is_empty();
    fits.then(|| (before, (name.to_owned(), value)))
}

/// The text that a quoted value means; `None` if it has a quote without an escape, or ends within
/// one.
fn unquoted(body: &str) -> Option<String> {
    let (mut text, mut rest) = (String::new(), body.chars());
    while let Some(c) = rest.next() {
        match (c, if c == '\\' { rest.next()? } else { c }) {
            ('"', _) => return None,
            ('\\', 'n') => text.push('\n'),
            ('\\', 'r') => text.push('\r'),
            ('\\', 't') => text.push('\t'),
            ('\\', '0') => text.push('\0'),
            ('\\', 'u') => {
                let digits: String = rest.by_ref().take_while(|c| *c != '}').collect();
                let code = u32::from_str_radix(digits.trim_start_matches('{'), 16).ok()?;
                text.push(char::from_u32(code)?);
            }
            (_, c) => text.push(c),
        }
    }
    Some(text)
}

/// A word without the codes that colour it.
fn plain(word: &str) -> String {
    let mut parts = word.split('\u{1b}');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| text + part.split_once('m').map_or("", |(_, rest)| rest))
}

/// µs since 1970 (UTC) of a time as `log_form::stamp` writes it.
fn parse_stamp(text: &str) -> Option<i64> {
    let seconds = parse_seconds(text.get(..19)?)?;
    let rest = text[19..].strip_prefix('.')?;
    let (micros, zone) = rest.split_at_checked(6)?;
    let micros: i64 =
        micros.bytes().all(|byte| byte.is_ascii_digit()).then(|| micros.parse())?.ok()?;
    let offset_s = if zone == "Z" { 0 } else { parse_offset(zone)? };
    (seconds.checked_sub(offset_s)?).checked_mul(1_000_000)?.checked_add(micros)
}

/// The seconds of `+01:00`, `-03:30` or `+00:19:32`.
fn parse_offset(text: &str) -> Option<i64> {
    let sign = match text.chars().next()? {
        '+' => 1,
        '-' => -1,
        _ => return None,
    };
    let parts: Vec<i64> =
        text[1..].split(':').map(|part| part.parse().ok()).collect::<Option<_>>()?;
    match parts[..] {
        [hours, minutes] => Some(sign * (hours * 3600 + minutes * 60)),
        [hours, minutes, seconds] => Some(sign * (hours * 3600 + minutes * 60 + seconds)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "2026-11-21T12:26:21.113635Z  INFO RUNGD-0801 operator-write: anna (uid \
                        1000) wrote 42 to level (D0): it was 40, and is 42 who=\"anna by web\" \
                        uid=1000 what=level before=40 after=42";

    #[test]
    fn a_line_of_text_has_its_event_its_sentence_and_its_fields() {
        let line = LoggedLine::read(TEXT).unwrap();
        assert_eq!(
            (line.event.name, line.unix_us),
            ("operator-write", Some(1_795_263_981_113_635))
        );
        assert!(line.message.ends_with("it was 40, and is 42"), "{}", line.message);
        let found = ["who", "what", "before", "after", "tag"].map(|name| line.field(name));
        assert_eq!(found, [Some("anna by web"), Some("level"), Some("40"), Some("42"), None]);
        assert_eq!((line.covered.as_str(), line.link), (TEXT, None));
        for other in ["", "rungd: hello", "RUNGD-9999 none: x", "RUNGD-0801 other: x", "{\"a\":1}"]
        {
            assert!(LoggedLine::read(other).is_none(), "{other}");
        }
    }

    #[test]
    fn quoted_values_are_read_as_they_were() {
        let line = |fields: &str| {
            LoggedLine::read(&format!("RUNGD-0816 operator-shelve: said: why=\"x\" {fields}"))
                .unwrap()
        };
        let cut = line("new sheet, setpoint=42 who=anna uid=7 reason=\"x who=eve\"");
        assert_eq!(cut.message, "said: why=\"x\" new sheet, setpoint=42");
        assert_eq!((cut.field("reason"), cut.field("who")), (Some("x who=eve"), Some("anna")));
        assert_eq!((cut.field("setpoint"), cut.field("why")), (None, None));
        let odd = r#"a="b" who=eve \ ü"#;
        let read = line(&format!("who=anna tag=jam why={odd:?}"));
        assert_eq!((read.field("why"), read.field("who")), (Some(odd), Some("anna")));
        let newline = "a\nb\u{202e}";
        assert_eq!(line(&format!("why={newline:?}")).field("why"), Some(newline));
        // What looks like a field in a sentence never hides the field.
        assert_eq!(line("who=eve who=anna").field("who"), Some("anna"));
        assert!(unquoted("a\\").is_none() && unquoted("a\\u{zz}").is_none());
    }

    #[test]
    fn json_and_entries_of_the_journal_are_read_alike() {
        let json = concat!(
            r#"{"timestamp":"2026-11-21T12:26:21.113635Z","level":"INFO","code":"RUNGD-0801","#,
            r#""event":"operator-write","message":"anna wrote","who":"anna","before":40}"#
        );
        let line = LoggedLine::read(json).unwrap();
        assert_eq!((line.message.as_str(), line.field("before")), ("anna wrote", Some("40")));
        assert_eq!(line.covered, json);
        let link = ChainLink::NONE.next(b"x");
        let message = "RUNGD-0801 operator-write: anna wrote who=anna";
        let entry = serde_json::json!({
            "MESSAGE": message,
            "RUNGD_EVENT": "operator-write",
            "RUNGD_CHAIN": link.to_string(),
            "__REALTIME_TIMESTAMP": "1795263981113635",
        });
        let entry = entry.to_string();
        let line = LoggedLine::read(&entry).unwrap();
        assert_eq!((line.unix_us, line.link), (Some(1_795_263_981_113_635), Some(link)));
        assert_eq!(line.covered, message);
        let cat = format!("<6>{} chain={link}", line.covered);
        let cat = LoggedLine::read(&cat).unwrap();
        assert_eq!((cat.covered, cat.link, cat.unix_us), (line.covered, Some(link), None));
    }

    #[test]
    fn local_times_are_read_with_their_offset() {
        let utc = Some(1_795_263_981_113_635);
        for text in [
            "2026-11-21T12:26:21.113635Z",
            "2026-11-21T13:26:21.113635+01:00",
            "2026-11-21T08:56:21.113635-03:30",
            "2026-11-21T12:45:53.113635+00:19:32",
        ] {
            assert_eq!(parse_stamp(text), utc, "{text}");
        }
        for text in ["", "2026-11-21", "2026-11-21T12:26:21", "2026-11-21T12:26:21.113635+x"] {
            assert_eq!(parse_stamp(text), None, "{text}");
        }
        assert_eq!(plain("\u{1b}[2m2026\u{1b}[0m"), "2026");
    }
}
