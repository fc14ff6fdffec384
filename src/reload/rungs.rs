//! How many rungs were edited, are new, are gone: for the report alone.
//!
//! A rung is the same one while it stands in the same element with the same name and does the same
//! thing, by its text in addresses. Of those that are left, one is the edited other by its text
//! elsewhere in the block, else by its name in the block, else by its element.

use std::collections::HashMap;
use std::sync::Arc;

use super::{Names, Plan, Side};
use crate::isa::BlockId;
use crate::lower::identity::{RungText, Standing};

/// By what two rungs are held for each other.
#[derive(PartialEq, Eq, Hash)]
enum Key {
    Same(Standing, Option<String>, Arc<str>),
    Text(BlockId, Arc<str>),
    Name(BlockId, String),
    Element(Standing),
}

pub(super) fn rungs(plan: &mut Plan, names: &Names<'_>, old: Side<'_>, new: Side<'_>) {
    let new_place = |rung: &RungText| {
        names.standing(rung.standing).map(|standing| RungText { standing, ..rung.clone() })
    };
    let here: Vec<_> = names.old.rungs.iter().map(new_place).collect();
    let lost = here.iter().filter(|rung| rung.is_none()).count();
    let mut before: Vec<RungText> = here.into_iter().flatten().collect();
    let mut now = names.new.rungs.clone();
    let in_order = before == now;
    let same = |rung: &RungText| {
        Some(Key::Same(rung.standing, rung.name.clone(), Arc::clone(&rung.whole)))
    };
    pair(&mut before, &mut now, same);
    let mut edited = 0;
    edited += pair(&mut before, &mut now, |rung| {
        Some(Key::Text(rung.standing.block, Arc::clone(&rung.whole)))
    });
    edited += pair(&mut before, &mut now, |rung| {
        Some(Key::Name(rung.standing.block, rung.name.clone()?))
    });
    edited += pair(&mut before, &mut now, |rung| Some(Key::Element(rung.standing)));
    let (added, gone) = (now.len(), before.len() + lost);
    if (edited, added, gone) != (0, 0, 0) {
        let s = if edited == 1 { "" } else { "s" };
        plan.say(format!("{edited} rung{s} edited, {added} new, {gone} gone"));
    } else if !in_order {
        plan.say("the rungs are in another order");
    }
    order(plan, names, old, new);
}

/// Takes away those that are found on both sides; how many they were.
fn pair(
    before: &mut Vec<RungText>,
    now: &mut Vec<RungText>,
    key: impl Fn(&RungText) -> Option<Key>,
) -> usize {
    let mut waiting: HashMap<Key, usize> = HashMap::new();
    now.iter().filter_map(&key).for_each(|key| *waiting.entry(key).or_default() += 1);
    let mut found: HashMap<Key, usize> = HashMap::new();
    let count = before.len();
    before.retain(|rung| {
        let Some(key) = key(rung) else { return true };
        let Some(left) = waiting.get_mut(&key).filter(|left| **left > 0) else { return true };
        *left -= 1;
        *found.entry(key).or_default() += 1;
        false
    });
    now.retain(|rung| {
        let Some(left) = key(rung).and_then(|key| found.get_mut(&key)) else { return true };
        let is_left = *left == 0;
        *left = left.saturating_sub(1);
        is_left
    });
    count - before.len()
}

/// In which the blocks that are in both are scanned.
fn order(plan: &mut Plan, names: &Names<'_>, old: Side<'_>, new: Side<'_>) {
    let before: Vec<_> = old.program.order.iter().filter_map(|id| names.block(*id)).collect();
    let now = new.program.order.iter().copied();
    let now: Vec<_> = now.filter(|id| before.contains(id)).collect();
    if before != now {
        plan.say("the blocks are scanned in another order");
    }
}
