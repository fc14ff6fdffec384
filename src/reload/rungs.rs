//! Counts the rungs that were edited, added and removed. Only the report uses the counts.
//!
//! A rung is unchanged if the new program has a rung with the same text (in addresses) and the same
//! name in the same element. The remaining rungs are paired as edited ones: first those with the
//! same text in the same block, then those with the same name in the same block, then those in the
//! same element. Unpaired rungs of the old program were removed; those of the new one were added.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::plan::{Pairs, ReloadPlan, Side};
use crate::isa::{BlockId, ElementId};
use crate::lower::identity::RungText;

/// What two rungs must have in common to be paired.
#[derive(PartialEq, Eq, Hash)]
enum RungKey {
    Same(ElementId, Option<String>, Arc<str>),
    Text(BlockId, Arc<str>),
    Name(BlockId, String),
    Element(ElementId),
}

pub(super) fn rungs(plan: &mut ReloadPlan, names: &Pairs<'_>, old: Side<'_>, new: Side<'_>) {
    let new_place = |rung: &RungText| {
        names.element(rung.element).map(|element| RungText { element, ..rung.clone() })
    };
    let here: Vec<_> = names.old.rungs.iter().map(new_place).collect();
    let lost = here.iter().filter(|rung| rung.is_none()).count();
    let mut before: Vec<RungText> = here.into_iter().flatten().collect();
    let mut now = names.new.rungs.clone();
    let in_order = before == now;
    let same = |rung: &RungText| {
        Some(RungKey::Same(rung.element, rung.name.clone(), Arc::clone(&rung.whole)))
    };
    pair(&mut before, &mut now, same);
    let mut edited = 0;
    edited += pair(&mut before, &mut now, |rung| {
        Some(RungKey::Text(rung.element.block, Arc::clone(&rung.whole)))
    });
    edited += pair(&mut before, &mut now, |rung| {
        Some(RungKey::Name(rung.element.block, rung.name.clone()?))
    });
    edited += pair(&mut before, &mut now, |rung| Some(RungKey::Element(rung.element)));
    let (added, gone) = (now.len(), before.len() + lost);
    if (edited, added, gone) != (0, 0, 0) {
        let s = if edited == 1 { "" } else { "s" };
        plan.say(format!("{edited} rung{s} edited, {added} new, {gone} gone"));
    } else if !in_order {
        plan.say("the order of the rungs has changed");
    }
    order(plan, names, old, new);
}

/// Removes the rungs that have the same key on both sides, and returns the number of pairs.
fn pair(
    before: &mut Vec<RungText>,
    now: &mut Vec<RungText>,
    key: impl Fn(&RungText) -> Option<RungKey>,
) -> usize {
    let mut waiting: HashMap<RungKey, usize> = HashMap::new();
    now.iter().filter_map(&key).for_each(|key| *waiting.entry(key).or_default() += 1);
    let mut found: HashMap<RungKey, usize> = HashMap::new();
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

/// Reports a changed scan order of the blocks that both programs have.
fn order(plan: &mut ReloadPlan, names: &Pairs<'_>, old: Side<'_>, new: Side<'_>) {
    let before: Vec<_> = old.program.order.iter().filter_map(|id| names.block(*id)).collect();
    let both: HashSet<_> = before.iter().copied().collect();
    let now = new.program.order.iter().copied();
    let now: Vec<_> = now.filter(|id| both.contains(id)).collect();
    if before != now {
        plan.say("the scan order of the blocks has changed");
    }
}
