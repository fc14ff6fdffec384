//! Parses a file as TOML once, keeps the place of every part, and collects its findings.
//!
//! Every reader of a file (the ladder's, the controller's) hands a function to [`document`]. That
//! function gets the root [`Table`] and asks it for the keys that the reader knows.

use std::cell::RefCell;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::finding::{Code, Finding};
use super::room::Room;
use super::span::{FileId, Span};
pub use super::table::{Constant, Table};
use super::{headers, strict};
use crate::isa::duration::{self, DurationError};
use crate::progress::Progress;

/// A file being read: its text, and the list for its findings.
#[derive(Clone, Copy)]
pub struct Doc<'a> {
    file: FileId,
    source: &'a str,
    findings: &'a RefCell<Vec<Finding>>,
    progress: Option<&'a Progress>,
}

/// A string of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Text {
    /// The string's value.
    pub text: String,
    /// Its place: without the quotes if `exact`, else with them.
    pub span: Span,
    /// Whether byte n of `text` is byte `span.start + n` of the file. `false` for a string with
    /// escapes or several lines.
    pub exact: bool,
}

/// Size limit of a file: places are 32-bit.
const FILE_BYTES_MAX: usize = 256 << 20;

/// Parses a file and hands its root table to `read`. Returns the result of `read` (`None` if the
/// file is not TOML) and all findings.
pub fn document<T>(
    source: &str,
    file: FileId,
    read: impl FnOnce(Table<'_>) -> T,
) -> (Option<T>, Vec<Finding>) {
    document_within(&mut Room::default(), source, file, read)
}

/// As [`document`], for one of several files that share the `Room` of a load.
pub(super) fn document_within<T>(
    room: &mut Room,
    source: &str,
    file: FileId,
    read: impl FnOnce(Table<'_>) -> T,
) -> (Option<T>, Vec<Finding>) {
    let findings = RefCell::new(Vec::new());
    if source.len() > FILE_BYTES_MAX {
        let start = Span { file, start: 0, end: 0 };
        let message = format!("the file is larger than {} MiB", FILE_BYTES_MAX >> 20);
        return (None, vec![Finding::new(Code::TomlSyntax, start, message)]);
    }
    if let Err(finding) = room.take(source, file) {
        return (None, vec![*finding]);
    }
    if room.progress.is_over() {
        return (None, Vec::new());
    }
    let (root, errors) = DeTable::parse_recoverable(source);
    let doc = Doc { file, source, findings: &findings, progress: Some(&room.progress) };
    if !errors.is_empty() {
        strict::report_syntax(doc, &errors);
        return (None, findings.into_inner());
    }
    let table = root.get_ref();
    strict::check(doc, table);
    headers::check(doc, table);
    let value = read(Table::root(doc, table));
    (Some(value), findings.into_inner())
}

impl<'a> Doc<'a> {
    /// An empty file.
    pub(super) fn of_nothing(file: FileId, findings: &'a RefCell<Vec<Finding>>) -> Self {
        Doc { file, source: "", findings, progress: None }
    }

    /// Whether the load is to end, and the rest of the file to be left out.
    pub(super) fn is_over(&self) -> bool {
        self.progress.is_some_and(Progress::is_over)
    }

    /// Adds a finding.
    pub fn find(&self, finding: Finding) {
        self.findings.borrow_mut().push(finding);
    }

    /// Whether a finding already lies within a place.
    pub fn has_finding_in(&self, place: Span) -> bool {
        let inside = |span: Span| place.start <= span.start && span.end <= place.end;
        self.findings.borrow().iter().rev().take(16).any(|finding| inside(finding.span))
    }

    /// The place of a stretch of the file.
    pub fn span(&self, range: Range<usize>) -> Span {
        Span { file: self.file, start: range.start as u32, end: range.end as u32 }
    }

    /// Whether there is already a finding about a header without a parent.
    pub(super) fn has_headless(&self) -> bool {
        self.findings.borrow().iter().any(|finding| finding.code == Code::OutOfPlace)
    }

    /// The length of the file, in bytes.
    pub fn len(&self) -> usize {
        self.source.len()
    }

    /// Whether the file is empty.
    pub fn is_empty(&self) -> bool {
        self.source.is_empty()
    }

    /// The text of a stretch of the file.
    pub fn slice(&self, range: Range<usize>) -> &'a str {
        self.source.get(range).unwrap_or("")
    }

    pub(super) fn wrong_type(&self, value: &Spanned<DeValue<'_>>, what: &str, wanted: &str) {
        let found = describe(value.get_ref());
        let message = format!("{what} wants {wanted}, not {found}");
        self.find(
            Finding::new(Code::WrongType, self.span(value.span()), message)
                .label(format!("expected {wanted}")),
        );
    }

    pub(super) fn text(&self, text: &str, range: Range<usize>) -> Text {
        let raw = self.slice(range.clone());
        let inner = raw.get(1..raw.len().saturating_sub(1)).unwrap_or("");
        if raw.len() >= 2 && inner == text {
            let span = self.span(range.start + 1..range.end - 1);
            return Text { text: text.to_owned(), span, exact: true };
        }
        Text { text: text.to_owned(), span: self.span(range), exact: false }
    }
}

/// A value's type, in words.
pub(super) fn describe(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "an integer",
        DeValue::Float(_) => "a number with a fraction",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date or time",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}

/// The finding for a text that is not a duration.
pub fn bad_duration(text: &str, span: Span, error: DurationError) -> Finding {
    let (message, help) = match error {
        DurationError::Form if ["us", "µs", "ns"].iter().any(|unit| text.ends_with(unit)) => (
            format!("`{text}` is not a duration"),
            "the smallest unit is the millisecond: the least is `1ms`",
        ),
        DurationError::Form => (
            format!("`{text}` is not a duration"),
            "write `250ms`, `2s`, `1m30s`, `1h2m3s4ms`, or `HH:MM:SS:mmm`",
        ),
        DurationError::Order => {
            let message = format!("the units of `{text}` do not descend");
            let help = match duration::in_order(text) {
                Some(right) => format!("write `{right}`"),
                None => "units descend, each once: `1h2m3s4ms`".to_owned(),
            };
            return Finding::new(Code::BadDuration, span, message).help(help);
        }
        DurationError::TooLong => (
            format!("`{text}` is too long a duration"),
            "the longest is 2147483647 ms: `596h31m23s647ms`",
        ),
    };
    Finding::new(Code::BadDuration, span, message).help(help)
}
