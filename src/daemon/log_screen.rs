//! One log line for a terminal: a line a fact, at most 100 columns, in local time.
//!
//! `log` uses this form if standard error is a terminal and no form was asked for; files, pipes and
//! the journal get the forms of `log_form`. A line has the parts in the order in which a person
//! reads: the time of day, the level unless it is INFO, the sentence, the fields that the sentence
//! does not say, and the code at the end. Fields without room are left out, and `…` marks that. A
//! longer sentence goes on below, indented. When a day begins, a line has its date and the offset
//! of local time.

use std::fmt::Write as _;
use std::sync::Mutex;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::log_form::{FieldValue, Level, LogLine, offset};
use rungd_base::calendar::LocalTime;
use rungd_base::locked::locked;

/// The most columns of a line.
const COLUMNS_MAX: usize = 100;
/// The columns before the sentence: `12:26:21.113 ERROR `.
const INDENT: usize = 19;
/// The columns for the rest.
const ROOM: usize = COLUMNS_MAX - INDENT;
/// The most characters of a hash that are shown.
const HASH_CHARS: usize = 12;

/// The log on a terminal.
#[derive(Debug)]
pub(super) struct LogScreen {
    has_colours: bool,
    /// The day of the last line, counted from 1970, and the offset from UTC that it was shown with.
    day: Mutex<Option<(i64, Option<i64>)>>,
}

/// The part of a line that a word belongs to.
#[derive(Clone, Copy, PartialEq)]
enum LinePart {
    Sentence,
    Aside,
}

impl LogScreen {
    pub fn new(has_colours: bool) -> LogScreen {
        LogScreen { has_colours, day: Mutex::default() }
    }

    /// The line, with its end; `offset_s` is local time minus UTC, if it is known.
    pub fn line(&self, line: &LogLine, now: SystemTime, offset_s: Option<i64>) -> Vec<u8> {
        let since = now.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
        let utc_s = i64::try_from(since.as_secs()).unwrap_or(i64::MAX);
        let local_s = utc_s.saturating_add(offset_s.unwrap_or(0));
        let mut text = self.date(local_s, offset_s).unwrap_or_default();
        let LocalTime { hour, minute, second, .. } = LocalTime::of(local_s);
        let time = format!("{hour:02}:{minute:02}:{second:02}.{:03}", since.subsec_millis());
        let level = if line.level == Level::INFO { "" } else { line.level.as_str() };
        text += &self.dim(&time);
        let _ = write!(text, " {} ", self.painted(line.level, &format!("{level:5}")));
        for (at, row) in rows(line).iter().enumerate() {
            if at > 0 {
                text += &" ".repeat(INDENT);
            }
            text += &self.row(row, line.level);
            text.push('\n');
        }
        text.into_bytes()
    }

    /// The line about a date, if the day is not that of the last line.
    fn date(&self, local_s: i64, offset_s: Option<i64>) -> Option<String> {
        let today = (local_s.div_euclid(86_400), offset_s);
        if locked(&self.day).replace(today) == Some(today) {
            return None;
        }
        let LocalTime { year, month, day, .. } = LocalTime::of(local_s);
        let zone = offset_s.map_or(String::new(), offset);
        Some(self.dim(&format!("{year:04}-{month:02}-{day:02}, UTC{zone}")) + "\n")
    }

    /// The words of a row, with one space before each but the first; the aside begins after two.
    fn row(&self, words: &[(LinePart, String)], level: Level) -> String {
        let mut text = String::new();
        for part in words.chunk_by(|a, b| a.0 == b.0) {
            let said = part.iter().map(|(_, word)| word.as_str()).collect::<Vec<_>>().join(" ");
            if !text.is_empty() {
                text.push_str("  ");
            }
            text += &match part[0].0 {
                LinePart::Sentence => self.painted(level, &said),
                LinePart::Aside => self.dim(&said),
            };
        }
        text
    }

    fn dim(&self, text: &str) -> String {
        if self.has_colours { format!("\x1b[2m{text}\x1b[0m") } else { text.to_owned() }
    }

    /// The text in the colour of a level.
    fn painted(&self, level: Level, text: &str) -> String {
        match level {
            Level::ERROR if self.has_colours => format!("\x1b[31m{text}\x1b[0m"),
            Level::WARN if self.has_colours => format!("\x1b[33m{text}\x1b[0m"),
            _ => text.to_owned(),
        }
    }
}

