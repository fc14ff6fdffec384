//! Proposals of names that fill a whole string: templates, blocks, devices, warnings.

use lsp_types::CompletionItemKind;

use super::describe::{detail, doc, symbol};
use super::proposal::{Proposal, Proposals};
use super::scene::CompletionScene;
use crate::slots::DeclaredKind;
use crate::tag_facts::TagFacts;
use rungd_config::load::library;
use rungd_language::source::file_kind::LIBRARY;
use rungd_language::source::finding::{self, Severity};

/// The templates of the project, then the templates of the library, whose files the project may
/// name.
pub(super) fn templates(scene: &CompletionScene, typed: &str) -> Proposals {
    let mut found = declared(scene, typed, &[DeclaredKind::Template]);
    // A template never uses itself.
    let own = scene.template().map(|at| scene.names().all[at].name.clone());
    found.retain(|of| own.as_ref() != Some(&of.label));
    for file in library::FILES {
        for name in file.templates() {
            let proposal = Proposal::new(name, CompletionItemKind::CLASS, 1);
            let detail = format!("template of {LIBRARY}{}", file.name);
            found.add(proposal.detail(detail).doc(file.head().0));
        }
    }
    found
}

/// The Programs and Tasks that the array around the cursor does not contain yet.
pub(super) fn blocks(scene: &CompletionScene, typed: &str) -> Proposals {
    let mut found = declared(scene, typed, &[DeclaredKind::Program, DeclaredKind::Task]);
    let others = scene.other_values(&scene.keys());
    found.retain(|of| !others.contains(&of.label.as_str()));
    found
}

/// The field devices.
pub(super) fn devices(scene: &CompletionScene, typed: &str) -> Proposals {
    let mut found = declared(scene, typed, &[DeclaredKind::Device]);
    for device in scene.announced_devices().filter(|device| *device != typed) {
        let proposal = Proposal::new(device, CompletionItemKind::INTERFACE, 0);
        found.add(proposal.detail("field device"));
    }
    found
}

fn declared(scene: &CompletionScene, typed: &str, kinds: &[DeclaredKind]) -> Proposals {
    let mut found = Proposals::of(typed);
    for of in scene.names().all.iter().filter(|of| kinds.contains(&of.kind)) {
        let proposal = Proposal::new(&of.name, symbol(of.kind), 0);
        found.add(proposal.detail(detail(of, scene.project)).doc(doc(of, scene.project)));
    }
    found
}

/// The warnings that the array around the cursor does not contain yet.
pub(super) fn warnings(scene: &CompletionScene, typed: &str) -> Proposals {
    let mut found = Proposals::of(typed);
    let others = scene.other_values(&scene.keys());
    let rows = finding::TABLE.iter().filter(|row| row.severity == Severity::Warning);
    for row in rows.filter(|row| !others.contains(&row.name)) {
        let proposal = Proposal::new(row.name, CompletionItemKind::CONSTANT, 0);
        found.add(proposal.detail(row.summary));
    }
    found
}

/// The parameters of the template that is used at the site, without those in `present`.
pub(super) fn parameters(scene: &CompletionScene, typed: &str, present: &[&str]) -> Vec<Proposal> {
    let used = scene.value(&["use"]).and_then(|name| scene.names().template(name));
    let all = scene.names().all.iter();
    let of_template = all.filter(|of| of.kind == DeclaredKind::Parameter && of.parent == used);
    let absent = of_template.filter(|of| used.is_some() && !present.contains(&of.name.as_str()));
    let fitting = Proposals::of(typed);
    let of = absent.filter(|of| fitting.fits(&of.name)).enumerate().map(|(order, of)| {
        let facts = TagFacts::of(of, &scene.project.files[of.file]);
        let rank = u8::from(facts.text("default").is_some());
        let mut proposal = Proposal::new(&of.name, symbol(of.kind), rank);
        proposal.order = order;
        proposal.detail(detail(of, scene.project)).doc(doc(of, scene.project))
    });
    of.collect()
}
