//! One log line in each of its forms: text, JSON, a line with a priority, an entry for the journal.
//! `log_screen` has the form for a terminal.
//!
//! For each line, the log's layer first calls [`event_of`] to get the event. If the line is to be
//! written, the layer collects its fields in a [`LogLine`]. Pure: the forms are bytes, time and
//! zone are arguments.

use std::fmt::{self, Write as _};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

pub(super) use tracing::Level;
use tracing::field::{Field, Visit};

use super::journal::JournalEntry;
use rungd_base::calendar::LocalTime;
use rungd_language::source::wording::is_obeyed;
use rungd_runtime::events::{self, Event};

/// A value of a field.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum FieldValue {
    Text(String),
    Whole(i128),
    Real(f64),
    Truth(bool),
}

/// The content of an event.
#[derive(Debug)]
pub(super) struct LogLine {
    pub level: Level,
    pub event: Option<&'static Event>,
    pub message: String,
    /// What a terminal shows instead of the message and the fields, which are too long for it.
    pub on_screen: Option<String>,
    pub fields: Vec<(&'static str, FieldValue)>,
}

/// The field that has [`LogLine::on_screen`]; no other form has it.
const ON_SCREEN: &str = "on_screen";

/// Returns the event of a line; does not form the line's other fields.
pub(super) fn event_of(line: &tracing::Event<'_>) -> Option<&'static Event> {
    let mut found = EventName(None);
    line.record(&mut found);
    found.0
}

struct EventName(Option<&'static Event>);

impl Visit for EventName {
    fn record_str(&mut self, field: &Field, value: &str) {
        if field.name() == "event" {
            self.0 = events::named(value);
        }
    }

    fn record_debug(&mut self, _: &Field, _: &dyn fmt::Debug) {}
}

impl LogLine {
    /// A line of an event, at the level that the log's rules give to it.
    pub fn of(line: &tracing::Event<'_>, event: Option<&'static Event>, level: Level) -> LogLine {
        let (message, on_screen, fields) = (String::new(), None, Vec::new());
        let mut log_line = LogLine { level, event, message, on_screen, fields };
        line.record(&mut log_line);
        log_line
    }

    /// Adds the time, in UTC, as a field: a line of the journal has none, and its link is to cover
    /// it.
    pub fn add_time(&mut self, now: SystemTime) {
        self.fields.push(("at", FieldValue::Text(stamp(now, None))));
    }

    fn add(&mut self, field: &Field, value: FieldValue) {
        match (field.name(), value) {
            ("message", FieldValue::Text(text)) => self.message = text.replace(is_obeyed, " "),
            ("event", FieldValue::Text(_)) => {}
            (ON_SCREEN, FieldValue::Text(text)) => {
                self.on_screen = Some(text.replace(is_obeyed, " "));
            }
            (name, value) => self.fields.push((name, value)),
        }
    }

    /// `RUNGD-0301 alarm-on: sentence key=value…`, without an end of line.
    fn sentence(&self) -> String {
        let mut text = String::new();
        if let Some(event) = self.event {
            let _ = write!(text, "{} {}: ", event.code(), event.name);
        }
        text.push_str(&self.message);
        for (name, value) in &self.fields {
            let _ = write!(text, " {name}={value}");
        }
        text
    }

    /// The line for people; `time` is its [`stamp`].
    pub fn text(&self, time: &str, color: bool) -> Vec<u8> {
        let (dim, paint, plain) = match (color, self.level) {
            (false, _) => ("", "", ""),
            (true, Level::ERROR) => ("\x1b[2m", "\x1b[31m", "\x1b[0m"),
            (true, Level::WARN) => ("\x1b[2m", "\x1b[33m", "\x1b[0m"),
            (true, _) => ("\x1b[2m", "\x1b[32m", "\x1b[0m"),
        };
        let (level, said) = (self.level.as_str(), self.sentence());
        format!("{dim}{time}{plain} {paint}{level:>5}{plain} {said}\n").into_bytes()
    }

    /// The line for machines, as JSON; the time is UTC.
    pub fn json(&self, now: SystemTime) -> Vec<u8> {
        let time = stamp(now, None);
        let mut text = format!("{{\"timestamp\":\"{time}\",\"level\":\"{}\"", self.level);
        if let Some(event) = self.event {
            let _ = write!(text, ",\"code\":\"{}\",\"event\":\"{}\"", event.code(), event.name);
        }
        let _ = write!(text, ",\"message\":{}", quoted(&self.message));
        for (name, value) in &self.fields {
            let _ = match value {
                FieldValue::Text(value) => write!(text, ",\"{name}\":{}", quoted(value)),
                FieldValue::Real(value) if !value.is_finite() => write!(text, ",\"{name}\":null"),
                FieldValue::Whole(_) | FieldValue::Real(_) | FieldValue::Truth(_) => {
                    write!(text, ",\"{name}\":{value}")
                }
            };
        }
        text.push_str("}\n");
        text.into_bytes()
    }

    /// The line with a priority, for a journal that reads lines.
    pub fn with_priority(&self) -> Vec<u8> {
        format!("<{}>{}\n", self.priority(), self.sentence()).into_bytes()
    }

    /// The entry for the journal's socket: the whole line as MESSAGE, and each field separately.
    pub fn entry(&self) -> Vec<u8> {
        let mut entry = JournalEntry::default();
        entry.field("MESSAGE", &self.sentence());
        entry.field("PRIORITY", &self.priority().to_string());
        entry.field("SYSLOG_IDENTIFIER", "rungd");
        if let Some(event) = self.event {
            entry.field("MESSAGE_ID", event.id);
            entry.field("RUNGD_CODE", &event.code());
            entry.field("RUNGD_EVENT", event.name);
        }
        for (name, value) in &self.fields {
            let text = match value {
                FieldValue::Text(text) => text,
                FieldValue::Whole(_) | FieldValue::Real(_) | FieldValue::Truth(_) => {
                    &value.to_string()
                }
            };
            entry.field(&format!("RUNGD_{}", name.to_ascii_uppercase()), text);
        }
        entry.bytes()
    }

    /// The line's priority in syslog.
    fn priority(&self) -> u8 {
        match self.level {
            Level::ERROR => 3,
            Level::WARN => 4,
            Level::INFO => 6,
            _ => 7,
        }
    }
}

impl Visit for LogLine {
    fn record_f64(&mut self, field: &Field, value: f64) {
        self.add(field, FieldValue::Real(value));
    }

    fn record_i64(&mut self, field: &Field, value: i64) {
        self.add(field, FieldValue::Whole(value.into()));
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        self.add(field, FieldValue::Whole(value.into()));
    }

    fn record_bool(&mut self, field: &Field, value: bool) {
        self.add(field, FieldValue::Truth(value));
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        self.add(field, FieldValue::Text(value.to_owned()));
    }

    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        self.add(field, FieldValue::Text(format!("{value:?}")));
    }
}

/// The form of the value after `key=`: in quotes unless it is a single plain word.
impl fmt::Display for FieldValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FieldValue::Whole(value) => value.fmt(f),
            FieldValue::Real(value) => write!(f, "{value:?}"),
            FieldValue::Truth(value) => value.fmt(f),
            FieldValue::Text(text) => {
                let odd = |c: char| c.is_whitespace() || is_obeyed(c) || c == '"' || c == '=';
                if text.is_empty() || text.contains(odd) {
                    write!(f, "{text:?}")
                } else {
                    f.write_str(text)
                }
            }
        }
    }
}

