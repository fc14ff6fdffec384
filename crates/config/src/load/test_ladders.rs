//! Loads the ladders under test, around the settings of a test file or of a controller file.
//!
//! Called by `testing`. The file with the settings has the number 0, like a controller file; the
//! ladder files follow. The paths of the ladder files are relative to the test file.

use std::path::{Path, PathBuf};

use super::sides::SideFiles;
use super::{InputFile, Loaded, OpenTexts, files, library};
use crate::controller::written::WrittenController;
use rungd_language::source::finding::Code;
use rungd_language::source::span::{FileId, SourceFile};

/// The kinds of files that a `reload` step may name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputKind {
    /// A ladder file.
    Ladder,
    /// A controller file.
    Controller,
}

/// The file with the settings of the ladders under test.
pub struct SettingsFile {
    /// Its name and text.
    pub file: SourceFile,
    /// The kind of the settings: a controller file declares the devices.
    pub kind: InputKind,
}

/// Loads the ladder files that `settings` names, relative to the test file `naming`. `file` is the
/// file with the settings.
pub fn bench(
    naming: &Path,
    SettingsFile { file, kind }: SettingsFile,
    settings: &WrittenController,
    texts: &OpenTexts,
) -> Loaded {
    let mut loaded = Loaded { files: vec![file], texts: texts.clone(), ..Loaded::default() };
    loaded.lost.add_settings(FileId(0), settings.lost.clone());
    if loaded.named_files(naming, "test file", &settings.ladder) {
        let files = 1..loaded.files.len();
        loaded.with_settings(settings, files, kind == InputKind::Controller);
    }
    // The ladders beside those under test are named by the controller file.
    let controller = loaded.files[0].name.clone();
    loaded.settings(settings, SideFiles::Named(Path::new(&controller), "controller file"));
    loaded.judge();
    for finding in loaded.findings.iter_mut().filter(|finding| finding.span.file == FileId(0)) {
        if finding.code == Code::Controller {
            finding.code = Code::TestFile;
        }
    }
    loaded
}

/// The kind of a file that a test names.
///
/// # Errors
/// The file cannot be read. The text is a message.
pub fn input_kind(path: &Path, texts: &OpenTexts) -> Result<InputKind, String> {
    match InputFile::open(path, texts) {
        Ok(input) if input.is_controller() => Ok(InputKind::Controller),
        Ok(_) => Ok(InputKind::Ladder),
        Err(failure) if path.to_str().and_then(library::named).is_some() => {
            Err(format!("{failure:#}"))
        }
        Err(failure) => Err(format!("cannot read `{}`: {}", path.display(), failure.root_cause())),
    }
}

/// The path of a file that a test file names.
pub fn path_of(naming: &Path, name: &str) -> PathBuf {
    match library::named(name) {
        Some(_) => PathBuf::from(name),
        None => naming.parent().unwrap_or(Path::new("")).join(name),
    }
}

/// The identity of a file that a test names: the same for all spellings of its path.
pub fn identity_of(naming: &Path, name: &str) -> PathBuf {
    match library::named(name) {
        Some(_) => PathBuf::from(name),
        None => files::identity(&path_of(naming, name)),
    }
}