/// A field as `name=value`; `None` if the sentence has the value.
fn field(sentence: &str, name: &str, value: &FieldValue) -> Option<String> {
    let text = match value {
        FieldValue::Text(text) => text.clone(),
        FieldValue::Whole(_) | FieldValue::Real(_) | FieldValue::Truth(_) => value.to_string(),
    };
    if name == "sha256" {
        return Some(format!("{name}={}", text.chars().take(HASH_CHARS).collect::<String>()));
    }
    (name == "scan" || !has_word(sentence, &text)).then(|| format!("{name}={value}"))
}

/// Whether a sentence has a text as a whole word or as whole words.
fn has_word(sentence: &str, text: &str) -> bool {
    let is_edge = |c: Option<char>| !c.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '.');
    let is_whole = |at: usize| {
        let behind = sentence[at + text.len()..].trim_start_matches('.');
        is_edge(sentence[..at].chars().next_back()) && is_edge(behind.chars().next())
    };
    !text.is_empty() && sentence.match_indices(text).any(|(at, _)| is_whole(at))
}

/// Words in a row, each with the part that it belongs to.
type LineWords = Vec<(LinePart, String)>;

/// The rows of a line, behind the indent: its sentence, then the fields that have room in the last
/// row, and the code.
fn rows(line: &LogLine) -> Vec<LineWords> {
    let sentence = line.on_screen.as_ref().unwrap_or(&line.message);
    let (mut rows, mut used) = sentence_rows(sentence);
    let code = line.event.map(|event| event.code());
    let fields = line.fields.iter().filter(|_| line.on_screen.is_none());
    let fields = fields.filter_map(|(name, value)| field(sentence, name, value));
    let fields: Vec<String> = fields.collect();
    // Room for the code, and for the mark of a field that is left out.
    let end_room = code.as_ref().map_or(0, |code| code.len() + 2) + 2 * fields.len().min(1);
    if used + end_room > ROOM {
        rows.push(Vec::new());
        used = 0;
    }
    let (mut aside, mut is_cut) = (Vec::new(), false);
    for field in fields {
        let length = field.chars().count() + 2;
        if used + length + end_room > ROOM {
            is_cut = true;
            continue;
        }
        used += length - usize::from(!aside.is_empty());
        aside.push(field);
    }
    aside.extend(is_cut.then(|| "…".to_owned()));
    aside.extend(code);
    if let Some(row) = rows.last_mut() {
        row.extend(aside.into_iter().map(|word| (LinePart::Aside, word)));
    }
    rows
}

