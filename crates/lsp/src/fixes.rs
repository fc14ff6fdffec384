//! Code actions that repair a finding as its help advises, or silence a warning with `allow`.
//!
//! `requests` calls [`actions`]. `change` turns the fixes of a finding into changes of the file,
//! and `silence` makes the changes of `allow`. A proposal is offered only if `verify` accepts the
//! changed text: a wrong proposal costs time, but does no harm.

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, CodeActionParams, CodeActionResponse,
    Diagnostic, NumberOrString, TextEdit, WorkspaceEdit,
};

use self::edit::{ProposedChanges, TextChange};
use self::verify::{FixTrial, FixWorth};
use super::diagnostics::{message_text, path_of as judged_path};
use super::file::EditorFile;
use super::judge::Judgement;
use super::uri::path_of;
use super::workspace::Workspace;
use rungd_config::load::OpenTexts;
use rungd_language::source::finding::{Finding, Severity};
use rungd_language::source::fix::{Applicability, Fix};
use rungd_language::source::span::SourceFile;

mod change;
mod edit;
mod places;
mod silence;
mod tables;
mod verify;

/// The maximum number of changed texts that are judged for a request.
const TRIALS_MAX: usize = 24;
/// The maximum number of alternatives in a help that are judged for a finding.
const CHOICES_MAX: usize = 3;
/// The number of changed texts that are judged however large the project is.
const TRIALS_MIN: usize = 2;
/// The maximum of the bytes of all further texts: it takes long to judge a large project.
const TRIED_BYTES_MAX: usize = 4 << 20;
/// The maximum number of findings for which a request offers changes.
const FINDINGS_MAX: usize = 8;

/// The remaining trials of a request.
struct TrialBudget {
    trials: usize,
    bytes: usize,
}

impl TrialBudget {
    /// Takes a trial that judges `bytes` bytes; `false` if no trial is left.
    fn take(&mut self, bytes: usize) -> bool {
        let is_granted = TRIALS_MAX - self.trials < TRIALS_MIN;
        let may = self.trials > 0 && (is_granted || self.bytes >= bytes);
        self.trials -= usize::from(may);
        self.bytes = if may { self.bytes.saturating_sub(bytes) } else { self.bytes };
        may
    }
}

/// A change that is offered.
struct OfferedFix {
    title: String,
    changes: Vec<TextChange>,
    /// Whether it repairs the finding; otherwise it silences the finding.
    repairs: bool,
    /// Whether it is fully verified and not an example.
    is_sure: bool,
}

/// The code actions of the findings in a range.
pub(super) fn actions(
    workspace: &mut Workspace,
    params: CodeActionParams,
) -> Result<Option<CodeActionResponse>> {
    let kinds = params.context.only.as_ref();
    let is_wanted = kinds
        .is_none_or(|kinds| kinds.iter().any(|kind| ["", "quickfix"].contains(&kind.as_str())));
    let path = path_of(&params.text_document.uri);
    let Some(path) = path.filter(|_| is_wanted && takes_literals(workspace)) else {
        return Ok(None);
    };
    let Some(file) = workspace.library.file(&path) else { return Ok(None) };
    let within = file.offset(params.range.start)..file.offset(params.range.end);
    let mut left = TrialBudget { trials: TRIALS_MAX, bytes: TRIED_BYTES_MAX };
    let mut offered = Vec::new();
    for (judgement, finding) in findings(workspace, &path, &file, &within) {
        let mut trial = FixTrial::new(workspace.library.texts(), judgement, finding, &file);
        let offers = offers(&file, finding, &mut trial, &mut left);
        let is_clear = offers.iter().filter(|offer| offer.repairs).count() == 1;
        for offer in &offers {
            let diagnostic = shown(&file, &params.context.diagnostics, finding);
            let mut action = action(&params, &file, offer);
            action.is_preferred = (is_clear && offer.is_sure).then_some(true);
            action.diagnostics = diagnostic.map(|diagnostic| vec![diagnostic.clone()]);
            offered.push(CodeActionOrCommand::CodeAction(action));
        }
    }
    Ok(Some(offered))
}

