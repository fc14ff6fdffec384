//! Ladder file or controller file: told by the tables that a text has.
//!
//! Called before a file is read for what it is; the keys themselves are the readers' business.

use super::reader::{self, Table};
use super::span::{FileId, Span};

/// Whether a text is a controller file rather than a ladder file. Says no to what is not TOML.
pub fn is_controller(source: &str) -> bool {
    reader::document(source, FileId(0), |root| is_controller_root(&root)).0.unwrap_or(false)
}

/// Where a text shows that it is a ladder file rather than a controller file, if it is one.
pub fn ladder_place(source: &str, file: FileId) -> Option<Span> {
    let place = |root: Table<'_>| {
        let keys = ["program", "task", "tags"].iter().filter_map(|key| root.key_span(key));
        let head = root.key_span("ladder").filter(|_| root.has_table("ladder"));
        let names_files = root.has("ladder") && head.is_none();
        keys.chain(head).min_by_key(|span| span.start).filter(|_| !names_files)
    };
    reader::document(source, file, place).0.flatten()
}

/// Whether `ladder` is not a table in a file, or it has a controller's tables and no ladder's.
pub(super) fn is_controller_root(root: &Table<'_>) -> bool {
    let ladder_file = ["program", "task", "tags"].iter().any(|key| root.has(key));
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
    let tables = controller.iter().any(|key| root.has(key));
    if root.has("ladder") {
        return !root.has_table("ladder");
    }
    tables && !ladder_file
}
