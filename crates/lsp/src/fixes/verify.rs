//! Tries a change: judges the changed text. The change is accepted if the finding is gone, no error
//! is new and, for a warning, the program does the same.
//!
//! "The same" means the same engine program: operations, cells, initial values. Three exceptions:
//!
//! - When a misspelled name is corrected, errors can appear that the misspelling hid. New errors in
//!   the table or line of the change are accepted, but the change is never the preferred one.
//! - A constant that a rule has computed (`if it is meant, write …`) is a different operation with
//!   the same result, and `initial = 0` is the value with which memory begins anyway. A project
//!   with errors has no program to compare. In these cases the fix must be one with the same
//!   meaning, and no finding may be new.
//! - The settings of a controller file and the tests are not part of the program, so their effect
//!   cannot be compared. There the program must be the same and no finding may be new. Such a
//!   change writes only the text of the fix, and is never the preferred one.

use std::collections::HashMap;
use std::collections::hash_map::DefaultHasher;
use std::fmt::{self, Write as _};
use std::hash::Hasher;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::super::diagnostics::path_of;
use super::super::file::EditorFile;
use super::super::judge::{Judgement, judge};
use super::super::slots::FileKind;
use super::edit::TextChange;
use super::places::object_at;
use rungd_config::load::OpenTexts;
use rungd_language::lower::lower;
use rungd_language::resolve::program::Program;
use rungd_language::source::finding::{Code, Finding, Severity};
use rungd_language::source::fix::Applicability;

/// Warnings whose help gives a text with the same value: the value that a rule has computed, or the
/// value with which memory begins.
const COMPUTED: [Code; 5] = [
    Code::ConstantCompare,
    Code::ConstantSaturates,
    Code::LostFraction,
    Code::MathConstants,
    Code::NeverWritten,
];

/// A finding, and the file on which its changes are tried.
pub(super) struct FixTrial<'w> {
    judgement: &'w Judgement,
    finding: &'w Finding,
    texts: OpenTexts,
    file: &'w Arc<EditorFile>,
    /// The digest of the unchanged program, once it is computed.
    program: Option<Option<u64>>,
}

/// The worth of a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FixWorth {
    /// The change is fully verified.
    Whole,
    /// The finding is gone; the author must judge all other effects.
    First,
}

/// A changed text and its judgement.
struct TriedText {
    judgement: Judgement,
    /// The findings that the unchanged text does not have.
    new: Vec<Finding>,
}

/// A finding without its place in the file: the file, the code, the message.
type FindingIdentity<'j> = (&'j Path, Code, &'j str);

