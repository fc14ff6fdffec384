//! Ladders of the command line, as a test file would name them.
//!
//! `prove --equal` and `how` ask about ladders that have no test file.

use std::path::{Path, PathBuf};

use anyhow::Result;

use super::test::{OpenSuite, refused};
use rungd_config::load::OpenTexts;
use rungd_lab::testing::{Suite, ladders_text, read_text};
use rungd_language::source::span::SourceFile;

/// Ladders, and what a test file would say of them.
pub(super) struct AskedLadders<'a> {
    /// Ladder files, or one controller file.
    pub paths: &'a [PathBuf],
    /// The scan period of ladder files.
    pub period: &'a str,
    /// The rest of the test file.
    pub rest: &'a str,
}

impl AskedLadders<'_> {
    /// The test file; `None` after findings, which are printed.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn suite(&self) -> Result<Option<Suite>> {
        let names: Vec<String> = self.paths.iter().map(|path| path.display().to_string()).collect();
        let ladders = ladders_text(self.paths, self.period, &OpenTexts::default())?;
        let name = names.join(", ");
        let file = SourceFile { name: name.clone(), text: ladders + self.rest };
        let read = read_text(Path::new("asked.test.toml"), file, None);
        let opened = [OpenSuite { name, read }];
        if refused(&opened) {
            return Ok(None);
        }
        let [OpenSuite { read, .. }] = opened;
        Ok(read.suite)
    }
}
