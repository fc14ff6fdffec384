//! Compares tags with a `type`: reports those that start again or are gone, and those that have an
//! address in one program. Called by `ReloadPlan::new`; [`moves`](super::moves) has the rules.

use std::cmp::Ordering;

use super::moves::addresses;
use super::plan::{ElementPairs, LoweredProgram, OldState, ReloadPlan};
use rungd_engine::Cell;
use rungd_engine::isa::Address;
use rungd_language::resolve::places::TagPlace;

/// The line about a tag whose number of elements has changed.
fn resized(was: &TagPlace, now: &TagPlace) -> String {
    let name = &was.name;
    let text = match (was.is_array, now.is_array) {
        (true, false) => format!("tag {name} is no longer an array"),
        (false, true) => format!("tag {name} is an array of {} elements now", now.count),
        (true, true) | (false, false) => {
            format!("tag {name} has {} elements instead of {}", now.count, was.count)
        }
    };
    let between = |place: &TagPlace, from: u32| match place.count - from {
        1 => place.name_of(from),
        _ => format!("{} to {}", place.name_of(from), place.name_of(place.count - 1)),
    };
    match was.count.cmp(&now.count) {
        Ordering::Less => format!("{text}; new: {}", between(now, was.count)),
        Ordering::Greater => {
            format!("{text}; removed, with their values: {}", between(was, now.count))
        }
        Ordering::Equal => text,
    }
}

/// Reports the tags with a `type` that start again or are gone, those that have an address in one
/// program, and forces on addresses that are now the place of a tag.
pub(super) fn report_places(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
) {
    let layout = &old.symbols.layout;
    let cells = |addresses: &mut dyn Iterator<Item = Address>| -> Vec<Cell> {
        addresses.flat_map(Address::operands).filter_map(|part| layout.cell(part)).collect()
    };
    for place in names.old.names.places.by_name() {
        let (name, was) = (&place.name, place.type_name());
        let now = names.new.tags.get(&place.name_of(0));
        let text = match (names.new.names.places.named(name), now) {
            (Some(now), _) if now.space != place.space => {
                format!("tag {name} changed from `{was}` to `{}`: it starts again", now.type_name())
            }
            (Some(now), _) if now.is_array != place.is_array || now.count != place.count => {
                resized(place, now)
            }
            (Some(_), _) => continue,
            (None, Some(at)) if names.moves.after(place.address(0)) == Some(*at) => {
                format!("tag {name} has the address {at} now, which takes over its value")
            }
            (None, Some(at)) => {
                format!("tag {name} has the address {at} now, and its value is gone")
            }
            (None, None) => format!("tag {name} is gone, and its value with it"),
        };
        let lost = place.addresses().filter(|element| names.moves.after(*element).is_none());
        let force = "its force ends".to_owned();
        plan.add_line_with_state(text, OldState::Named { cells: cells(&mut { lost }), force });
    }
    for place in names.new.names.places.by_name() {
        if names.old.names.places.named(&place.name).is_none()
            && let Some((_, at)) = addresses(names.old, place).next()
        {
            let (name, kind) = (&place.name, place.type_name());
            let text = format!("tag {name} has the type `{kind}` instead of the address {at}");
            let stays = names.moves.after(at) == Some(at);
            let taken: Vec<Cell> = if stays { cells(&mut [at].into_iter()) } else { Vec::new() };
            let force = format!("the force stays on {at}");
            plan.add_line_with_state(text, OldState::Named { cells: taken, force });
        }
        for element in place.addresses() {
            if names.old.names.places.at(element).is_none() && names.moves.after(element).is_none()
            {
                let force = format!("{element} is not named any more: its force ends");
                let taken = cells(&mut [element].into_iter());
                plan.add_line_with_state(String::new(), OldState::Named { cells: taken, force });
            }
        }
    }
}