impl<'w> FixTrial<'w> {
    /// A trial for a finding of a judgement of these texts, in this file.
    pub fn new(
        texts: OpenTexts,
        judgement: &'w Judgement,
        finding: &'w Finding,
        file: &'w Arc<EditorFile>,
    ) -> FixTrial<'w> {
        FixTrial { judgement, finding, texts, file, program: None }
    }

    /// The number of bytes that a trial judges.
    pub fn bytes(&self) -> usize {
        self.judgement.files.iter().map(|file| file.text.len()).sum()
    }

    /// The worth of the changes of a fix; `None` if they do not repair the finding.
    pub fn repairs(
        &mut self,
        changes: &[TextChange],
        applicability: Applicability,
    ) -> Option<FixWorth> {
        self.judged(changes, applicability).map(|(worth, _)| worth)
    }

    /// The same with the judgement of the changed text.
    pub fn judged(
        &mut self,
        changes: &[TextChange],
        applicability: Applicability,
    ) -> Option<(FixWorth, Judgement)> {
        let after = self.tried(changes)?;
        let worth = self.worth(changes, applicability, &after)?;
        Some((worth, after.judgement))
    }

    fn worth(
        &mut self,
        changes: &[TextChange],
        applicability: Applicability,
        after: &TriedText,
    ) -> Option<FixWorth> {
        let has_error = after.new.iter().any(is_error);
        if self.finding.severity() == Severity::Error {
            let is_spelling =
                applicability == Applicability::Spelling || self.finding.code == Code::WrongCase;
            let is_proposed =
                matches!(applicability, Applicability::Possible | Applicability::Proposed);
            let is_toml = after.new.iter().all(|finding| finding.code != Code::TomlSyntax);
            return match has_error {
                false if is_proposed && self.brings_near(after, changes) => None,
                false => Some(FixWorth::Whole),
                true => (is_spelling && is_toml && self.are_near(after, changes))
                    .then_some(FixWorth::First),
            };
        }
        if has_error {
            return None;
        }
        if self.finding.code == Code::UnknownAllow {
            return Some(FixWorth::Whole);
        }
        let before = *self.program.get_or_insert_with(|| digest(self.judgement));
        let is_same = digest(&after.judgement) == before;
        let is_clean = after.new.is_empty();
        let is_as_read = applicability == Applicability::Same && is_clean;
        match self.file.kind {
            FileKind::Controller | FileKind::Test => {
                (is_clean && is_same).then_some(FixWorth::First)
            }
            FileKind::Ladder if before.is_some() && is_same => Some(FixWorth::Whole),
            FileKind::Ladder => {
                let is_computed = COMPUTED.contains(&self.finding.code) || before.is_none();
                (is_as_read && is_computed).then_some(FixWorth::First)
            }
        }
    }

    /// Whether changes of `allow` silence the finding.
    pub fn silences(&mut self, changes: &[TextChange]) -> bool {
        self.tried(changes).is_some_and(|after| !after.new.iter().any(is_error))
    }

    /// The judgement of the changed text, if the finding is gone.
    fn tried(&self, changes: &[TextChange]) -> Option<TriedText> {
        let changed = applied(&self.file.text, changes)?;
        let texts = self.texts.with(&self.file.path, changed.into());
        let judgement = judge(0, &self.judgement.root, &texts);
        if judgement.failure.is_some() {
            return None;
        }
        let (old_paths, new_paths) = (paths(self.judgement), paths(&judgement));
        let own = named(&old_paths, self.finding);
        let count = |counts: &HashMap<FindingIdentity, usize>, name: &FindingIdentity| {
            counts.get(name).copied().unwrap_or(0)
        };
        let still = self.moved(changes).is_some_and(|at| {
            let same = |finding: &&Finding| finding.span.start as usize == at;
            judgement.findings.iter().filter(same).any(|finding| named(&new_paths, finding) == own)
        });
        let mut old = counted(self.judgement, &old_paths);
        if still || count(&counted(&judgement, &new_paths), &own) >= count(&old, &own) {
            return None;
        }
        let mut new = Vec::new();
        for finding in &judgement.findings {
            let known = old.entry(named(&new_paths, finding)).or_default();
            match known.checked_sub(1) {
                Some(left) => *known = left,
                None => new.push(finding.clone()),
            }
        }
        drop(old);
        Some(TriedText { judgement, new })
    }

    /// The start of the finding after the changes; `None` if they change the text there.
    fn moved(&self, changes: &[TextChange]) -> Option<usize> {
        let at = self.finding.span.start as usize;
        let is_changed = |change: &TextChange| change.range.start <= at && at < change.range.end;
        if changes.iter().any(is_changed) {
            return None;
        }
        let before = changes.iter().filter(|change| change.range.end <= at);
        let moved = before.fold(at + 1, |at, change| at + change.text.len() - change.range.len());
        Some(moved - 1)
    }

    /// Whether all new findings are in the table, or in the line, of the changes.
    fn are_near(&self, after: &TriedText, changes: &[TextChange]) -> bool {
        let Some(first) = changes.first() else { return false };
        self.near(&first.range, after, changes).count() == after.new.len()
    }

    /// Whether a new finding is in the table, or in the line, of the finding. Elsewhere there can
    /// be new warnings because the program has an error less.
    fn brings_near(&self, after: &TriedText, changes: &[TextChange]) -> bool {
        let Finding { span, .. } = self.finding;
        let place = span.start as usize..span.end as usize;
        let header = self.file.outline.header_at(place.start).map(|header| header.span.start);
        let paths = paths(&after.judgement);
        let is_at_header = |finding: &Finding| {
            named(&paths, finding).0 == self.file.path
                && Some(finding.span.start as usize) == header
        };
        after.new.iter().any(is_at_header) || self.near(&place, after, changes).next().is_some()
    }

    /// The new findings in the table, or in the line, of a place.
    fn near<'a>(
        &'a self,
        place: &Range<usize>,
        after: &'a TriedText,
        changes: &[TextChange],
    ) -> impl Iterator<Item = &'a Finding> {
        let paths = paths(&after.judgement);
        let around = self.around(place, changes);
        after.new.iter().filter(move |finding| {
            let at = finding.span.start as usize;
            named(&paths, finding).0 == self.file.path && around.contains(&at)
        })
    }

    /// The table or the line of a place, in the changed text.
    fn around(&self, place: &Range<usize>, changes: &[TextChange]) -> RangeInclusive<usize> {
        let around = match object_at(self.file, place) {
            0 => self.file.line(place.start),
            object => self.file.outline.objects[object].extent.clone(),
        };
        let (more, less) = changes.iter().fold((0, 0), |(more, less), change| {
            (more + change.text.len(), less + change.range.len())
        });
        around.start..=(around.end + more).saturating_sub(less)
    }
}

fn is_error(finding: &Finding) -> bool {
    finding.severity() == Severity::Error
}

/// A text with changes; `None` if they overlap.
pub(super) fn applied(text: &str, changes: &[TextChange]) -> Option<String> {
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

/// The paths of the judged files. Each path costs system calls, so they are computed once for all
/// findings.
fn paths(judgement: &Judgement) -> Vec<PathBuf> {
    judgement.files.iter().map(path_of).collect()
}

fn named<'j>(paths: &'j [PathBuf], finding: &'j Finding) -> FindingIdentity<'j> {
    let path = paths.get(finding.span.file.0 as usize).map_or(Path::new(""), PathBuf::as_path);
    (path, finding.code, &finding.message)
}

fn counted<'j>(
    judgement: &'j Judgement,
    paths: &'j [PathBuf],
) -> HashMap<FindingIdentity<'j>, usize> {
    let mut counted = HashMap::new();
    for finding in &judgement.findings {
        *counted.entry(named(paths, finding)).or_default() += 1;
    }
    counted
}

/// A hash of what a program does: programs that do different things have different hashes.
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
