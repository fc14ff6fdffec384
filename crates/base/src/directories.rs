//! The directories that systemd makes for a service, as named in the environment.
//!
//! Called by the daemon and by `edge`. It creates nothing.

use std::path::{Path, PathBuf};

/// The first directory of `$RUNTIME_DIRECTORY`: it exists as long as the service.
pub fn runtime() -> Option<PathBuf> {
    first("RUNTIME_DIRECTORY")
}

/// The first directory of `$STATE_DIRECTORY`: it survives a restart of the machine.
pub fn state() -> Option<PathBuf> {
    first("STATE_DIRECTORY")
}

/// The path of a file of a controller that survives restarts: this name in systemd's state
/// directory, else beside the controller file, with this name as its extension.
pub fn state_file(name: &str, controller: &Path) -> PathBuf {
    state().map_or_else(|| controller.with_extension(name), |folder| folder.join(name))
}

fn first(variable: &str) -> Option<PathBuf> {
    first_of(&std::env::var_os(variable)?.into_string().ok()?)
}

/// systemd lists absolute paths, separated by `:`. Any other value is not from systemd.
fn first_of(list: &str) -> Option<PathBuf> {
    list.split(':').next().filter(|first| first.starts_with('/')).map(PathBuf::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_directory_is_used_if_it_is_absolute() {
        let first = |list| first_of(list).map(|path| path.display().to_string());
        assert_eq!(first("/var/lib/rungd"), Some("/var/lib/rungd".to_owned()));
        assert_eq!(first("/var/lib/rungd:/var/lib/more"), Some("/var/lib/rungd".to_owned()));
        assert_eq!((first("var/lib"), first("")), (None, None));
    }
}
