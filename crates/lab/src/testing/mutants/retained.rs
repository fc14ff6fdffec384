//! The mutants that leave out an entry of `[retain]`: a tag, a range, or a Program with its Stages.
//!
//! Called by `mutants`. An entry with `*` is left out as a whole.

use std::sync::Arc;

use rungd_config::controller::Controller;
use rungd_language::resolve::program::Program;
use rungd_language::source::span::{SourceFile, Span};

/// An entry that can be left out.
pub(super) struct RetainedEntry {
    /// Its place in the list.
    pub span: Span,
    /// The change in one line.
    pub what: String,
}

/// All entries, in file order.
pub(super) fn retained(controller: &Controller, files: &[SourceFile]) -> Vec<RetainedEntry> {
    let text = |span: Span| {
        let file = files.get(span.file.0 as usize)?;
        let text = file.text.get(span.start as usize..span.end as usize)?;
        Some(text.trim_matches(['"', '\'']))
    };
    let data = controller.retain.iter().map(|range| (range.span, false));
    let stages = controller.retained_stages.iter().map(|kept| (kept.span, true));
    let mut entries: Vec<(Span, bool)> = data.chain(stages).collect();
    entries.sort_unstable();
    entries.dedup();
    let entry = |(span, of_stages): (Span, bool)| {
        let text = text(span)?;
        let what = match of_stages {
            true => format!("the Stages of `{text}` are not retained"),
            false => format!("`{text}` is not retained"),
        };
        Some(RetainedEntry { span, what })
    };
    entries.into_iter().filter_map(entry).collect()
}

/// The settings without the entry at a place.
pub(super) fn settings_without(entry: Span, controller: &Controller) -> Arc<Controller> {
    let mut settings = controller.clone();
    settings.retain.retain(|range| range.span != entry);
    settings.retained_stages.retain(|kept| kept.span != entry);
    Arc::new(settings)
}

/// Ends the retention of the Stages that an entry names.
pub(super) fn forget_stages(entry: Span, controller: &Controller, program: &mut Program) {
    let named = controller.retained_stages.iter().filter(|kept| kept.span == entry);
    named.for_each(|kept| program.blocks[kept.value.0 as usize].retains_stages = false);
}
