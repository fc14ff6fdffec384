//! Proposals in the steps of a test: the verbs, and the words after each verb.

use lsp_types::CompletionItemKind;

use super::contacts;
use super::files;
use super::lists;
use super::nature::WantedName;
use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use rungd_lab::testing::{STEP_FORMS, StepForm, StepNames, step_form};

/// The proposals for an incomplete step.
pub(super) fn offer(scene: &CompletionScene, before: &str) -> Proposals {
    let text = before.trim_start();
    let verb = text.split([' ', '\t', ':']).next().unwrap_or_default();
    if verb.len() == text.len() {
        return verbs(text);
    }
    let Some(step) = step_form(verb) else { return Proposals::of("") };
    words(scene, step, &text[verb.len()..])
}

fn verbs(typed: &str) -> Proposals {
    let mut found = Proposals::of(typed);
    for StepForm { name, form, meaning, gaps, .. } in &STEP_FORMS {
        let proposal = CompletionProposal::new(*name, CompletionItemKind::KEYWORD, 0);
        let rest = &form[name.len()..];
        let sign = if rest.starts_with(':') { ":" } else { "" };
        let space = if rest.is_empty() { "" } else { " " };
        let snippet = Some(format!("{name}{gaps}"));
        let proposal = proposal.detail(*form).doc(*meaning);
        found.add(proposal.writes(format!("{name}{sign}{space}"), snippet));
    }
    found
}

/// The words after a step's verb; `rest` begins with a space or a colon.
fn words(scene: &CompletionScene, step: &StepForm, rest: &str) -> Proposals {
    let (done, word) = rest.rsplit_once([' ', '\t']).unwrap_or(("", rest));
    let number = done.split_whitespace().count();
    match (step.names, number) {
        (StepNames::Condition, _) => match rest.split_once(':') {
            Some((_, condition)) => contacts::offer(scene, condition, WantedName::Condition),
            None => Proposals::of(""),
        },
        (StepNames::Operand, 0) => contacts::offer(scene, word, WantedName::Anything),
        (StepNames::Device, 0) => lists::devices(scene, word),
        (StepNames::Files, _) => files::offer(scene, word),
        (StepNames::Operand | StepNames::Device | StepNames::Nothing, _) => {
            fixed(word, literals(step.name, number))
        }
    }
}

/// The words without a meaning of their own at a position of a step.
fn literals(verb: &str, number: usize) -> &'static [&'static str] {
    match (verb, number) {
        ("set" | "force", 1) => &["0", "1"],
        ("pulse" | "beat", 2) => &["every"],
        ("pulse", 4) => &["times"],
        ("run", 1) => &["scans"],
        ("power-cut", 0 | 2) => &["lose", "for"],
        ("restart", 0) => &["for"],
        _ => &[],
    }
}

fn fixed(typed: &str, words: &[&str]) -> Proposals {
    let mut found = Proposals::of(typed);
    for word in words {
        found.add(CompletionProposal::new(*word, CompletionItemKind::KEYWORD, 0));
    }
    found
}
