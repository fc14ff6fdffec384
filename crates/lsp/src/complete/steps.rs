//! Proposals in the steps of a test: the verbs, and the words after each verb.

use lsp_types::CompletionItemKind;

use super::contacts;
use super::files;
use super::lists;
use super::nature::WantedName;
use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use rungd_lab::testing::STEP_FORMS;

/// The proposals for an incomplete step.
pub(super) fn offer(scene: &CompletionScene, before: &str) -> Proposals {
    let text = before.trim_start();
    let verb = text.split([' ', '\t', ':']).next().unwrap_or_default();
    if verb.len() == text.len() {
        return verbs(text);
    }
    let condition = text.split_once(':').map(|(_, condition)| condition);
    match verb {
        "expect" | "within" | "hold" => match condition {
            Some(condition) => contacts::offer(scene, condition, WantedName::Condition),
            None => Proposals::of(""),
        },
        _ => words(scene, verb, &text[verb.len()..]),
    }
}

fn verbs(typed: &str) -> Proposals {
    let mut found = Proposals::of(typed);
    for (name, form, meaning) in STEP_FORMS {
        let mut proposal =
            CompletionProposal::new(name, CompletionItemKind::KEYWORD, 0).detail(form).doc(meaning);
        let rest = &form[name.len()..];
        let sign = if rest.starts_with(':') { ":" } else { "" };
        let space = if rest.is_empty() { "" } else { " " };
        proposal = proposal.writes(format!("{name}{sign}{space}"), Some(snippet(name)));
        found.add(proposal);
    }
    found
}

/// The form of a step as a snippet, with placeholders for its words.
fn snippet(name: &str) -> String {
    let rest = match name {
        "set" | "force" => " ${1:name} ${2:1}",
        "unforce" => " ${1:name}",
        "pulse" => " ${1:name} ${2:100ms}",
        "beat" => " ${1:name} ${2:100ms} every ${3:1s}",
        "run" => " ${1:1s}",
        "late" => " ${1:1}",
        "expect" => ": $1",
        "within" => " ${1:2s}: $2",
        "hold" => " ${1:300ms}: $2",
        "reload" => " ${1:ladder.toml}",
        "lose" | "restore" => " ${1:device}",
        "clock" => " ${1:2026-11-22T06:00:00}",
        _ => "",
    };
    format!("{name}{rest}")
}

/// The words after a step's verb; `rest` begins with a space.
fn words(scene: &CompletionScene, verb: &str, rest: &str) -> Proposals {
    let (done, word) = rest.rsplit_once([' ', '\t']).unwrap_or(("", rest));
    let number = done.split_whitespace().count();
    match (verb, number) {
        ("set" | "force" | "unforce" | "pulse" | "beat", 0) => {
            contacts::offer(scene, word, WantedName::Anything)
        }
        ("set" | "force", 1) => fixed(word, &["0", "1"]),
        ("pulse" | "beat", 2) => fixed(word, &["every"]),
        ("pulse", 4) => fixed(word, &["times"]),
        ("run", 1) => fixed(word, &["scans"]),
        ("power-cut", 0 | 2) => fixed(word, &["lose", "for"]),
        ("restart", 0) => fixed(word, &["for"]),
        ("lose" | "restore", 0) => lists::devices(scene, word),
        ("reload", _) => files::offer(scene, word),
        _ => Proposals::of(word),
    }
}

fn fixed(typed: &str, words: &[&str]) -> Proposals {
    let mut found = Proposals::of(typed);
    for word in words {
        found.add(CompletionProposal::new(*word, CompletionItemKind::KEYWORD, 0));
    }
    found
}
