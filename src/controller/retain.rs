//! `[retain]`: its keys, and the settings that they make, but for its ranges. Whether the file can
//! be made shows at run time.

use crate::source::finding::{Code, Finding};
use crate::source::key::{LEAST_1MS, key};
use crate::source::reader::{Table, Text};
use crate::source::span::{FileId, Located, Span};

/// `[retain]`.
#[derive(Clone, Debug)]
pub struct WrittenRetain {
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

impl WrittenRetain {
    /// What holds where there is no such table.
    fn absent(file: FileId) -> WrittenRetain {
        let nowhere = Span { file, start: 0, end: 0 };
        WrittenRetain {
            ranges: Vec::new(),
            file: None,
            interval_ms: Located { value: 1000, span: nowhere },
            cold_start: None,
            budget_mb: 2000,
        }
    }
}

/// How retentive memory is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Retention {
    /// Its file, relative to the controller file; else the daemon puts it where it belongs.
    pub file: Option<String>,
    /// It is written at most so often, ms; at least 1.
    pub interval_ms: u32,
    /// Whether the controller runs where nothing was found to be restored.
    pub runs_cold: bool,
    /// More MB a day than this are worth a warning.
    pub budget_mb: u32,
}

/// Reads `[retain]` where it is.
pub(super) fn read_in(root: &mut Table<'_>, file: FileId) -> WrittenRetain {
    let table = root.table(key("retain", "What a restart keeps."), "`[retain]`");
    table.map_or_else(|| WrittenRetain::absent(file), |table| read(table, file))
}

fn read(mut table: Table<'_>, file: FileId) -> WrittenRetain {
    let absent = WrittenRetain::absent(file);
    let ranges = table.strings(key("ranges", "Data and structures: `CT8..CT15`, `D100..D199`."));
    if !table.has("ranges") {
        nothing(&table, table.span(), "without `ranges` this keeps nothing");
    }
    // A list of what is no text has findings of its own.
    if let Some(list) = ranges.as_ref().filter(|list| list.value.is_empty())
        && !table.doc().has_finding_in(list.span)
    {
        nothing(&table, list.span, "an empty list of ranges keeps nothing");
    }
    let retain = WrittenRetain {
        ranges: ranges.map_or(Vec::new(), |texts| texts.value),
        file: table.string(key(
            "file",
            "Where they are kept; else where systemd keeps state, or beside this file.",
        )),
        interval_ms: table
            .duration(
                key(
                    "interval",
                    "They are written when changed, at most so often; 1s if not given.",
                )
                .limited(LEAST_1MS),
            )
            .unwrap_or(absent.interval_ms),
        cold_start: table.string(
            key("cold-start", "Whether to run where nothing was found; `stop` if not given.")
                .limited(r#"{"enum":["run","stop"]}"#),
        ),
        budget_mb: table
            .integer(
                key("budget-mb-per-day", "More written than this is a warning; 2000 if not given."),
                (1, 10_000_000),
            )
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

pub(super) fn resolve(written: &WrittenRetain, findings: &mut Vec<Finding>) -> Retention {
    if let Some(file) = &written.file
        && (file.text.is_empty() || file.text.ends_with('/') || file.text.contains('\0'))
    {
        let finding = Finding::new(Code::Controller, file.span, "memory is kept in a file");
        findings.push(finding.help("write `file = \"/var/lib/rungd/memory\"`"));
    }
    let runs_cold = match written.cold_start.as_ref().map(|text| (text.text.as_str(), text.span)) {
        None | Some(("stop", _)) => false,
        Some(("run", _)) => true,
        Some((other, span)) => {
            let message = format!("`{other}` is not what a cold start can be");
            let finding = Finding::new(Code::Controller, span, message);
            findings.push(finding.help("write `cold-start = \"stop\"` or `\"run\"`"));
            false
        }
    };
    Retention {
        file: written.file.as_ref().map(|file| file.text.clone()),
        interval_ms: written.interval_ms.value.max(1).unsigned_abs(),
        runs_cold,
        budget_mb: written.budget_mb,
    }
}
