//! Parses a file as TOML once, keeps the place of every part, and collects its findings.
//!
//! Every reader of a file (the ladder's, the controller's) hands a function to [`document`]. That
//! function receives the root [`Table`] and requests from it the keys of such a file. If the file
//! is not TOML, the function receives the file without its broken parts.

use std::cell::RefCell;

use toml::de::DeTable;

pub use super::doc::{Doc, Text};
use super::finding::{Code, Finding};
use super::lost::LostTexts;
use super::mend::{MendedText, mend};
use super::room::LoadRoom;
use super::shape::TableShape;
use super::span::{FileId, Span};
pub use super::table::{
    Constant, InitialRecords, NamedTable, PlacedValue, Table, TextOrTable, WrittenInitial,
};
use super::{headers, strict};
use rungd_base::progress::Progress;

/// Size limit of a file: places are 32-bit.
const FILE_BYTES_MAX: usize = 256 << 20;

/// Parses a file and hands its root table to `read`. Returns the result of `read` and all findings.
/// If the file is not TOML, `read` receives the file without its broken parts, which [`Doc::lost`]
/// lists. The result is `None` if nothing can be read.
pub fn document<T>(
    source: &str,
    file: FileId,
    read: impl FnOnce(Table<'_>) -> T,
) -> (Option<T>, Vec<Finding>) {
    document_within(&mut LoadRoom::default().for_bytes(source.len()), source, file, read)
}

/// As [`document`], with the `LoadRoom` and the progress of a load, which several files may share.
pub fn document_within<T>(
    room: &mut LoadRoom,
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
    let doc = Doc::new(source, file, &findings).within(&room.progress);
    if errors.is_empty() {
        let value = read_checked(doc, root.get_ref(), read);
        return (Some(value), findings.into_inner());
    }
    let Some(mended) = mend(source, &errors, &room.progress) else {
        strict::report_syntax(doc, &errors);
        return (None, findings.into_inner());
    };
    strict::report_syntax(doc, &mended.errors);
    let (value, found) = read_mended(&mended, file, &room.progress, read);
    findings.borrow_mut().extend(found);
    (Some(value), findings.into_inner())
}

fn read_checked<T>(doc: Doc<'_>, table: &DeTable<'_>, read: impl FnOnce(Table<'_>) -> T) -> T {
    strict::check(doc, table);
    headers::check(doc, table);
    read(Table::root(doc, table))
}

/// Reads a file without its broken parts, and drops the findings that the missing parts may cause.
fn read_mended<T>(
    mended: &MendedText,
    file: FileId,
    progress: &Progress,
    read: impl FnOnce(Table<'_>) -> T,
) -> (T, Vec<Finding>) {
    let findings = RefCell::new(Vec::new());
    let doc = Doc::new(&mended.text, file, &findings).within(progress).lacking(&mended.lost);
    let root = DeTable::parse_recoverable(&mended.text).0;
    let value = read_checked(doc, root.get_ref(), read);
    let mut findings = findings.into_inner();
    let mut texts = LostTexts::default();
    texts.add(file, Some(mended.lost.clone()));
    texts.keep_sure(&mut findings);
    // The parent of a header may be lost. The parser's errors already report that.
    findings.retain(|finding| finding.code != Code::OutOfPlace || !mended.lost.hides_names());
    (value, findings)
}

/// The shape of the files that a reader reads.
pub fn shape(read: impl FnOnce(Table<'_>)) -> TableShape {
    let shape = TableShape::of_place("the file");
    let (findings, empty) = (RefCell::default(), DeTable::parse_recoverable("").0);
    let doc = Doc::new("", FileId(0), &findings);
    read(Table::root(doc, empty.get_ref()).noting(&shape));
    shape
}
