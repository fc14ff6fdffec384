//! Templates: replaces their uses by rungs and stages.
//!
//! Called by `resolve` before any name is declared. [`Resolver::expand`] expands every use. Each
//! block then has only rungs and stages, and the ladder has the own tags of all uses (`p1.failed`).
//! Once all names are declared, `plain` calls [`Resolver::check_arguments`], which checks the
//! arguments of each use. No later step handles templates.

mod arguments;
mod declared;
mod expand;
mod given;
mod kind;
mod nesting;
mod parameter;
pub(super) mod pending;
mod rewrite;
mod room;
mod texts;
mod trial;

use super::Resolver;
use super::layers::Layers;
use crate::source::file_kind::LIBRARY;
use crate::source::ladder::{Entry, Ladder, Template};
use crate::source::span::{FileId, Span};
use declared::{Templates, uses};
use expand::Expansion;
pub use kind::{ParameterKind, is_type_name};
pub use texts::placeholders;

/// Ladders whose uses are expanded.
pub(super) type Ladders = Vec<(FileId, Ladder)>;

impl Resolver<'_> {
    /// Expands every use of a template.
    pub(super) fn expand(&mut self, ladders: Vec<(FileId, Ladder<Entry>)>) -> Ladders {
        let all = || ladders.iter().flat_map(|(_, ladder)| &ladder.templates);
        let templates: Vec<Template> = all().cloned().collect();
        let records = std::mem::take(&mut self.records);
        let (mut templates, mut findings) = Templates::new(templates.iter(), &records);
        nesting::check(&mut templates, &mut findings);
        let mut expansion = Expansion::new(&templates);
        expansion.layers = std::mem::take(&mut self.layers);
        let mut used = vec![false; templates.all.len()];
        for template_use in templates
            .all
            .iter()
            .flat_map(|declared| uses(declared.template).map(move |u| (declared, u)))
        {
            let own = |to: usize| std::ptr::eq(templates.all[to].template, template_use.0.template);
            if let Some(to) = templates.position(template_use.1).filter(|to| !own(*to)) {
                used[to] = true;
            }
        }
        let mut plain = Vec::new();
        for (file, ladder) in ladders {
            plain.push((file, expansion.ladder(ladder, &mut used)));
        }
        let of_library = |span: Span| self.file_name(span.file).starts_with(LIBRARY);
        let unused = templates.unused(&used);
        findings.extend(unused.into_iter().filter(|finding| !of_library(finding.span)));
        let own: Vec<bool> =
            templates.all.iter().map(|declared| !of_library(declared.template.span)).collect();
        // Templates that nothing uses come first: their trials also expand the templates that they
        // use.
        for is_used in [false, true] {
            for (at, declared) in templates.all.iter().enumerate() {
                if own[at] && used[at] == is_used && !expansion.written[at] {
                    self.trials.extend(expansion.trial(declared));
                }
            }
        }
        if expansion.is_over() {
            // An incomplete expansion is not worth the time of checking it.
            plain.iter_mut().for_each(|(_, ladder)| forget_rungs(ladder));
            expansion.arguments.clear();
            self.trials.clear();
        }
        findings.append(&mut expansion.findings);
        self.arguments = std::mem::take(&mut expansion.arguments);
        self.use_names = std::mem::take(&mut expansion.names);
        self.uses = std::mem::take(&mut expansion.uses);
        self.unknown_uses = std::mem::take(&mut expansion.unknown);
        self.layers = expansion.layers;
        drop(templates);
        self.records = records;
        self.findings.extend(findings);
        plain
    }
}

/// Removes all rungs, and the own tags of uses.
fn forget_rungs(ladder: &mut Ladder) {
    for block in &mut ladder.blocks {
        block.rungs.clear();
        block.stages.iter_mut().for_each(|stage| stage.rungs.clear());
    }
    ladder.tags.retain(|tag| !Layers::is_layered(tag.name.span));
}
