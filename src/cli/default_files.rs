//! The default files of a command that needs a program: the controller file of this folder, else
//! the controller file of the service.

use std::path::{Path, PathBuf};

use anyhow::Result;

use super::exit::CommandLine;
use rungd_config::load;

/// The controller file of the service.
const OF_SERVICE: &str = "/etc/rungd/controller.toml";

/// The files in `given`. If there are none, the controller file of this folder (`rungd.toml`, or
/// the only one there), else the controller file of the service.
///
/// # Errors
/// There is no controller file, or this folder has several.
pub(super) fn given_or_default(given: &[PathBuf]) -> Result<Vec<PathBuf>> {
    if !given.is_empty() {
        return Ok(given.to_vec());
    }
    let own = Path::new("rungd.toml");
    if own.is_file() {
        return Ok(vec![own.to_owned()]);
    }
    let here = controllers(Path::new("."));
    let message = match here.as_slice() {
        [_] => return Ok(here),
        [] if Path::new(OF_SERVICE).is_file() => return Ok(vec![PathBuf::from(OF_SERVICE)]),
        [] => format!(
            "no controller file in this folder, and no {OF_SERVICE}: name the files with `--in`"
        ),
        several => {
            let names: Vec<String> =
                several.iter().map(|path| path.display().to_string()).collect();
            let names = names.join(", ");
            format!("{names} are controller files in this folder: name one with `--in`")
        }
    };
    Err(CommandLine(message).into())
}

/// The controller files of a folder, in order of their names.
fn controllers(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.map(|entry| PathBuf::from(entry.file_name()));
    let is_controller = |path: &PathBuf| {
        let name = path.to_string_lossy();
        name.ends_with(".toml")
            && !name.ends_with(".test.toml")
            && load::is_controller_file(path).is_ok_and(|is| is)
    };
    let mut found: Vec<PathBuf> = names.filter(is_controller).collect();
    found.sort_unstable();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_file_of_the_service_is_the_file_that_the_unit_runs() {
        let unit = include_str!("../../config/systemd/rungd.service");
        let started = unit.lines().find(|line| line.starts_with("ExecStart="));
        assert!(started.is_some_and(|line| line.ends_with(&format!("run {OF_SERVICE}"))), "{unit}");
    }
}
