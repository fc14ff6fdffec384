//! The scan log at the start: its folder, and the program in the form that a recording stores.
//!
//! Called by the shell, and at every reload. `record_thread` and `record_disk` do the work.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::config::ControllerSetup;
use rungd_base::wall_clock::now_ns;
use rungd_history::record::{RecordedProgram, TapeClock};
use rungd_runtime::monotonic_ns;

/// The program of a generation in the form that a recording stores.
pub(super) fn program(setup: &ControllerSetup, generation: u32) -> RecordedProgram {
    static START_NS: OnceLock<i64> = OnceLock::new();
    RecordedProgram {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        process_start_ns: *START_NS.get_or_init(|| clock().unix_ns),
        generation,
        source: if generation == 0 { "start" } else { "reload" }.to_owned(),
        hash: setup.ladder.sha256.clone(),
        files: setup.files.to_vec(),
    }
}

/// The folder that the controller file sets (relative to that file), else the folder of the command
/// line; `None`: nothing is recorded on disk.
pub(super) fn place(setup: &ControllerSetup, asked: Option<&Path>) -> Option<PathBuf> {
    let named = || {
        let dir = setup.record.dir.as_ref()?;
        Some(Path::new(&setup.controller).parent().unwrap_or(Path::new("")).join(dir))
    };
    let dir = named().or_else(|| asked.map(Path::to_owned));
    dir.filter(|_| setup.record.enabled)
}

/// The current time by both clocks.
pub(super) fn clock() -> TapeClock {
    let unix_ns = now_ns();
    TapeClock { unix_ns, unix_offset_ns: unix_ns.saturating_sub_unsigned(monotonic_ns()) }
}
