//! Distinguishes ladder files, controller files and test files, by their tables.
//!
//! Called to choose the reader of a file. It does not check keys; the readers do.

use super::finding::{Code, Finding};
use super::reader::{self, Table};
use super::span::{FileId, Span};

/// The prefix in the names of the library's files: `lib:pid`.
pub const LIBRARY: &str = "lib:";

/// Whether a text is a controller file rather than a ladder file. `false` if it is not TOML.
pub fn is_controller(source: &str) -> bool {
    reader::document(source, FileId(0), |root| is_controller_root(&root)).0.unwrap_or(false)
}

/// The place of the first table that only a ladder file has; `None` if the text is not a ladder
/// file.
pub fn ladder_place(source: &str, file: FileId) -> Option<Span> {
    let place = |root: Table<'_>| {
        let keys =
            ["program", "task", "subroutine", "tags"].iter().filter_map(|key| root.key_span(key));
        let head = root.key_span("ladder").filter(|_| root.has_table("ladder"));
        let names_files = root.has("ladder") && head.is_none();
        keys.chain(head).min_by_key(|span| span.start).filter(|_| !names_files)
    };
    reader::document(source, file, place).0.flatten()
}

/// The finding about a test file in the place of a different kind of file; `None` if the text is
/// not a test file.
pub fn of_test(source: &str, file: FileId, wanted: &str) -> Option<Finding> {
    reader::document(source, file, |root| of_test_root(&root, wanted)).0.flatten()
}

/// Whether a text may be a file of rungd: it has a table of such a file, or it is so broken that no
/// table of it can be read.
pub fn may_be_of_rungd(source: &str) -> bool {
    let of_root = |root: Table<'_>| {
        let is_own = has_keys(|key| root.has(key), |key| root.has_table(key));
        (is_own, root.is_empty())
    };
    let (of_root, broken) = reader::document(source, FileId(0), of_root);
    of_root.is_none_or(|(is_own, is_empty)| is_own || is_empty && !broken.is_empty())
}

/// Keys that only test files have.
const OF_TESTS: [&str; 5] = ["always", "scenario", "random", "prove", "interlock"];

/// Whether the root has a table of a file of rungd. `has` is whether the root has a key;
/// `has_table`, whether the key is a table.
pub fn has_keys(has: impl Fn(&str) -> bool, has_table: impl Fn(&str) -> bool) -> bool {
    let keys = ["program", "task", "subroutine", "template"];
    let is_ladder = ["tags", "ladder"].iter().any(|key| has_table(key));
    is_ladder
        || keys.iter().chain(&OF_TESTS).any(|key| has(key))
        || has_controller_keys(&has, has_table("ladder"))
}

/// As [`of_test`], for a file that is already parsed.
pub(super) fn of_test_root(root: &Table<'_>, wanted: &str) -> Option<Finding> {
    let is_ladder =
        ["program", "task", "subroutine", "tags", "template"].iter().any(|key| root.has(key));
    let place =
        OF_TESTS.iter().filter_map(|key| root.key_span(key)).min_by_key(|span| span.start)?;
    if is_ladder || root.has_table("ladder") {
        return None;
    }
    let finding = Finding::new(Code::TestFile, place, format!("this is a test file, not {wanted}"));
    Some(finding.help("`rungd test` runs it, and reports its mistakes"))
}

/// Whether the root is of a controller file: `ladder` is not a table, or, without `ladder`, it has
/// tables of a controller file and none of a ladder file.
pub(super) fn is_controller_root(root: &Table<'_>) -> bool {
    has_controller_keys(|key| root.has(key), root.has_table("ladder"))
}

/// As [`is_controller_root`], from the keys of the root. `has` is whether the root has a key.
pub fn has_controller_keys(has: impl Fn(&str) -> bool, ladder_is_table: bool) -> bool {
    let ladder_file = ["program", "task", "subroutine", "tags"].iter().any(|key| has(key));
    let controller = [
        "scan",
        "realtime",
        "outputs",
        "retain",
        "reload",
        "modbus-server",
        "simulated-device",
        "device",
        "operator",
    ];
    let tables = controller.iter().any(|key| has(key));
    if has("ladder") {
        return !ladder_is_table;
    }
    tables && !ladder_file
}
