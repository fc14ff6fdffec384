//! Proposals of names that fill a whole string: templates, blocks, devices, warnings.

use lsp_types::CompletionItemKind;

use super::describe::{detail, doc, symbol};
use super::proposal::{CompletionProposal, Proposals};
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
    found.retain(|proposal| own.as_ref() != Some(&proposal.label));
    for file in library::FILES {
        for name in file.templates() {
            let proposal = CompletionProposal::new(name, CompletionItemKind::CLASS, 1);
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
    found.retain(|proposal| !others.contains(&proposal.label.as_str()));
    found
}

/// The field devices.
pub(super) fn devices(scene: &CompletionScene, typed: &str) -> Proposals {
    let mut found = declared(scene, typed, &[DeclaredKind::Device]);
    for device in scene.announced_devices().filter(|device| *device != typed) {
        let proposal = CompletionProposal::new(device, CompletionItemKind::INTERFACE, 0);
        found.add(proposal.detail("field device"));
    }
    found
}

fn declared(scene: &CompletionScene, typed: &str, kinds: &[DeclaredKind]) -> Proposals {
    let mut found = Proposals::of(typed);
    for declared in scene.names().all.iter().filter(|candidate| kinds.contains(&candidate.kind)) {
        let proposal = CompletionProposal::new(&declared.name, symbol(declared.kind), 0);
        found.add(
            proposal.detail(detail(declared, scene.project)).doc(doc(declared, scene.project)),
        );
    }
    found
}

/// The warnings that the array around the cursor does not contain yet.
pub(super) fn warnings(scene: &CompletionScene, typed: &str) -> Proposals {
    let mut found = Proposals::of(typed);
    let others = scene.other_values(&scene.keys());
    let rows = finding::TABLE.iter().filter(|row| row.severity == Severity::Warning);
    for row in rows.filter(|row| !others.contains(&row.name)) {
        let proposal = CompletionProposal::new(row.name, CompletionItemKind::CONSTANT, 0);
        found.add(proposal.detail(row.summary));
    }
    found
}

/// The parameters of the template that is used at the site, without those in `present`.
pub(super) fn parameters(
    scene: &CompletionScene,
    typed: &str,
    present: &[&str],
) -> Vec<CompletionProposal> {
    let used = scene.value(&["use"]).and_then(|name| scene.names().template(name));
    let all = scene.names().all.iter();
    let of_template =
        all.filter(|declared| declared.kind == DeclaredKind::Parameter && declared.parent == used);
    let absent =
        of_template.filter(|declared| used.is_some() && !present.contains(&declared.name.as_str()));
    let fitting = Proposals::of(typed);
    let proposals = absent.filter(|declared| fitting.fits(&declared.name)).enumerate().map(
        |(order, declared)| {
            let facts = TagFacts::of(declared, &scene.project.files[declared.file]);
            let rank = u8::from(facts.text("default").is_some());
            let mut proposal = CompletionProposal::new(&declared.name, symbol(declared.kind), rank);
            proposal.order = order;
            proposal.detail(detail(declared, scene.project)).doc(doc(declared, scene.project))
        },
    );
    proposals.collect()
}
