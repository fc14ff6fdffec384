//! Edge histories: which of the new program's goes on from which of the old one's.
//!
//! Asked for in this order, each history once: same rung and text in the same element; the same
//! in another Stage of the block; the same rung of the block, whatever its contacts say now, in
//! their order; the same text in the block. What is left begins OFF.

use std::collections::{HashMap, VecDeque};

use super::{Names, Plan};
use crate::engine::Stretch;
use crate::lower::identity::{History, Identity};

/// By what two histories are the same.
type Key = (String, Option<String>, Option<String>, Option<String>);

pub(super) fn histories(plan: &mut Plan, names: &Names<'_>) {
    let mut old: Vec<Option<&History>> = names.old.histories.iter().map(Some).collect();
    let mut new: Vec<Option<&History>> = names.new.histories.iter().map(Some).collect();
    for key in [exactly, elsewhere, by_rung, by_text] {
        let mut waiting: HashMap<Key, VecDeque<usize>> = HashMap::new();
        for (at, history) in old.iter().enumerate() {
            if let Some(key) = history.and_then(|history| key(names.old, history)) {
                waiting.entry(key).or_default().push_back(at);
            }
        }
        for place in &mut new {
            let Some(history) = *place else { continue };
            let found = key(names.new, history).and_then(|key| waiting.get_mut(&key)?.pop_front());
            let Some(before) = found.and_then(|at| old[at].take()) else { continue };
            // A block of another kind is another block.
            if names.block(before.standing.block) != Some(history.standing.block) {
                continue;
            }
            let (from, to) = (before.cell.0, history.cell.0);
            plan.transfer.bits.push(Stretch { from, to, count: 1 });
            plan.moves(names, before.standing, history.standing);
            *place = None;
        }
    }
}

fn block(identity: &Identity, history: &History) -> String {
    identity.block(history.standing.block).name.clone()
}

fn exactly(identity: &Identity, history: &History) -> Option<Key> {
    let stage = history.standing.stage.map(|id| identity.stage(id));
    Some((block(identity, history), stage, history.rung.clone(), Some(history.text.clone())))
}

fn elsewhere(identity: &Identity, history: &History) -> Option<Key> {
    Some((block(identity, history), None, history.rung.clone(), Some(history.text.clone())))
}

fn by_rung(identity: &Identity, history: &History) -> Option<Key> {
    let rung = history.rung.clone()?;
    Some((block(identity, history), None, Some(rung), None))
}

fn by_text(identity: &Identity, history: &History) -> Option<Key> {
    Some((block(identity, history), None, None, Some(history.text.clone())))
}
