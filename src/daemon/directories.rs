//! The directories that systemd makes for the service and names in the environment.

use std::path::PathBuf;

/// The first directory of `$RUNTIME_DIRECTORY`: it lasts as long as the service.
pub(super) fn runtime() -> Option<PathBuf> {
    first("RUNTIME_DIRECTORY")
}

/// The first directory of `$STATE_DIRECTORY`: it lasts over restarts of the machine.
pub(super) fn state() -> Option<PathBuf> {
    first("STATE_DIRECTORY")
}

/// systemd lists absolute paths with `:` between them; anything else is not from systemd.
fn first(variable: &str) -> Option<PathBuf> {
    let list = std::env::var_os(variable)?.into_string().ok()?;
    let first = list.split(':').next().filter(|first| first.starts_with('/'))?;
    Some(PathBuf::from(first))
}
