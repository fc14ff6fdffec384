//! Files of other controllers: read for `rungd import`, and in place of ladder files for `check`,
//! `draw` and `xref`.
//!
//! `rungd_import` makes a project of such a file. Here it is loaded from memory, and nothing is
//! written. A file of the project has a name within the foreign one, as
//! `Conveyor.L5X/programs/belt.toml`.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::Result;

use super::exit::CommandLine;
#[cfg(feature = "import")]
pub use project::read_named;
use rungd_config::load::Loaded;

/// How much of a file tells whether it is a foreign one, in bytes.
const HEAD: usize = 256;

/// How a CLICK ladder in CSV begins.
const CLICK: &[u8] = b"marker,A,B,";

/// Whether a file is one of another controller: it begins as XML or a CLICK ladder does, and TOML
/// cannot.
pub(super) fn is_foreign(path: &Path) -> bool {
    // A pipe is read once, by what needs its text.
    let is_regular = fs::metadata(path).is_ok_and(|about| about.is_file());
    let mut head = [0; HEAD];
    let read = is_regular.then(|| File::open(path).and_then(|mut file| file.read(&mut head)));
    let Some(Ok(length)) = read else { return false };
    let text = begin(&head[..length]);
    text.starts_with(b"<") || text.starts_with(CLICK)
}

/// The text of a file from its first sign on.
fn begin(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start()
}

/// The program of a foreign file; a rung that is not translated is the finding `imported-todo`.
///
/// # Errors
/// The file cannot be read, or is of no known form.
pub(super) fn checked(path: &Path) -> Result<Loaded> {
    loaded(path, Stubs::Refused)
}

/// The program of a command's files, if they are one foreign file. A rung that is not translated
/// is drawn as one that never acts, with the original's text.
///
/// # Errors
/// The file cannot be read, is of no known form, or is named beside others.
pub(super) fn shown(paths: &[PathBuf]) -> Result<Option<Loaded>> {
    let Some(path) = paths.iter().find(|path| is_foreign(path)) else { return Ok(None) };
    if paths.len() > 1 {
        let message = format!("{}: a file of another controller stands alone", path.display());
        return Err(CommandLine(message).into());
    }
    loaded(path, Stubs::Drawn).map(Some)
}

/// What becomes of the rungs that are not translated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stubs {
    /// Each is the finding `imported-todo`.
    Refused,
    /// Each is drawn as a rung that never acts.
    Drawn,
}

#[cfg(feature = "import")]
fn loaded(path: &Path, stubs: Stubs) -> Result<Loaded> {
    project::loaded(path, stubs)
}

#[cfg(not(feature = "import"))]
fn loaded(path: &Path, _: Stubs) -> Result<Loaded> {
    let path = path.display();
    let message = format!(
        "{path}: a file of another controller, and this rungd was built without the feature \
         `import`"
    );
    Err(CommandLine(message).into())
}

#[cfg(feature = "import")]
mod project {
    //! The project of a foreign file, as `rungd_import` makes it.

    use std::fs;
    use std::path::Path;
    use std::sync::Arc;

    use anyhow::{Context, Result};

    use super::{CLICK, Stubs, begin};
    use crate::cli::exit::CommandLine;
    use crate::cli::terminal::one_line;
    use rungd_config::load::{self, Loaded, OpenTexts, identity, read_bytes};
    use rungd_import::model::ForeignProject;
    use rungd_import::write::{CONTROLLER, draw_stubs, files};
    use rungd_import::{click, domore, l5x, plcopen};

    /// Largest file that is read, in bytes.
    const BYTES_MAX: u64 = 256 * 1024 * 1024;

    /// The program of a project, from memory.
    pub(super) fn loaded(path: &Path, stubs: Stubs) -> Result<Loaded> {
        let mut project = read_named(path, None)?;
        if stubs == Stubs::Drawn {
            draw_stubs(&mut project);
        }
        let texts = files(&project).into_iter();
        let texts = texts.map(|file| (identity(&path.join(&file.path)), Arc::from(file.text)));
        load::controller_among(&path.join(CONTROLLER), &OpenTexts::new(texts))
    }

    /// The project of a foreign file; the tags of a CLICK ladder get the names of a nickname file.
    ///
    /// # Errors
    /// A file cannot be read, or is of no known form.
    pub fn read_named(path: &Path, nicknames: Option<&Path>) -> Result<ForeignProject> {
        let name = || one_line(&path.display().to_string()).into_owned();
        let text = text(path)?;
        let is_click = begin(text.as_bytes()).starts_with(CLICK);
        if nicknames.is_some() && !is_click {
            let message = format!("{}: nicknames belong to a CLICK ladder in CSV", name());
            return Err(CommandLine(message).into());
        }
        let project = match nicknames {
            Some(nicknames) => click::read_named(&text, &self::text(nicknames)?),
            None if is_click => click::read(&text),
            None if l5x::is_l5x(&text) => l5x::read(&text),
            None if plcopen::is_plcopen(&text) => plcopen::read(&text),
            None if domore::is_documentation(&text) => domore::read(&text),
            None => {
                let message = format!(
                    "{}: no L5X, no PLCopen XML, no CLICK ladder in CSV and no Do-more element \
                     documentation",
                    name()
                );
                return Err(CommandLine(message).into());
            }
        };
        project.map_err(|why| anyhow::anyhow!("{}: {why}", name()))
    }

    /// The text of a file.
    fn text(path: &Path) -> Result<String> {
        let name = || one_line(&path.display().to_string()).into_owned();
        let about = fs::metadata(path).with_context(name)?;
        if about.len() > BYTES_MAX {
            let mb = about.len() / (1024 * 1024);
            return Err(CommandLine(format!("{}: {mb} MB; at most 256 MB are read", name())).into());
        }
        let bytes = read_bytes(path).with_context(name)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}
