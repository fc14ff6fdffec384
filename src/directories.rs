//! The directories that systemd makes for the service, as named in the environment.

use std::path::PathBuf;

/// The first directory of `$RUNTIME_DIRECTORY`: it exists as long as the service.
pub(super) fn runtime() -> Option<PathBuf> {
    first("RUNTIME_DIRECTORY")
}

/// The first directory of `$STATE_DIRECTORY`: it survives a restart of the machine.
pub(super) fn state() -> Option<PathBuf> {
    first("STATE_DIRECTORY")
}

/// systemd lists absolute paths, separated by `:`. Any other value is not from systemd.
fn first(variable: &str) -> Option<PathBuf> {
    let list = std::env::var_os(variable)?.into_string().ok()?;
    let first = list.split(':').next().filter(|first| first.starts_with('/'))?;
    Some(PathBuf::from(first))
}