/// Whether the editor supports code actions that contain edits.
fn takes_literals(workspace: &Workspace) -> bool {
    let abilities =
        workspace.client.text_document.as_ref().and_then(|document| document.code_action.as_ref());
    abilities.is_some_and(|action| action.code_action_literal_support.is_some())
}

/// The findings in a range of the present text of a file, each once. The finding nearest to the
/// start of the range comes first.
fn findings<'w>(
    workspace: &'w Workspace,
    path: &Path,
    file: &EditorFile,
    within: &Range<usize>,
) -> Vec<(&'w Judgement, &'w Finding)> {
    let mut near: Vec<(&Judgement, &Finding)> = Vec::new();
    for judgement in workspace.judged.values() {
        let is_here = |judged_file: &SourceFile| {
            judged_path(judged_file) == path && *judged_file.text == *file.text
        };
        let here: Vec<bool> = judgement.files.iter().map(is_here).collect();
        let asked = judgement.findings.iter().filter(|finding| {
            finding.span.start as usize <= within.end
                && within.start <= finding.span.end as usize
                && here.get(finding.span.file.0 as usize) == Some(&true)
        });
        near.extend(asked.map(|finding| (judgement, finding)));
    }
    near.sort_by_key(|(_, Finding { span, .. })| {
        ((span.start as usize).saturating_sub(within.start), span.end - span.start)
    });
    let mut found: Vec<(&Judgement, &Finding)> = Vec::new();
    for (judgement, finding) in near {
        let is_known = found.iter().any(|(_, known)| {
            (known.code, known.span.start, &known.message)
                == (finding.code, finding.span.start, &finding.message)
        });
        if !is_known {
            found.push((judgement, finding));
        }
        if found.len() == FINDINGS_MAX {
            break;
        }
    }
    found
}

/// The offers for a finding: repairs in the order of the help, then the uses of `allow`.
fn offers(
    file: &EditorFile,
    finding: &Finding,
    trial: &mut FixTrial,
    left: &mut TrialBudget,
) -> Vec<OfferedFix> {
    let span = finding.span.start as usize..finding.span.end as usize;
    let mut offers = Vec::new();
    let advice = finding.advice();
    let is_choice =
        |fix: &Fix| matches!(fix.applicability, Applicability::Spelling | Applicability::Possible);
    let mut choices = 0;
    for fix in advice.iter().flat_map(|help| &help.fixes) {
        choices += usize::from(is_choice(fix));
        if is_choice(fix) && choices > CHOICES_MAX {
            continue;
        }
        let taken = best(change::proposed(file, &span, fix), |changes| {
            left.take(trial.bytes()).then(|| trial.repairs(changes, fix.applicability))
        });
        if let Some((changes, worth)) = taken
            && !offers.iter().any(|known: &OfferedFix| known.changes == changes)
        {
            let changed = changes.first().map_or(span.clone(), |change| change.range.clone());
            let title = change::title(file, fix, changed);
            let is_sure = fix.applicability != Applicability::Possible && worth == FixWorth::Whole;
            offers.push(OfferedFix { title, changes, repairs: true, is_sure });
        }
    }
    if finding.severity() == Severity::Warning {
        for (title, changes) in silence::proposed(file, &span, finding.code.name()) {
            if left.take(trial.bytes()) && trial.silences(&changes) {
                offers.push(OfferedFix { title, changes, repairs: false, is_sure: false });
            }
        }
    }
    offers
}

/// A correction that is certain and fully verified.
pub(super) struct CertainFix {
    /// What it does.
    pub title: String,
    /// The first byte that it changes.
    pub start: usize,
    /// The corrected text of the file.
    pub text: String,
    /// The judgement of the corrected text.
    pub judgement: Judgement,
}

