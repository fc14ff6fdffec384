//! Finds the rungs that were edited, added and removed. Only the report uses them.
//!
//! A rung is unchanged if the new program has a rung with the same text (in addresses) and the same
//! name in the same element. The remaining rungs are paired as edited ones: first those with the
//! same text in the same block, then those with the same name in the same block, then those of the
//! same element whose first instruction has the same operand, then those of the same element.
//! Unpaired rungs of the old program were removed; those of the new one were added.

use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::Arc;

use super::moves::MovedElements;
use super::plan::{ElementPairs, LoweredProgram, OldState, ReloadPlan};
use super::rung_texts::RungDifference;
use rungd_engine::isa::{BlockId, ElementId};
use rungd_language::lower::identity::RungText;

/// The maximum number of rungs whose texts a report has.
const TOLD_MAX: usize = 40;

/// What two rungs must have in common to be paired.
#[derive(PartialEq, Eq, Hash)]
enum RungKey {
    Same(ElementId, Option<String>, Arc<str>),
    Text(BlockId, Arc<str>),
    Name(BlockId, String),
    Acts(ElementId, String),
    Element(ElementId),
}

impl RungKey {
    fn same(rung: &RungText) -> RungKey {
        RungKey::Same(rung.element, rung.name.clone(), Arc::clone(&rung.whole))
    }
}

/// The rungs that differ between two programs: edited, new, gone. `has_names`: a rung keeps its
/// name when others are inserted, so that a name tells which rung it is.
pub fn rung_differences(
    old: LoweredProgram<'_>,
    new: LoweredProgram<'_>,
    has_names: bool,
) -> Vec<RungDifference> {
    let (before, now) = (&old.symbols.identity, &new.symbols.identity);
    let moves = MovedElements::of(before, now);
    let renamed = moves.renamed(before);
    let names = ElementPairs::new(renamed.as_ref().unwrap_or(before), now, moves);
    let paired = paired(&names, has_names);
    let edited = paired.edited.into_iter().map(|(was, is)| RungDifference::Edited(was, is));
    let gone = paired.before.into_iter().chain(paired.lost).map(RungDifference::Gone);
    edited.chain(paired.now.into_iter().map(RungDifference::New)).chain(gone).collect()
}

/// The rungs of two programs that are not the same.
struct PairedRungs {
    edited: Vec<(RungText, RungText)>,
    now: Vec<RungText>,
    before: Vec<RungText>,
    /// The old rungs whose element is gone.
    lost: Vec<RungText>,
    in_order: bool,
}

fn paired(names: &ElementPairs<'_>, has_names: bool) -> PairedRungs {
    let (mut before, mut lost) = (Vec::new(), Vec::new());
    for rung in &names.old.rungs {
        match names.element(rung.element) {
            Some(element) => before.push(RungText { element, ..rung.clone() }),
            None => lost.push(rung.clone()),
        }
    }
    let mut now = names.new.rungs.clone();
    let keys = |rungs: &[RungText]| rungs.iter().map(RungKey::same).collect::<Vec<_>>();
    let in_order = keys(&before) == keys(&now);
    pair(&mut before, &mut now, |rung| Some(RungKey::same(rung)));
    let mut edited = pair(&mut before, &mut now, |rung| {
        Some(RungKey::Text(rung.element.block, Arc::clone(&rung.whole)))
    });
    edited.extend(pair(&mut before, &mut now, |rung| {
        Some(RungKey::Name(rung.element.block, rung.name.clone().filter(|_| has_names)?))
    }));
    edited.extend(pair(&mut before, &mut now, |rung| {
        Some(RungKey::Acts(rung.element, rung.acts.clone()))
    }));
    edited.extend(pair(&mut before, &mut now, |rung| Some(RungKey::Element(rung.element))));
    PairedRungs { edited, now, before, lost, in_order }
}

pub(super) fn rungs(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
    new: LoweredProgram<'_>,
) {
    let PairedRungs { edited, now, before, lost, in_order } = paired(names, true);
    let (changed, added, gone) = (edited.len(), now.len(), before.len() + lost.len());
    if (changed, added, gone) != (0, 0, 0) {
        let s = if changed == 1 { "" } else { "s" };
        plan.add_line(format!("{changed} rung{s} edited, {added} new, {gone} gone"));
    } else if !in_order {
        plan.add_line("the order of the rungs has changed");
    }
    let edited = edited.into_iter().map(|(was, is)| RungDifference::Edited(was, is));
    let new_ones = now.into_iter().map(RungDifference::New);
    report_rungs(plan, edited.chain(new_ones).chain(before.into_iter().map(RungDifference::Gone)));
    order(plan, names, old, new);
}

/// Adds the differences of rungs, up to a maximum.
fn report_rungs(plan: &mut ReloadPlan, differences: impl Iterator<Item = RungDifference>) {
    let mut all: Vec<RungDifference> = differences.collect();
    let more = all.len().saturating_sub(TOLD_MAX);
    all.truncate(TOLD_MAX);
    all.into_iter().for_each(|rung| plan.add_line_with_state("", OldState::Rung(Box::new(rung))));
    if more > 0 {
        plan.add_line_with_state("", OldState::MoreRungs(more));
    }
}

/// Removes the rungs that have the same key on both sides, and returns them in pairs.
fn pair(
    before: &mut Vec<RungText>,
    now: &mut Vec<RungText>,
    key: impl Fn(&RungText) -> Option<RungKey>,
) -> Vec<(RungText, RungText)> {
    let mut waiting: HashMap<RungKey, VecDeque<usize>> = HashMap::new();
    for (at, rung) in now.iter().enumerate() {
        if let Some(key) = key(rung) {
            waiting.entry(key).or_default().push_back(at);
        }
    }
    let mut rest: Vec<Option<RungText>> = std::mem::take(now).into_iter().map(Some).collect();
    let mut pairs = Vec::new();
    for rung in std::mem::take(before) {
        let found = key(&rung).and_then(|key| waiting.get_mut(&key)?.pop_front());
        match found.and_then(|at| rest[at].take()) {
            Some(new) => pairs.push((rung, new)),
            None => before.push(rung),
        }
    }
    now.extend(rest.into_iter().flatten());
    pairs
}

/// Reports a changed scan order of the blocks that both programs have.
fn order(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
    new: LoweredProgram<'_>,
) {
    let before: Vec<_> = old.program.order.iter().filter_map(|id| names.block(*id)).collect();
    let both: HashSet<_> = before.iter().copied().collect();
    let now = new.program.order.iter().copied();
    let now: Vec<_> = now.filter(|id| both.contains(id)).collect();
    if before != now {
        plan.add_line("the scan order of the blocks has changed");
    }
}
