//! The proposals in a string, by the meaning of the string.

use lsp_types::CompletionItemKind;

use super::addresses;
use super::contacts;
use super::describe::{detail, doc, symbol};
use super::files;
use super::instructions;
use super::keys;
use super::lists;
use super::nature::WantedName;
use super::points;
use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use super::shapes::words;
use super::steps;
use crate::slots::{DeclaredKind, Slot};
use crate::tag_facts::TagFacts;
use rungd_language::source::shape::ValueForm;

/// The proposals after the text `before` in the string at the site.
pub(super) fn offer(scene: &CompletionScene, before: &str) -> Proposals {
    match scene.slot() {
        Slot::Contacts => contacts::offer(scene, before, WantedName::Contact),
        Slot::Condition => contacts::offer(scene, before, WantedName::Condition),
        Slot::Instruction => instructions::offer(scene, before),
        Slot::Argument => argument(scene, before),
        Slot::Template => lists::templates(scene, before),
        Slot::Allow => lists::warnings(scene, before),
        Slot::Block => lists::blocks(scene, before),
        Slot::File | Slot::DeviceLadder => files::offer(scene, before),
        Slot::Device => lists::devices(scene, before),
        Slot::Address => place(scene, before),
        Slot::Operand => operand(scene, before),
        Slot::Point => point(scene, before),
        Slot::Step => steps::offer(scene, before),
        Slot::Placeholders => placeholders(scene, before),
        Slot::Declares(_) => Proposals::of(before),
        Slot::Type => types(scene, before),
        Slot::Initial | Slot::Other => words_of(scene, before),
    }
}

/// An argument, by the type of its parameter.
fn argument(scene: &CompletionScene, before: &str) -> Proposals {
    let template = scene.value(&["use"]).and_then(|name| scene.names().template(name));
    let name = scene.site.keys.last().map(String::as_str).unwrap_or_default();
    let parameter = template.and_then(|template| scene.names().own(template, name));
    let wish = parameter.map_or(WantedName::Anything, |at| {
        if let Some(record) = scene.names().record_of(at) {
            return WantedName::Record(record);
        }
        let declared = &scene.names().all[at];
        let kind = TagFacts::of(declared, &scene.project.files[declared.file]).text("type");
        WantedName::of_parameter(kind.unwrap_or_default())
    });
    contacts::offer(scene, before, wish)
}

/// The address of a tag, with members of structures.
fn place(scene: &CompletionScene, before: &str) -> Proposals {
    if before.contains('.') {
        return contacts::offer(scene, before, WantedName::Anything);
    }
    let mut found = Proposals::of(before);
    addresses::offer_places(scene, &mut found);
    found
}

/// A name, or one of the words that the key allows.
fn operand(scene: &CompletionScene, before: &str) -> Proposals {
    let Some((key, form)) = scene.shape().entry(&keys::path(scene)) else {
        return contacts::offer(scene, before, WantedName::Anything);
    };
    match (words(&key, &form).is_empty(), form) {
        (false, _) => words_of(scene, before),
        (true, ValueForm::Duration | ValueForm::Period) => Proposals::of(before),
        (true, _) => contacts::offer(scene, before, WantedName::Anything),
    }
}

/// A point of the device around the cursor, or a name of the program.
fn point(scene: &CompletionScene, before: &str) -> Proposals {
    let mut found = operand(scene, before);
    let mut points = Proposals::of(before);
    points::offer(scene, &mut points);
    // The label of a point contains a dot: after the name of a part and its dot, only points fit.
    let is_part = before.contains(['.', ' ']) && !points.is_empty();
    if is_part || found.typed != before {
        points.signs = "_.";
        return if is_part { points } else { found };
    }
    points::offer(scene, &mut found);
    found
}

/// The words in the braces of a text: the use's name, and the parameters of the template around the
/// cursor.
fn placeholders(scene: &CompletionScene, before: &str) -> Proposals {
    let typed = before.rsplit_once('{').map(|(_, typed)| typed);
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let Some(typed) = typed.filter(|typed| typed.chars().all(is_letter)) else {
        return Proposals::of(before);
    };
    let mut found = Proposals::of(typed);
    let is_closed = scene.file.text[scene.offset + scene.tail("_")..].starts_with('}');
    let closed = |proposal: CompletionProposal| match is_closed {
        true => proposal,
        false => {
            let text = format!("{}}}", proposal.label);
            proposal.writes(text, None)
        }
    };
    let name =
        CompletionProposal::new("name", CompletionItemKind::VARIABLE, 0).detail("the use's name");
    found.add(closed(name));
    let all = scene.names().all.iter().filter(|declared| declared.kind == DeclaredKind::Parameter);
    for declared in
        all.filter(|parameter| parameter.parent.is_some() && parameter.parent == scene.template())
    {
        let proposal = CompletionProposal::new(&declared.name, symbol(declared.kind), 1);
        found.add(closed(
            proposal.detail(detail(declared, scene.project)).doc(doc(declared, scene.project)),
        ));
    }
    found
}

/// The types of tags, parameters and fields; a record is no type of a field.
fn types(scene: &CompletionScene, before: &str) -> Proposals {
    let mut found = words_of(scene, before);
    let is_field = scene.site.kind == "record";
    let records = scene.names().all.iter().filter(|one| one.kind == DeclaredKind::Record);
    for record in records.filter(|_| !is_field) {
        let proposal = CompletionProposal::new(&record.name, symbol(record.kind), 1);
        found.add(proposal.detail("record").doc(doc(record, scene.project)));
    }
    found
}

/// The words that the key allows.
fn words_of(scene: &CompletionScene, before: &str) -> Proposals {
    let mut found = Proposals::of(before);
    if let Some((key, form)) = scene.shape().entry(&keys::path(scene)) {
        for (order, word) in words(&key, &form).into_iter().enumerate() {
            let mut proposal = CompletionProposal::new(word, CompletionItemKind::ENUM_MEMBER, 0);
            proposal.order = order;
            found.add(proposal);
        }
    }
    found
}