/// A JSON string, with escapes for all characters that control a terminal.
fn quoted(text: &str) -> String {
    let mut quoted = String::new();
    for c in serde_json::Value::from(text).to_string().chars() {
        match is_obeyed(c) {
            true => {
                let _ = write!(quoted, "\\u{:04x}", u32::from(c));
            }
            false => quoted.push(c),
        }
    }
    quoted
}

/// A time in ISO 8601: `2026-11-21T12:26:21.113635Z`, or with the offset of local time from UTC (in
/// seconds) `2026-11-21T13:26:21.113635+01:00`.
pub(super) fn stamp(time: SystemTime, offset_s: Option<i64>) -> String {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
    let utc_s = i64::try_from(since.as_secs()).unwrap_or(i64::MAX);
    let local = LocalTime::of(utc_s.saturating_add(offset_s.unwrap_or(0)));
    let LocalTime { year, month, day, hour, minute, second, .. } = local;
    let (micros, zone) = (since.subsec_micros(), offset_s.map_or("Z".to_owned(), offset));
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{micros:06}{zone}")
}

/// The offset as `+01:00` or `-03:30`; with seconds if it has any.
pub(super) fn offset(offset_s: i64) -> String {
    let (sign, size_s) = (if offset_s < 0 { '-' } else { '+' }, offset_s.unsigned_abs());
    let (hours, minutes, seconds) = (size_s / 3600, size_s / 60 % 60, size_s % 60);
    let seconds = if seconds == 0 { String::new() } else { format!(":{seconds:02}") };
    format!("{sign}{hours:02}:{minutes:02}{seconds}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_printed_in_utc_with_microseconds() {
        let utc = |time: SystemTime| stamp(time, None);
        let at = |seconds: u64| utc(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(at(0), "1970-01-01T00:00:00.000000Z");
        assert_eq!(at(951_782_400), "2000-02-29T00:00:00.000000Z");
        assert_eq!(at(1_735_689_599), "2024-12-31T23:59:59.000000Z");
        assert_eq!(at(4_107_542_400), "2100-03-01T00:00:00.000000Z");
        let micros = UNIX_EPOCH + Duration::from_micros(1_795_263_981_113_635);
        assert_eq!(utc(micros), "2026-11-21T12:26:21.113635Z");
    }

    #[test]
    fn a_local_time_is_printed_with_its_offset_from_utc() {
        let at = |offset_s: i64| {
            stamp(UNIX_EPOCH + Duration::from_micros(1_795_263_981_113_635), Some(offset_s))
        };
        assert_eq!(at(0), "2026-11-21T12:26:21.113635+00:00");
        assert_eq!(at(3600), "2026-11-21T13:26:21.113635+01:00");
        assert_eq!(at(-12_600), "2026-11-21T08:56:21.113635-03:30");
        assert_eq!(at(50_400), "2026-11-22T02:26:21.113635+14:00");
        assert_eq!(at(1_172), "2026-11-21T12:45:53.113635+00:19:32");
        assert_eq!(stamp(UNIX_EPOCH, Some(-18_000)), "1969-12-31T19:00:00.000000-05:00");
    }

    #[test]
    fn a_value_that_is_not_a_plain_word_is_quoted() {
        let shown = |text: &str| FieldValue::Text(text.to_owned()).to_string();
        assert_eq!(shown("jam"), "jam");
        assert_eq!(shown("a/b.toml"), "a/b.toml");
        assert_eq!(shown("timer slack"), "\"timer slack\"");
        assert_eq!(shown("on\u{202e}ffo"), "\"on\\u{202e}ffo\"");
        assert_eq!((shown(""), shown("a\nb=\"c\"")), ("\"\"".into(), r#""a\nb=\"c\"""#.into()));
        assert_eq!(
            (FieldValue::Real(7.0).to_string(), FieldValue::Whole(-3).to_string()),
            ("7.0".into(), "-3".into())
        );
    }

    #[test]
    fn json_strings_are_escaped() {
        let text = "a\"b\\c\nd\u{1b}ü\u{202e}";
        let back: String = serde_json::from_str(&quoted(text)).unwrap();
        assert_eq!(back, text);
        assert!(quoted(text).ends_with("ü\\u202e\""), "{}", quoted(text));
    }
}
