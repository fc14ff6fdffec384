//! Compares two programs: finds the state of the old program that the new one keeps.
//!
//! Called before a swap, never by the scan thread. The result for the engine is a [`Transfer`]
//! (numbers): the engine uses it to copy state between two scans. The result for people is
//! [`ReloadPlan::report`] (words). Reads no file, uses no thread, and changes neither program.
//!
//! Behaviour: `docs/semantics.md`, section 4, *Reload*.

mod elements;
mod histories;
mod memory;
mod moves;
mod places;
mod plan;
mod report;
mod rung_texts;
mod rungs;
mod tags;
mod wired;

use moves::{MovedElements, OldAndNew};
use plan::ElementPairs;
pub use plan::{LoweredProgram, ReloadPlan};
pub use report::OldMemory;
pub use report::WARNING;
pub use rung_texts::{FileTexts, RungDifference};
use rungd_engine::Transfer;
pub use rungs::rung_differences;
pub use wired::misfit;

/// The reason why files with different devices are not reloaded.
pub const OTHER_DEVICES: &str = "its devices, or their order, differ from the running ones: \
                                        restart rungd; nothing is reloaded until then";
/// The reason why files with different memory sizes are not reloaded.
pub const OTHER_SIZES: &str = "the sizes in `[memory]` differ from the running program's: \
                                      restart rungd; nothing is reloaded until then";

impl ReloadPlan {
    /// Compares `old` and `new`.
    pub fn new(old: LoweredProgram<'_>, new: LoweredProgram<'_>) -> ReloadPlan {
        let (before, now) = (&old.symbols.identity, &new.symbols.identity);
        let moves = MovedElements::of(before, now);
        let renamed = moves.renamed(before);
        let names = ElementPairs::new(renamed.as_ref().unwrap_or(before), now, moves);
        let transfer = Transfer::memory(&old.symbols.layout, &new.symbols.layout);
        let mut plan = ReloadPlan { transfer, ..ReloadPlan::default() };
        let layouts = OldAndNew { old: &old.symbols.layout, new: &new.symbols.layout };
        names.moves.enter(&mut plan.transfer, layouts, now);
        rungs::rungs(&mut plan, &names, old, new);
        tags::report_constants(&mut plan, &names);
        let disabled = elements::disabled(&names, old, new);
        elements::blocks(&mut plan, &names, OldAndNew { old, new }, &disabled);
        let kept = memory::structures(&mut plan, &names, old, new);
        memory::initial(&mut plan, &names, old, new);
        tags::report_moved(&mut plan, &names, old);
        tags::report_renamed(&mut plan, &names, old);
        tags::report_unnamed(&mut plan, &names, old);
        places::report_places(&mut plan, &names, old);
        tags::report_limits(&mut plan, &names, old, new);
        tags::report_initial(&mut plan, &names, old, new);
        elements::unwritten(&mut plan, &names, old);
        histories::histories(&mut plan, &names);
        elements::terminations(&mut plan, &names, OldAndNew { old, new }, &kept);
        plan
    }
}
