//! What fits in a string, by what the string stands for.

use lsp_types::CompletionItemKind;

use super::addresses;
use super::contacts;
use super::files;
use super::instructions;
use super::keys;
use super::lists;
use super::nature::{Wish, facts};
use super::proposal::{Proposal, Proposals};
use super::scene::CompletionScene;
use super::shapes::{entry, words};
use super::steps;
use crate::editor::slots::Slot;
use crate::source::shape::ValueForm;

/// What fits behind `before` in the string at the site.
pub(super) fn offer(scene: &CompletionScene, before: &str) -> Proposals {
    match scene.slot() {
        Slot::Contacts => contacts::offer(scene, before, Wish::Contact),
        Slot::Condition => contacts::offer(scene, before, Wish::Condition),
        Slot::Instruction => instructions::offer(scene, before),
        Slot::Argument => argument(scene, before),
        Slot::Template => lists::templates(scene, before),
        Slot::Allow => lists::warnings(scene, before),
        Slot::Block => lists::blocks(scene, before),
        Slot::File => files::offer(scene, before),
        Slot::Device => lists::devices(scene, before),
        Slot::Address => place(scene, before),
        Slot::Operand | Slot::Point => operand(scene, before),
        Slot::Step => steps::offer(scene, before),
        Slot::Declares(_) | Slot::Placeholders => Proposals::of(before),
        Slot::Type | Slot::Other => words_of(scene, before),
    }
}

/// An argument, by the type of its parameter.
fn argument(scene: &CompletionScene, before: &str) -> Proposals {
    let template = scene.value(&["use"]).and_then(|name| scene.names().template(name));
    let name = scene.site.keys.last().map(String::as_str).unwrap_or_default();
    let parameter = template.and_then(|template| scene.names().own(template, name));
    let wish = parameter.map_or(Wish::Anything, |at| {
        let of = &scene.names().all[at];
        let kind = facts(of, &scene.project.files[of.file]).text("type");
        Wish::of_parameter(kind.unwrap_or_default())
    });
    contacts::offer(scene, before, wish)
}

/// The address of a tag, with members of structures.
fn place(scene: &CompletionScene, before: &str) -> Proposals {
    if before.contains('.') {
        return contacts::offer(scene, before, Wish::Anything);
    }
    let mut found = Proposals::of(before);
    addresses::offer_places(scene, &mut found);
    found
}

/// A name, or one of the words that the key is limited to.
fn operand(scene: &CompletionScene, before: &str) -> Proposals {
    let Some((key, form)) = entry(&scene.shape(), &keys::path(scene)) else {
        return contacts::offer(scene, before, Wish::Anything);
    };
    match (words(&key).is_empty(), form) {
        (false, _) => words_of(scene, before),
        (true, ValueForm::Duration) => Proposals::of(before),
        (true, _) => contacts::offer(scene, before, Wish::Anything),
    }
}

/// The words that the key is limited to.
fn words_of(scene: &CompletionScene, before: &str) -> Proposals {
    let mut found = Proposals::of(before);
    if let Some((key, _)) = entry(&scene.shape(), &keys::path(scene)) {
        for (order, word) in words(&key).into_iter().enumerate() {
            let mut proposal = Proposal::new(word, CompletionItemKind::ENUM_MEMBER, 0);
            proposal.order = order;
            found.add(proposal);
        }
    }
    found
}