/// A sentence in rows, and the columns that the last one uses. A word that is longer than a row is
/// cut.
fn sentence_rows(sentence: &str) -> (Vec<LineWords>, usize) {
    let (mut rows, mut row, mut used) = (Vec::new(), Vec::new(), 0);
    for word in sentence.split_whitespace() {
        let chars: Vec<char> = word.chars().collect();
        for piece in chars.chunks(ROOM) {
            let gap = usize::from(!row.is_empty());
            if used + gap + piece.len() > ROOM {
                rows.push(std::mem::take(&mut row));
                used = 0;
            }
            used += usize::from(!row.is_empty()) + piece.len();
            row.push((LinePart::Sentence, piece.iter().collect()));
        }
    }
    rows.push(row);
    (rows, used)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_runtime::events::{ALARM_ON, MODE_FAULT, TAG_VALUE};

    const NOON: u64 = 1_795_262_400;

    fn line(level: Level, message: &str, fields: Vec<(&'static str, FieldValue)>) -> LogLine {
        let (message, event) = (message.to_owned(), Some(&TAG_VALUE));
        LogLine { level, event, message, on_screen: None, fields }
    }

    fn at(seconds: u64) -> SystemTime {
        UNIX_EPOCH + Duration::from_millis(seconds * 1000 + 7)
    }

    fn shown(screen: &LogScreen, line: &LogLine) -> String {
        String::from_utf8(screen.line(line, at(NOON), Some(3600))).unwrap()
    }

    /// A screen that has shown its date.
    fn screen(has_colours: bool) -> LogScreen {
        let screen = LogScreen::new(has_colours);
        shown(&screen, &line(Level::INFO, "", Vec::new()));
        screen
    }

    fn text(text: &str) -> FieldValue {
        FieldValue::Text(text.to_owned())
    }

    #[test]
    fn a_line_shows_the_sentence_its_other_fields_and_the_code() {
        let parts = [("tag", text("parts")), ("from", FieldValue::Whole(0))];
        let fields =
            [parts.to_vec(), vec![("scan", FieldValue::Whole(1)), ("who", text("anna b"))]];
        let value = line(Level::INFO, "parts is 1, was 0", fields.concat());
        let told = shown(&screen(false), &value);
        let wanted = "13:00:00.007       parts is 1, was 0  scan=1 who=\"anna b\" RUNGD-0305\n";
        assert_eq!(told, wanted);
        let jam = LogLine { event: Some(&ALARM_ON), ..line(Level::WARN, "alarm ON: Jam", vec![]) };
        assert_eq!(shown(&screen(false), &jam), "13:00:00.007 WARN  alarm ON: Jam  RUNGD-0301\n");
        let hash = line(Level::INFO, "x", vec![("sha256", text(&"ab".repeat(32)))]);
        assert!(shown(&screen(false), &hash).contains(" sha256=abababababab "));
    }

    #[test]
    fn the_level_is_coloured_and_everything_but_the_sentence_is_dim() {
        let fault = LogLine { event: Some(&MODE_FAULT), ..line(Level::ERROR, "FAULT: x", vec![]) };
        let told = shown(&screen(true), &fault);
        let dim = |text: &str| format!("\x1b[2m{text}\x1b[0m");
        let red = |text: &str| format!("\x1b[31m{text}\x1b[0m");
        let (time, code) = (dim("13:00:00.007"), dim("RUNGD-0203"));
        assert_eq!(told, format!("{time} {} {}  {code}\n", red("ERROR"), red("FAULT: x")));
        assert!(!shown(&screen(false), &fault).contains('\x1b'));
    }

    #[test]
    fn lines_have_at_most_a_hundred_columns_and_lose_no_word() {
        let screen = screen(false);
        for length in 1..60 {
            let sentence = "word ".repeat(length) + &"ü".repeat(3 * length);
            let fields = vec![("path", text(&"p".repeat(length))), ("scan", FieldValue::Whole(9))];
            let told = shown(&screen, &line(Level::WARN, &sentence, fields));
            let lines: Vec<&str> = told.lines().collect();
            assert!(lines.iter().all(|line| line.chars().count() <= 100), "{told}");
            assert!(lines[1..].iter().all(|line| line.starts_with(&" ".repeat(INDENT))), "{told}");
            let letters = |text: &str| text.split_whitespace().collect::<String>();
            assert!(letters(&told[INDENT..]).starts_with(&letters(&sentence)), "{told}");
            assert!(told.ends_with(" RUNGD-0305\n"), "{told}");
        }
    }

    #[test]
    fn fields_without_room_are_omitted_and_the_others_are_kept() {
        let fields = vec![
            ("a", FieldValue::Whole(1)),
            ("long", text(&"p".repeat(60))),
            ("b", FieldValue::Whole(2)),
        ];
        let told = shown(&screen(false), &line(Level::INFO, "ladder loaded", fields));
        assert_eq!(told, "13:00:00.007       ladder loaded  a=1 b=2 … RUNGD-0305\n");
        let full = line(Level::INFO, &"s".repeat(61), vec![("scan", FieldValue::Whole(1118))]);
        let told = shown(&screen(false), &full);
        assert_eq!(told.lines().count(), 1, "{told}");
        assert!(told.ends_with("s  … RUNGD-0305\n"), "{told}");
    }

    #[test]
    fn the_first_line_of_a_day_follows_its_date() {
        let screen = LogScreen::new(false);
        let beat = line(Level::INFO, "beat", Vec::new());
        let told = |seconds: u64, offset_s: Option<i64>| {
            let told = String::from_utf8(screen.line(&beat, at(seconds), offset_s)).unwrap();
            told.split_once("\n")
                .filter(|(_, rest)| !rest.is_empty())
                .map(|parts| parts.0.to_owned())
        };
        assert_eq!(told(NOON, None).as_deref(), Some("2026-11-21, UTC"));
        assert_eq!(told(NOON, None), None);
        assert_eq!(told(NOON, Some(-3600)).as_deref(), Some("2026-11-21, UTC-01:00"));
        assert_eq!(told(NOON + 46_799, Some(-3600)), None);
        let next = told(NOON + 46_800, Some(-3600));
        assert_eq!(next.as_deref(), Some("2026-11-22, UTC-01:00"));
    }

    #[test]
    fn a_short_screen_form_replaces_the_sentence_and_the_fields() {
        let beat = LogLine {
            on_screen: Some("every 10ms: p99 98us".to_owned()),
            ..line(Level::INFO, "scan statistics", vec![("scans", FieldValue::Whole(9))])
        };
        let told = shown(&screen(false), &beat);
        assert_eq!(told, "13:00:00.007       every 10ms: p99 98us  RUNGD-0305\n");
    }
}
