//! The trial of a template that nothing uses: it is expanded with arguments that fit, and checked
//! like any other template, outside the program.

use crate::resolve::Resolver;
use crate::resolve::program::Program;
use crate::source::ladder::{Ladder, WrittenBlock, WrittenStage};
use crate::source::span::FileId;

impl Resolver<'_> {
    /// The program of the unused templates, with the names of the ladders but without their rungs.
    /// Adds the findings about these templates.
    pub(in crate::resolve) fn trial_program(
        &mut self,
        ladders: &[(FileId, Ladder)],
    ) -> Option<Program> {
        let trials = std::mem::take(&mut self.trials);
        if trials.is_empty() {
            return None;
        }
        let mut resolver = Resolver::new(self.files, self.options);
        resolver.layers = self.layers.clone();
        resolver.uses.clone_from(&self.uses);
        resolver.unknown_uses.clone_from(&self.unknown_uses);
        let mut ladders: Vec<(FileId, Ladder)> =
            ladders.iter().map(|(file, ladder)| (*file, without_rungs(ladder))).collect();
        let (_, last) = ladders.last_mut()?;
        for trial in trials {
            last.blocks.push(trial.block);
            last.tags.extend(trial.tags);
            resolver.arguments.extend(trial.arguments);
        }
        resolver.records.clone_from(&self.records);
        resolver.expand_records(&mut ladders);
        let program = resolver.plain_program(&ladders);
        let of_trials =
            |finding: &crate::source::finding::Finding| self.layers.is_trial(finding.span);
        self.findings.extend(resolver.findings.into_iter().filter(of_trials));
        Some(program)
    }
}

/// The ladder without its rungs, for its names only.
fn without_rungs(ladder: &Ladder) -> Ladder {
    let stage = |stage: &WrittenStage| WrittenStage {
        span: stage.span,
        name: stage.name.clone(),
        doc: None,
        rungs: Vec::new(),
    };
    let block = |block: &WrittenBlock| WrittenBlock {
        form: block.form,
        span: block.span,
        name: block.name.clone(),
        doc: None,
        autostart: None,
        body: None,
        rungs: Vec::new(),
        stages: block.stages.iter().map(stage).collect(),
    };
    Ladder {
        name: None,
        doc: None,
        allow: Vec::new(),
        devices: ladder.devices.clone(),
        order: None,
        records: Vec::new(),
        tags: ladder.tags.clone(),
        blocks: ladder.blocks.iter().map(block).collect(),
        templates: Vec::new(),
        lost: None,
    }
}
