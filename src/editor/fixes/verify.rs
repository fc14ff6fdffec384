//! Tries a change: the changed text is judged, and the change is good if its finding is gone, no
//! error is new and, for a warning, the program does the same.
//!
//! "The same" is the same engine program: operations, cells, initial values. Settings of a
//! controller file are no part of it, so nothing but `allow` repairs a warning there.

use std::collections::HashMap;
use std::collections::hash_map::DefaultHasher;
use std::fmt::{self, Write as _};
use std::hash::Hasher;
use std::path::{Path, PathBuf};

use super::super::diagnostics::path_of;
use super::super::judge::{Judgement, judge};
use super::super::slots::FileKind;
use super::super::workspace::Workspace;
use super::change::TextChange;
use crate::load::OpenTexts;
use crate::lower::lower;
use crate::resolve::program::Program;
use crate::source::finding::{Code, Finding, Severity};

/// A finding, and the text that changes are tried on.
pub(super) struct FixTrial<'w> {
    judgement: &'w Judgement,
    finding: &'w Finding,
    texts: OpenTexts,
    path: &'w Path,
    text: &'w str,
    /// Whether the file decides what the program does.
    is_ladder: bool,
    /// The program as it is.
    program: Option<Option<u64>>,
}

/// A finding, wherever it stands: the file, its name, its message.
type Named<'j> = (&'j Path, Code, &'j str);

impl<'w> FixTrial<'w> {
    /// A finding of a judgement, in a file with this text.
    pub fn of(
        workspace: &Workspace,
        (judgement, finding): (&'w Judgement, &'w Finding),
        (path, text): (&'w Path, &'w str),
    ) -> FixTrial<'w> {
        let is_ladder =
            workspace.library.file(path).is_some_and(|file| file.kind == FileKind::Ladder);
        let texts = workspace.library.texts();
        FixTrial { judgement, finding, texts, path, text, is_ladder, program: None }
    }

    /// The bytes that a trial judges.
    pub fn bytes(&self) -> usize {
        self.judgement.files.iter().map(|file| file.text.len()).sum()
    }

    /// Whether changes repair the finding.
    pub fn repairs(&mut self, changes: &[TextChange]) -> bool {
        let Some(after) = self.better(changes) else { return false };
        match self.finding.severity() {
            Severity::Error => true,
            Severity::Warning if self.finding.code == Code::UnknownAllow => true,
            Severity::Warning => {
                let before = *self.program.get_or_insert_with(|| digest(self.judgement));
                self.is_ladder && before.is_some() && digest(&after) == before
            }
        }
    }

    /// Whether changes of `allow` silence the finding.
    pub fn silences(&mut self, changes: &[TextChange]) -> bool {
        self.better(changes).is_some()
    }

    /// The judgement of the changed text, if the finding is gone and no error is new.
    fn better(&self, changes: &[TextChange]) -> Option<Judgement> {
        let changed = applied(self.text, changes)?;
        let texts = self.texts.with(self.path, changed.into());
        let after = judge(0, &self.judgement.root, &texts);
        if after.failure.is_some() {
            return None;
        }
        let (old_paths, new_paths) = (paths(self.judgement), paths(&after));
        let (old, new) = (counted(self.judgement, &old_paths), counted(&after, &new_paths));
        let own = named(&old_paths, self.finding);
        let count = |of: &HashMap<Named, usize>, name: &Named| of.get(name).copied().unwrap_or(0);
        let is_gone = count(&new, &own) < count(&old, &own);
        let has_new = new.iter().any(|(name, count_now)| {
            name.1.severity() == Severity::Error && *count_now > count(&old, name)
        });
        (is_gone && !has_new).then_some(after)
    }
}

/// A text with changes; `None` if they overlap.
fn applied(text: &str, changes: &[TextChange]) -> Option<String> {
    let mut sorted: Vec<&TextChange> = changes.iter().collect();
    sorted.sort_by_key(|change| change.range.start);
    let mut changed = String::with_capacity(text.len() + 64);
    let mut at = 0;
    for change in sorted {
        changed.push_str(text.get(at..change.range.start)?);
        changed.push_str(&change.text);
        at = change.range.end;
    }
    changed.push_str(text.get(at..)?);
    Some(changed)
}

/// The paths of the judged files: each costs calls of the system, so once for all findings.
fn paths(judgement: &Judgement) -> Vec<PathBuf> {
    judgement.files.iter().map(path_of).collect()
}

fn named<'j>(paths: &'j [PathBuf], finding: &'j Finding) -> Named<'j> {
    let path = paths.get(finding.span.file.0 as usize).map_or(Path::new(""), PathBuf::as_path);
    (path, finding.code, &finding.message)
}

fn counted<'j>(judgement: &'j Judgement, paths: &'j [PathBuf]) -> HashMap<Named<'j>, usize> {
    let mut counted = HashMap::new();
    for finding in &judgement.findings {
        *counted.entry(named(paths, finding)).or_default() += 1;
    }
    counted
}

/// What a program does, as a number: two programs that do otherwise have different ones.
fn digest(judgement: &Judgement) -> Option<u64> {
    let program: &Program = judgement.program.as_ref()?;
    let mut digest = Digest(DefaultHasher::new());
    write!(digest, "{:?}", lower(program).0).ok()?;
    Some(digest.0.finish())
}

struct Digest(DefaultHasher);

impl fmt::Write for Digest {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}
