//! A file while it is being read: its text, the places in it, its strings, and the list of
//! findings.
//!
//! Used by every file that reads values of TOML; [`super::reader`] makes a [`Doc`] of each file. It
//! checks nothing but the type of a value.

use std::cell::RefCell;
use std::ops::Range;

use toml::Spanned;
use toml::de::DeValue;

use super::finding::{Code, Finding};
use super::fix::possible;
use super::lost::LostText;
use super::span::{FileId, Span};
use rungd_base::progress::Progress;

/// Maximum number of bytes in the text of a contact, an instruction or a step.
const TEXT_BYTES_MAX: usize = 64 * 1024;

/// A file being read: its text, and the list for its findings.
#[derive(Clone, Copy)]
pub struct Doc<'a> {
    file: FileId,
    source: &'a str,
    findings: &'a RefCell<Vec<Finding>>,
    progress: Option<&'a Progress>,
    lost: Option<&'a LostText>,
}

/// A string of a file.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Text {
    /// The string's value.
    pub text: String,
    /// Its place: without the quotes if `exact`, else with them.
    pub span: Span,
    /// Whether byte n of `text` is byte `span.start + n` of the file. `false` for a string with
    /// escapes or several lines.
    pub exact: bool,
}

impl<'a> Doc<'a> {
    pub(super) fn new(source: &'a str, file: FileId, findings: &'a RefCell<Vec<Finding>>) -> Self {
        Doc { file, source, findings, progress: None, lost: None }
    }

    /// The same file, for a load that may be ended early.
    pub(super) fn within(self, progress: &'a Progress) -> Self {
        Doc { progress: Some(progress), ..self }
    }

    /// The same file, with missing parts.
    pub(super) fn lacking(self, lost: &'a LostText) -> Self {
        Doc { lost: Some(lost), ..self }
    }

    /// The missing parts of the file.
    pub fn lost(&self) -> Option<LostText> {
        self.lost.cloned()
    }

    /// Whether the load must end without reading the rest of the file.
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

    /// Drops the findings of the last few that something is missing in the table at a place.
    pub(super) fn drop_missing(&self, table: Span) {
        let mut findings = self.findings.borrow_mut();
        let recent = findings.len().saturating_sub(16);
        let is_missing = |finding: &Finding| {
            let codes = [Code::MissingKey, Code::MixedLegs, Code::NoInstruction];
            finding.span == table && codes.contains(&finding.code)
        };
        let kept: Vec<Finding> =
            findings.drain(recent..).filter(|finding| !is_missing(finding)).collect();
        findings.extend(kept);
    }

    /// The place of a byte range of the file.
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

    /// Whether a text can be parsed: it is short enough, and the file contains it byte by byte
    /// (without escapes), so that each part of it has a place. Otherwise adds a finding.
    pub fn is_plain(&self, text: &Text, code: Code, one: &str) -> bool {
        if text.text.len() > TEXT_BYTES_MAX {
            let message = format!("a string of more than {TEXT_BYTES_MAX} bytes");
            let finding = Finding::new(code, text.span, message);
            self.find(finding.help(format!("write several strings in the array: {one} each")));
            return false;
        }
        if !text.exact {
            let finding = Finding::new(code, text.span, "a string with `\\` or several lines");
            let finding =
                finding.help("nothing here needs an escape: write it plainly, on one line");
            let is_one_line = !text.text.contains(['"', '\\', '\n', '\r', '\t']);
            let plain = is_one_line.then(|| possible(format!("\"{}\"", text.text)));
            self.find(finding.fixes(plain));
        }
        text.exact
    }

    /// Whether the file is empty.
    pub fn is_empty(&self) -> bool {
        self.source.is_empty()
    }

    /// The text of a byte range of the file.
    pub fn slice(&self, range: Range<usize>) -> &'a str {
        self.source.get(range).unwrap_or("")
    }

    pub(super) fn wrong_type(&self, value: &Spanned<DeValue<'_>>, what: &str, wanted: &str) {
        let found = describe(value.get_ref());
        let message = format!("{what} wants {wanted}, not {found}");
        let written = self.slice(value.span());
        self.find(
            Finding::new(Code::WrongType, self.span(value.span()), message)
                .label(format!("expected {wanted}"))
                .fixes(converted(value.get_ref(), written, wanted).map(possible))
                .or_omit(),
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

/// A value of the wanted type that means the same as the written one.
fn converted(value: &DeValue<'_>, written: &str, wanted: &str) -> Option<String> {
    let plain = written.trim_matches(['"', '\'']);
    let is_number = plain.parse::<i64>().is_ok();
    let is_flag = matches!(value, DeValue::String(_) | DeValue::Integer(_));
    let is_header = written.starts_with('[') && matches!(value, DeValue::Table(_));
    Some(match wanted {
        "true or false" if is_flag => match plain.to_ascii_lowercase().as_str() {
            "true" | "yes" | "on" | "1" => "true".to_owned(),
            "false" | "no" | "off" | "0" => "false".to_owned(),
            _ => return None,
        },
        "an integer" if is_number => plain.to_owned(),
        "an array of integers" if is_number => format!("[{plain}]"),
        "a string" | "a string or a table" if !written.contains(['"', '\'', '\n', '[', '{']) => {
            format!("\"{written}\"")
        }
        _ if wanted.starts_with("a duration") && is_number => format!("\"{plain}ms\""),
        _ if wanted.starts_with("an array of tables") && is_header => format!("[{written}]"),
        _ => return None,
    })
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
