//! `[retain]` of a controller file as its author wrote it: what a restart keeps, and where.
//!
//! Read by `controller`. What the texts mean is the resolver's business.

use super::finding::{Code, Finding};
use super::reader::{Table, Text};
use super::span::{FileId, Located, Span};

/// `[retain]`.
#[derive(Clone, Debug)]
pub struct Retain {
    /// `ranges`.
    pub ranges: Vec<Text>,
    /// `file`: its path, relative to the controller file.
    pub file: Option<Text>,
    /// `interval`, ms: at most so often it is written.
    pub interval_ms: Located<i32>,
    /// `cold-start`: what happens where nothing is found.
    pub cold_start: Option<Text>,
    /// `budget-mb-per-day`: more is worth a warning.
    pub budget_mb: u32,
}

impl Retain {
    /// What holds where there is no such table.
    pub(super) fn absent(file: FileId) -> Retain {
        let nowhere = Span { file, start: 0, end: 0 };
        Retain {
            ranges: Vec::new(),
            file: None,
            interval_ms: Located { value: 1000, span: nowhere },
            cold_start: None,
            budget_mb: 2000,
        }
    }
}

pub(super) fn read(mut table: Table<'_>, file: FileId) -> Retain {
    let absent = Retain::absent(file);
    let ranges = table.strings("ranges");
    if !table.has("ranges") {
        nothing(&table, table.span(), "without `ranges` this keeps nothing");
    }
    // A list of what is no text has findings of its own.
    if let Some(list) = ranges.as_ref().filter(|list| list.value.is_empty())
        && !table.doc().has_finding_in(list.span)
    {
        nothing(&table, list.span, "an empty list of ranges keeps nothing");
    }
    let retain = Retain {
        ranges: ranges.map_or(Vec::new(), |texts| texts.value),
        file: table.string("file"),
        interval_ms: table.duration("interval").unwrap_or(absent.interval_ms),
        cold_start: table.string("cold-start"),
        budget_mb: table
            .integer("budget-mb-per-day", (1, 10_000_000))
            .and_then(|budget| u32::try_from(budget.value).ok())
            .unwrap_or(absent.budget_mb),
    };
    table.finish();
    retain
}

fn nothing(table: &Table<'_>, place: Span, message: &str) {
    let finding = Finding::new(Code::RetainsNothing, place, message);
    table.find(finding.label("every start is a cold start").help(
        "say what a restart keeps, `ranges = [\"D0..D99\", \"CT0..CT7\"]`; or take `[retain]` away",
    ));
}
