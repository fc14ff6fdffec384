//! `[retain]`: its keys, read into settings; [`super`] resolves the ranges. Only run time shows
//! whether the file can be made.

use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, pair};
use rungd_language::source::key::{Key, key};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::slot::Slot;
use rungd_language::source::span::{Located, Span};
use rungd_language::source::value_kind::{KeyWords, Millis, ParsedText, WrongWord};

/// `[retain]`.
#[derive(Clone, Debug, Default)]
pub(crate) struct WrittenRetain {
    /// `ranges`.
    pub ranges: Vec<Text>,
    /// `tags`: names, with `*` for any part of a name.
    pub tags: Vec<Text>,
    /// `stages`: names of Programs, with `*` for any part of a name.
    pub stages: Vec<Text>,
    /// `file`, with its place.
    pub file: Option<Located<String>>,
    /// Everything but the memory itself.
    pub retention: Retention,
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

impl Default for Retention {
    fn default() -> Retention {
        Retention { file: None, interval_ms: 1000, runs_cold: false, budget_mb: 2000 }
    }
}

/// Reads `[retain]`, if there is one.
pub(super) fn read_in(root: &mut Table<'_>) -> WrittenRetain {
    let table = root.table(key("retain", "Memory that a restart keeps."), "`[retain]`");
    table.map_or_else(WrittenRetain::default, |table| read(table, FILE))
}

/// Reads `[retain]` of a test, whose memory has no file.
pub(super) fn read_in_test(root: &mut Table<'_>) -> WrittenRetain {
    let table = root.table(key("retain", "Memory that a restart keeps."), "`[retain]`");
    let Some(table) = table else { return WrittenRetain::default() };
    let doc = table.doc();
    let mut retain = read(table, FILE.refused());
    retain.retention.file = None;
    if let Some(name) = retain.file.take() {
        let message = "the retentive memory of a test has no file";
        let finding = Finding::new(Code::TestFile, name.span, message);
        let help = "take `file` away: a test keeps its memory to itself";
        doc.find(finding.help(help).fix(FixEdit::Remove("file")));
    }
    retain
}

const FILE: Key =
    key("file", "The file; if not given, in systemd's state folder, or beside this file.");

const PATH: ParsedText<String> = ParsedText::new(|_, file| {
    if file.text.is_empty() || file.text.ends_with('/') || file.text.contains('\0') {
        let finding = Finding::new(Code::Controller, file.span, "memory is kept in a file");
        return Err(finding.propose(pair("file = \"/var/lib/rungd/memory\"")));
    }
    Ok(file.text.clone())
});

/// The mode after a cold start: whether it is RUN.
const COLD_START: KeyWords<bool> = KeyWords::new(&[("run", true), ("stop", false)])
    .refused_as(WrongWord::No("mode of a cold start", "`cold-start = \"stop\"` or `\"run\"`"));

fn read(mut table: Table<'_>, memory: Key) -> WrittenRetain {
    let default = Retention::default();
    let ranges = table.strings(
        key("ranges", "Data and structures: `CT8..CT15`, `D100..D199`.").holds(Slot::Operand),
    );
    let tags = table.strings(
        key("tags", "Tags: `shift`, `total_*`; `*` is any part of a name.").holds(Slot::Operand),
    );
    let stages = table.strings(
        key(
            "stages",
            "Programs whose Stages a restart keeps: `Batch`, `Flush*`; `*` is any part of a name.",
        )
        .holds(Slot::Block),
    );
    keeps_nothing(&table, [ranges.as_ref(), tags.as_ref(), stages.as_ref()]);
    let interval =
        key("interval", "The shortest time between two writes of changes; 1s if not given.");
    let cold_start =
        key("cold-start", "The mode after a start that finds no memory; `stop` if not given.");
    let budget = key(
        "budget-mb-per-day",
        "The log warns when more MB are written in a day; 2000 if not given.",
    );
    let file = table.value(memory, &PATH);
    let interval_ms = table.value_of(interval, &Millis::some("10ms"));
    let runs_cold = table.value_of(cold_start, &COLD_START);
    let budget_mb = table.whole(budget, 1..=10_000_000);
    table.finish();
    WrittenRetain {
        ranges: ranges.map_or(Vec::new(), |texts| texts.value),
        tags: tags.map_or(Vec::new(), |texts| texts.value),
        stages: stages.map_or(Vec::new(), |texts| texts.value),
        retention: Retention {
            file: file.as_ref().map(|file| file.value.clone()),
            interval_ms: interval_ms.unwrap_or(default.interval_ms),
            runs_cold: runs_cold.unwrap_or(default.runs_cold),
            budget_mb: budget_mb.map_or(default.budget_mb, |budget| budget.value),
        },
        file,
    }
}

/// Warns about a table that names nothing to keep. A list with items that are not texts already has
/// findings.
fn keeps_nothing(table: &Table<'_>, lists: [Option<&Located<Vec<Text>>>; 3]) {
    let mut given = lists.into_iter().flatten();
    let Some(list) = given.next() else {
        if !["ranges", "tags", "stages"].iter().any(|list| table.has(list)) {
            nothing(
                table,
                table.span(),
                "without `ranges`, `tags` and `stages` this keeps nothing",
            );
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
    let help = "say what a restart keeps, `ranges = [\"D0..D99\", \"CT0..CT7\"]`, `tags = \
                [\"total_*\"]`; or take `[retain]` away";
    let finding = finding.label("every start is a cold start").help(help);
    table.find(finding.fix(FixEdit::Remove("[retain]")));
}