/// Whether a finding has a fix that is certain.
pub(super) fn may_be_certain(finding: &Finding) -> bool {
    let is_certain = |fix: &Fix| fix.applicability == Applicability::Certain;
    finding.advice().is_some_and(|help| help.fixes.iter().any(is_certain))
}

/// The first fix of a finding that is certain and fully verified by judging the changed text among
/// these texts.
pub(super) fn certain(
    texts: &OpenTexts,
    judgement: &Judgement,
    finding: &Finding,
    file: &Arc<EditorFile>,
) -> Option<CertainFix> {
    let span = finding.span.start as usize..finding.span.end as usize;
    let advice = finding.advice()?;
    let mut trial = FixTrial::new(texts.clone(), judgement, finding, file);
    let is_certain = |fix: &&Fix| fix.applicability == Applicability::Certain;
    advice.fixes.iter().filter(is_certain).find_map(|fix| {
        let changes = change::exact(file, &span, fix)?;
        let judged = trial.judged(&changes, fix.applicability);
        let (_, judgement) = judged.filter(|(worth, _)| *worth == FixWorth::Whole)?;
        let changed = changes
            .iter()
            .map(|change| change.range.clone())
            .min_by_key(|changed| changed.start)?;
        let text = verify::applied(&file.text, &changes)?;
        let start = changed.start;
        Some(CertainFix { title: change::title(file, fix, changed), start, text, judgement })
    })
}

/// The first proposal that is fully verified, else the first proposal that repairs. `repairs`
/// returns the worth of a proposal, or `None` if no more proposals may be tried.
fn best(
    proposed: Vec<ProposedChanges>,
    mut repairs: impl FnMut(&[TextChange]) -> Option<Option<FixWorth>>,
) -> Option<(ProposedChanges, FixWorth)> {
    let mut first = None;
    for changes in proposed {
        match repairs(&changes) {
            Some(Some(FixWorth::Whole)) => return Some((changes, FixWorth::Whole)),
            Some(Some(FixWorth::First)) if first.is_none() => {
                first = Some((changes, FixWorth::First));
            }
            Some(Some(FixWorth::First) | None) => {}
            None => break,
        }
    }
    first
}

/// The diagnostic of the editor that shows a finding.
fn shown<'d>(
    file: &EditorFile,
    diagnostics: &'d [Diagnostic],
    finding: &Finding,
) -> Option<&'d Diagnostic> {
    let place = file.place(finding.span.start as usize..finding.span.end as usize);
    let code = NumberOrString::String(finding.code.name().to_owned());
    let message = message_text(finding);
    diagnostics.iter().find(|diagnostic| {
        diagnostic.code.as_ref() == Some(&code)
            && diagnostic.range == place
            && diagnostic.message == message
    })
}

#[allow(clippy::mutable_key_type)] // The type of the protocol.
fn action(params: &CodeActionParams, file: &EditorFile, offer: &OfferedFix) -> CodeAction {
    let edits = offer.changes.iter().map(|change| TextEdit {
        range: file.place(change.range.clone()),
        new_text: change.text.clone(),
    });
    let changes = HashMap::from([(params.text_document.uri.clone(), edits.collect())]);
    CodeAction {
        title: offer.title.clone(),
        kind: Some(CodeActionKind::QUICKFIX),
        edit: Some(WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() }),
        ..CodeAction::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_trial_fixes_shrinks_with_the_size_of_the_project() {
        let tried = |bytes: usize| {
            let mut left = TrialBudget { trials: TRIALS_MAX, bytes: TRIED_BYTES_MAX };
            (0..100).filter(|_| left.take(bytes)).count()
        };
        assert_eq!(tried(1_000), TRIALS_MAX);
        assert_eq!(tried(1 << 20), 4);
        assert_eq!(tried(100 << 20), TRIALS_MIN);
    }
}
