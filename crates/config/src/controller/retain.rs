//! `[retain]`: its keys, and the settings made from them; [`super`] resolves the ranges. Only run
//! time shows whether the file can be made.

use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::{Key, LEAST_1MS, key};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::span::{FileId, Located, Span};

/// `[retain]`.
#[derive(Clone, Debug)]
pub(crate) struct WrittenRetain {
    /// `ranges`.
    pub ranges: Vec<Text>,
    /// `tags`: names, with `*` for any part of a name.
    pub tags: Vec<Text>,
    /// `file`: its path, relative to the controller file.
    pub file: Option<Text>,
    /// `interval`, ms: the shortest time between two writes.
    pub interval_ms: Located<i32>,
    /// `cold-start`: the mode after a start that finds no saved memory.
    pub cold_start: Option<Text>,
    /// `budget-mb-per-day`: the MB per day above which the log warns.
    pub budget_mb: u32,
}

impl WrittenRetain {
    /// The values without a `[retain]` table.
    fn absent(file: FileId) -> WrittenRetain {
        let nowhere = Span { file, start: 0, end: 0 };
        WrittenRetain {
            ranges: Vec::new(),
            tags: Vec::new(),
            file: None,
            interval_ms: Located { value: 1000, span: nowhere },
            cold_start: None,
            budget_mb: 2000,
        }
    }
}

/// The settings of the file of retentive memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Retention {
    /// Its path, relative to the controller file; if not given, the daemon's default path.
    pub file: Option<String>,
    /// The shortest time between two writes, ms; at least 1.
    pub interval_ms: u32,
    /// Whether a start that finds no saved memory goes to RUN.
    pub runs_cold: bool,
    /// The MB per day above which the log warns.
    pub budget_mb: u32,
}

/// Reads `[retain]`, if there is one.
pub(super) fn read_in(root: &mut Table<'_>, file: FileId) -> WrittenRetain {
    let table = root.table(key("retain", "Memory that a restart keeps."), "`[retain]`");
    table.map_or_else(|| WrittenRetain::absent(file), |table| read(table, file, FILE))
}

/// Reads `[retain]` of a test, whose memory has no file.
pub(super) fn read_in_test(root: &mut Table<'_>, file: FileId) -> WrittenRetain {
    let table = root.table(key("retain", "Memory that a restart keeps."), "`[retain]`");
    let Some(table) = table else { return WrittenRetain::absent(file) };
    let doc = table.doc();
    let mut retain = read(table, file, FILE.refused());
    if let Some(name) = retain.file.take() {
        let message = "the retentive memory of a test has no file";
        let finding = Finding::new(Code::TestFile, name.span, message);
        doc.find(finding.help("take `file` away: a test keeps its memory to itself"));
    }
    retain
}

const FILE: Key =
    key("file", "The file; if not given, in systemd's state folder, or beside this file.");

fn read(mut table: Table<'_>, file: FileId, memory: Key) -> WrittenRetain {
    let absent = WrittenRetain::absent(file);
    let ranges = table.strings(key("ranges", "Data and structures: `CT8..CT15`, `D100..D199`."));
    let tags = table.strings(key("tags", "Tags: `shift`, `total_*`; `*` is any part of a name."));
    keeps_nothing(&table, [ranges.as_ref(), tags.as_ref()]);
    let retain = WrittenRetain {
        ranges: ranges.map_or(Vec::new(), |texts| texts.value),
        tags: tags.map_or(Vec::new(), |texts| texts.value),
        file: table.string(memory),
        interval_ms: table
            .duration(
                key(
                    "interval",
                    "The shortest time between two writes of changes; 1s if not given.",
                )
                .limited(LEAST_1MS),
            )
            .unwrap_or(absent.interval_ms),
        cold_start: table.string(
            key("cold-start", "The mode after a start that finds no memory; `stop` if not given.")
                .limited(r#"{"enum":["run","stop"]}"#),
        ),
        budget_mb: table
            .integer(
                key(
                    "budget-mb-per-day",
                    "The log warns when more MB are written in a day; 2000 if not given.",
                ),
                (1, 10_000_000),
            )
            .and_then(|budget| u32::try_from(budget.value).ok())
            .unwrap_or(absent.budget_mb),
    };
    table.finish();
    retain
}

/// Warns about a table that names nothing to keep. A list with items that are not texts already has
/// findings.
fn keeps_nothing(table: &Table<'_>, lists: [Option<&Located<Vec<Text>>>; 2]) {
    let mut given = lists.into_iter().flatten();
    let Some(list) = given.next() else {
        if !table.has("ranges") && !table.has("tags") {
            nothing(table, table.span(), "without `ranges` and `tags` this keeps nothing");
        }
        return;
    };
    let is_empty = list.value.is_empty() && given.all(|other| other.value.is_empty());
    if is_empty && !table.doc().has_finding_in(list.span) {
        nothing(table, list.span, "an empty list keeps nothing");
    }
}

fn nothing(table: &Table<'_>, place: Span, message: &str) {
    let finding = Finding::new(Code::RetainsNothing, place, message);
    table.find(finding.label("every start is a cold start").help(
        "say what a restart keeps, `ranges = [\"D0..D99\", \"CT0..CT7\"]`, `tags = [\"total_*\"]`; \
         or take `[retain]` away",
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
            let message = format!("`{other}` is no mode of a cold start");
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
