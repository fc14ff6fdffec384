//! `rungd check --fix`: corrects files as somebody does who takes every correction that is certain.
//!
//! `cli::check` calls [`correct`], and writes the corrected texts. A correction is taken if its
//! finding says that it is certain, and if its trial (`fixes::verify`) repairs the finding, brings
//! no error and, for a warning, leaves the program the same, operation for operation. The next
//! findings are those of the corrected texts, so two corrections never touch the same text at once.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::diagnostics::path_of;
use super::file::EditorFile;
use super::fixes::{CertainFix, certain, may_be_certain};
use super::judge::{JudgedRoot, Judgement, judge};
use super::lines::ColumnUnit;
use rungd_config::load::OpenTexts;
use rungd_config::load::files::read_bytes;
use rungd_language::source::file_kind::LIBRARY;
use rungd_language::source::finding::{Code, Finding};

/// The maximum number of corrections that are tried in one call: each judges the whole program.
const TRIALS_MAX: usize = 500;

/// One correction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Corrected {
    /// The line, from 1, at which it was made in the text of that time.
    pub line: u32,
    /// What it did: the title of the editor's action.
    pub title: String,
}

/// A file with corrections.
#[derive(Clone, Debug)]
pub struct CorrectedFile {
    /// Its path, as the program names it.
    pub name: String,
    /// The text that was read.
    pub before: String,
    /// The corrected text.
    pub after: String,
    /// The corrections, in the order in which they were made.
    pub corrections: Vec<Corrected>,
}

/// A finding whose certain fix was refused: it is not tried again at this line.
type RefusedFix = (PathBuf, Code, String, String);

/// The corrections of several programs, which share files.
#[derive(Default)]
struct Correction {
    texts: OpenTexts,
    files: BTreeMap<PathBuf, CorrectedFile>,
    refused: HashSet<RefusedFix>,
    trials: usize,
}

/// The corrected texts of controller files, each with its ladders, and of ladders that form one
/// program, and whether all corrections were tried. Nothing is written. Files of the library, and
/// files whose bytes are not their text, stay as they are.
pub fn correct(controllers: &[PathBuf], ladders: &[PathBuf]) -> (Vec<CorrectedFile>, bool) {
    let controllers = controllers.iter().cloned().map(JudgedRoot::Controller);
    let ladders = (!ladders.is_empty()).then(|| JudgedRoot::Ladders(ladders.to_vec()));
    let mut correction = Correction::default();
    for root in controllers.chain(ladders) {
        let mut judgement = judge(0, &root, &correction.texts);
        while let Some(next) = correction.improve(&judgement) {
            judgement = next;
        }
    }
    (correction.files.into_values().collect(), correction.trials < TRIALS_MAX)
}

impl Correction {
    /// Makes the first correction of a judgement that can be made, and returns the judgement of the
    /// corrected texts; `None` if there is no correction.
    fn improve(&mut self, judgement: &Judgement) -> Option<Judgement> {
        let findings = judgement.findings.iter().filter(|finding| may_be_certain(finding));
        let mut read: BTreeMap<PathBuf, Arc<EditorFile>> = BTreeMap::new();
        for finding in findings {
            let Some(source) = judgement.files.get(finding.span.file.0 as usize) else { continue };
            let path = path_of(source);
            if source.name.starts_with(LIBRARY) || !self.is_as_read(&path, &source.text) {
                continue;
            }
            let refused = refused(&path, finding, &source.text);
            if self.refused.contains(&refused) || self.trials == TRIALS_MAX {
                continue;
            }
            let text = || EditorFile::new(&path, source.text.as_str().into(), ColumnUnit::Utf8);
            let file = read.entry(path.clone()).or_insert_with(|| Arc::new(text()));
            self.trials += 1;
            if let Some(fix) = certain(&self.texts, judgement, finding, file) {
                return Some(self.take(&source.name, file, fix));
            }
            self.refused.insert(refused);
        }
        None
    }

    /// Whether a text is what the file has on disk, or a corrected one.
    fn is_as_read(&self, path: &Path, text: &str) -> bool {
        self.files.contains_key(path)
            || read_bytes(path).is_ok_and(|bytes| bytes == text.as_bytes())
    }

    fn take(&mut self, name: &str, file: &EditorFile, fix: CertainFix) -> Judgement {
        let CertainFix { title, start, text, judgement } = fix;
        let line = file.text[..start].matches('\n').count() as u32 + 1;
        self.texts = self.texts.with(&file.path, text.as_str().into());
        let corrected = self.files.entry(file.path.clone()).or_insert_with(|| CorrectedFile {
            name: name.to_owned(),
            before: file.text.to_string(),
            after: String::new(),
            corrections: Vec::new(),
        });
        corrected.after = text;
        corrected.corrections.push(Corrected { line, title });
        judgement
    }
}

fn refused(path: &Path, finding: &Finding, text: &str) -> RefusedFix {
    let at = (finding.span.start as usize).min(text.len());
    let before = text.get(..at).unwrap_or_default();
    let line = before.rfind('\n').map_or(0, |end| end + 1);
    let line = text[line..].lines().next().unwrap_or_default().to_owned();
    (path.to_owned(), finding.code, finding.message.clone(), line)
}
