//! Edge histories: pairs each history of the new program with a history of the old program. The
//! new one takes over the value.
//!
//! Each history is paired once, by the first of these rules that finds a partner:
//!
//! 1. the same rung, text and element; unedited rungs first;
//! 2. the same rung and text in a different Stage of the block;
//! 3. the same whole rung under a different name;
//! 4. the same kind of contact or instruction in the rung of the same name, in order;
//! 5. the same text in the block.
//!
//! A history without a partner takes the value of an old history with the same text in the same
//! element, even if that history has a partner: a bit that was already ON must not count as a
//! rising edge. If there is no such history, it begins OFF.
//!
//! The aim: the swap causes no edge that did not happen. Therefore a `fall` takes over only the
//! history of its own bit. An ND without a partner begins OFF, because its rung differs from the
//! old one.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

use super::plan::{ElementPairs, ReloadPlan};
use rungd_engine::isa::{BlockId, ElementId};
pub use rungd_engine::{KeptCells, WordCell};
use rungd_language::lower::identity::{History, Identity};

/// What two histories must have in common to be paired.
#[derive(Default, PartialEq, Eq, Hash)]
struct HistoryKey {
    block: String,
    stage: Option<String>,
    rung: Option<String>,
    text: Option<String>,
    whole: Option<Arc<str>>,
}

pub(super) fn histories(plan: &mut ReloadPlan, names: &ElementPairs<'_>) {
    let mut old: Vec<Option<&History>> = names.old.histories.iter().map(Some).collect();
    let mut new: Vec<Option<&History>> = names.new.histories.iter().map(Some).collect();
    let keys = [unedited, unedited_elsewhere, exactly, elsewhere, by_whole_rung, by_rung, by_text];
    for key in keys {
        let mut waiting: HashMap<HistoryKey, VecDeque<usize>> = HashMap::new();
        for (at, history) in old.iter().enumerate() {
            if let Some(key) = history.and_then(|history| key(names.old, history)) {
                waiting.entry(key).or_default().push_back(at);
            }
        }
        for place in &mut new {
            let Some(history) = *place else { continue };
            let found = key(names.new, history).and_then(|key| waiting.get_mut(&key)?.pop_front());
            let Some(before) = found.and_then(|at| old[at].take()) else { continue };
            // A block of the same name but of a different kind is not the same block.
            if names.block(before.element.block) != Some(history.element.block) {
                continue;
            }
            keep_history(plan, before, history);
            plan.record_move(names, before.element, history.element);
            *place = None;
        }
    }
    share(plan, names, new.into_iter().flatten());
    missed_times(plan, names);
}

/// Pairs the instructions that may end a subroutine in their order: the timers behind keep the time
/// that they have missed.
fn missed_times(plan: &mut ReloadPlan, names: &ElementPairs<'_>) {
    let mut waiting: HashMap<BlockId, VecDeque<WordCell>> = HashMap::new();
    for before in &names.old.missed_times {
        if let Some(block) = names.block(before.block) {
            waiting.entry(block).or_default().push_back(before.cell);
        }
    }
    for now in &names.new.missed_times {
        if let Some(from) = waiting.get_mut(&now.block).and_then(VecDeque::pop_front) {
            plan.transfer.words.push(KeptCells { from: from.0, to: now.cell.0, count: 1 });
        }
    }
}

/// Histories without a partner share the value of an old history with the same text and element.
fn share<'a>(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    new: impl Iterator<Item = &'a History>,
) {
    let mut known: HashMap<(ElementId, &str), &History> = HashMap::new();
    for history in &names.old.histories {
        if let Some(element) = names.element(history.element) {
            known.entry((element, &history.text)).or_insert(history);
        }
    }
    for history in new.filter(|history| kind(history) != "ND") {
        if let Some(before) = known.get(&(history.element, history.text.as_str())) {
            keep_history(plan, before, history);
        }
    }
}

fn keep_history(plan: &mut ReloadPlan, before: &History, now: &History) {
    plan.transfer.bits.push(KeptCells { from: before.cell.0, to: now.cell.0, count: 1 });
}

/// `rise`, `fall`, or the instruction.
fn kind(history: &History) -> &str {
    history.text.split(['(', ' ']).next().unwrap_or_default()
}

fn block(identity: &Identity, id: BlockId) -> String {
    identity.names.block(id).name.clone()
}

fn by_text(identity: &Identity, history: &History) -> Option<HistoryKey> {
    let (block, text) = (block(identity, history.element.block), Some(history.text.clone()));
    Some(HistoryKey { block, text, ..HistoryKey::default() })
}

fn elsewhere(identity: &Identity, history: &History) -> Option<HistoryKey> {
    Some(HistoryKey { rung: history.rung.clone(), ..by_text(identity, history)? })
}

fn exactly(identity: &Identity, history: &History) -> Option<HistoryKey> {
    let stage = history.element.stage.map(|id| identity.names.stage(id).to_owned());
    Some(HistoryKey { stage, ..elsewhere(identity, history)? })
}

fn unedited(identity: &Identity, history: &History) -> Option<HistoryKey> {
    Some(HistoryKey { whole: Some(Arc::clone(&history.whole)), ..exactly(identity, history)? })
}

fn unedited_elsewhere(identity: &Identity, history: &History) -> Option<HistoryKey> {
    Some(HistoryKey { whole: Some(Arc::clone(&history.whole)), ..elsewhere(identity, history)? })
}

fn by_whole_rung(identity: &Identity, history: &History) -> Option<HistoryKey> {
    Some(HistoryKey { whole: Some(Arc::clone(&history.whole)), ..by_text(identity, history)? })
}

/// Not for `fall`: with the history of a different bit that was ON, it would detect a falling edge
/// that did not happen.
fn by_rung(identity: &Identity, history: &History) -> Option<HistoryKey> {
    let rung = Some(history.rung.clone()?);
    let text = Some(kind(history)).filter(|kind| *kind != "fall")?.to_owned();
    let block = block(identity, history.element.block);
    Some(HistoryKey { block, rung, text: Some(text), ..HistoryKey::default() })
}
