//! Edge histories: which of the new program's goes on from which of the old one's.
//!
//! Asked for in this order, each history once: same rung, text and element, those of rungs that
//! nobody edited first; the same in another Stage of the block; a whole rung that is there under
//! another name; the same kind of contact or instruction in the rung of this name, in their order;
//! the same text in the block. What is left takes the value of one of the same text in its
//! element, if there was one: what has seen a bit ON is not to see it rise. Else it begins OFF.
//!
//! The idea: no edge is seen that did not happen. So a `fall` goes on for its own bit alone, and
//! ND, whose rung is not the other's, begins OFF rather than with another one's value.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

use super::{Names, Plan};
use crate::engine::Stretch;
use crate::isa::BlockId;
use crate::lower::identity::{History, Identity, Standing};

/// By what two histories are the same.
#[derive(Default, PartialEq, Eq, Hash)]
struct Key {
    block: String,
    stage: Option<String>,
    rung: Option<String>,
    text: Option<String>,
    whole: Option<Arc<str>>,
}

pub(super) fn histories(plan: &mut Plan, names: &Names<'_>) {
    let mut old: Vec<Option<&History>> = names.old.histories.iter().map(Some).collect();
    let mut new: Vec<Option<&History>> = names.new.histories.iter().map(Some).collect();
    let keys = [unedited, unedited_elsewhere, exactly, elsewhere, by_whole_rung, by_rung, by_text];
    for key in keys {
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
            goes_on(plan, before, history);
            plan.moves(names, before.standing, history.standing);
            *place = None;
        }
    }
    share(plan, names, new.into_iter().flatten());
}

/// What is new, and whose text its element had already.
fn share<'a>(plan: &mut Plan, names: &Names<'_>, new: impl Iterator<Item = &'a History>) {
    let mut known: HashMap<(Standing, &str), &History> = HashMap::new();
    for history in &names.old.histories {
        if let Some(standing) = names.standing(history.standing) {
            known.entry((standing, &history.text)).or_insert(history);
        }
    }
    for history in new.filter(|history| kind(history) != "ND") {
        if let Some(before) = known.get(&(history.standing, history.text.as_str())) {
            goes_on(plan, before, history);
        }
    }
}

fn goes_on(plan: &mut Plan, before: &History, now: &History) {
    plan.transfer.bits.push(Stretch { from: before.cell.0, to: now.cell.0, count: 1 });
}

/// `rise`, `fall`, or the instruction.
fn kind(history: &History) -> &str {
    history.text.split(['(', ' ']).next().unwrap_or_default()
}

fn block(identity: &Identity, id: BlockId) -> String {
    identity.block(id).name.clone()
}

fn by_text(identity: &Identity, history: &History) -> Option<Key> {
    let (block, text) = (block(identity, history.standing.block), Some(history.text.clone()));
    Some(Key { block, text, ..Key::default() })
}

fn elsewhere(identity: &Identity, history: &History) -> Option<Key> {
    Some(Key { rung: history.rung.clone(), ..by_text(identity, history)? })
}

fn exactly(identity: &Identity, history: &History) -> Option<Key> {
    let stage = history.standing.stage.map(|id| identity.stage(id));
    Some(Key { stage, ..elsewhere(identity, history)? })
}

fn unedited(identity: &Identity, history: &History) -> Option<Key> {
    Some(Key { whole: Some(Arc::clone(&history.whole)), ..exactly(identity, history)? })
}

fn unedited_elsewhere(identity: &Identity, history: &History) -> Option<Key> {
    Some(Key { whole: Some(Arc::clone(&history.whole)), ..elsewhere(identity, history)? })
}

fn by_whole_rung(identity: &Identity, history: &History) -> Option<Key> {
    Some(Key { whole: Some(Arc::clone(&history.whole)), ..by_text(identity, history)? })
}

/// A `fall` that has seen another bit ON would see this one fall.
fn by_rung(identity: &Identity, history: &History) -> Option<Key> {
    let rung = Some(history.rung.clone()?);
    let text = Some(kind(history)).filter(|kind| *kind != "fall")?.to_owned();
    let block = block(identity, history.standing.block);
    Some(Key { block, rung, text: Some(text), ..Key::default() })
}
