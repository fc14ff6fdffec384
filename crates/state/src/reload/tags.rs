//! Compares tags: reports changed addresses, names and limits. Called by `ReloadPlan::new`.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};

use super::memory::{NewValues, array_of};
use super::plan::{ElementPairs, LoweredProgram, MovedElement, OldState, ReloadPlan};
use rungd_engine::isa::{Address, Bit, BitSpace, Word};
use rungd_engine::{Cell, Layout};
use rungd_language::lower::identity::Identity;

/// An element of an array, with its addresses in both programs.
struct MovedAddress {
    from: Address,
    to: Address,
    element: MovedElement,
}

/// Whether the tag, or the array of an element, has a `type` in either program. `places` reports
/// these tags.
fn is_placed(names: &ElementPairs<'_>, tag: &str) -> bool {
    let array = array_of(tag);
    let whole = array.as_deref().unwrap_or(tag);
    names.old.names.places.named(whole).or(names.new.names.places.named(whole)).is_some()
}

/// Reports constants with a changed value.
pub(super) fn report_constants(plan: &mut ReloadPlan, names: &ElementPairs<'_>) {
    for (name, value) in &names.new.constants {
        if let Some(before) = names.old.constants.get(name).filter(|before| *before != value) {
            plan.add_line(format!("constant {name} {before} → {value}"));
        }
    }
}

/// Reports tags with a changed address. The value stays at the old address.
pub(super) fn report_moved(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
) {
    let (layout, values) = (&old.symbols.layout, NewValues::of(plan));
    let mut arrays: BTreeMap<String, Vec<MovedAddress>> = BTreeMap::new();
    for (tag, to) in &names.new.tags {
        let Some(from) = names.old.tags.get(tag).filter(|from| *from != to) else { continue };
        if is_placed(names, tag) {
            continue;
        }
        let text = format!("tag {tag} moved from {from} to {to}");
        let cells = (layout.cell(held(*from)), layout.cell(held(*to)));
        let (Some(from_cell), Some(to_cell)) = cells else {
            plan.add_line(text);
            continue;
        };
        let begins = values.get(to_cell);
        if let Some(array) = array_of(tag) {
            let element = MovedElement { tag: tag.clone(), from: from_cell, to: to_cell, begins };
            let moved = MovedAddress { from: *from, to: *to, element };
            arrays.entry(array).or_default().push(moved);
            continue;
        }
        let left = names.new.names.tag(*from);
        let left = left.map_or_else(String::new, |other| format!(", which is {other} now"));
        plan.add_line_with_state(
            text,
            OldState::Moved {
                from: from_cell,
                to: to_cell,
                old: from.to_string(),
                new: to.to_string(),
                begins,
                input: is_input(*to),
                force: format!("the force stays on {from}{left}; {tag} ({to}) is not forced"),
            },
        );
    }
    arrays.into_iter().for_each(|(array, elements)| moved_array(plan, &array, elements));
}

/// One line for an array whose addresses have changed.
fn moved_array(plan: &mut ReloadPlan, array: &str, mut moved: Vec<MovedAddress>) {
    moved.sort_by_key(|moved| moved.from);
    let old = span(moved.iter().map(|moved| moved.from));
    let new = span(moved.iter().map(|moved| moved.to));
    let input = moved.iter().any(|moved| is_input(moved.to));
    let elements = moved.into_iter().map(|moved| moved.element).collect();
    let force = format!("forces stay on {old}; {array} ({new}) is not forced");
    let text = format!("array {array} moved from {old} to {new}");
    plan.add_line_with_state(text, OldState::MovedArray { elements, input, force });
}

/// The first and the last of some consecutive addresses, as text.
fn span(addresses: impl Iterator<Item = Address> + Clone) -> String {
    let ends = (addresses.clone().min(), addresses.max());
    match ends {
        (Some(first), Some(last)) if first != last => format!("{first}..{last}"),
        (Some(one), _) => one.to_string(),
        (None, _) => String::new(),
    }
}

fn is_input(at: Address) -> bool {
    matches!(at, Address::Bit(Bit::Space(BitSpace::X, _)))
}

/// Reports renamed tags: the address is the same.
pub(super) fn report_renamed(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
) {
    let layout = &old.symbols.layout;
    let lacks =
        |other: &Identity, tag: &String| !other.tags.contains_key(tag) && !is_placed(names, tag);
    let gone = names.old.tags.iter().filter(|(tag, _)| lacks(names.new, tag));
    let mut new: HashMap<&Address, VecDeque<&String>> = HashMap::new();
    for (tag, address) in names.new.tags.iter().filter(|(tag, _)| lacks(names.old, tag)) {
        new.entry(address).or_default().push_back(tag);
    }
    let mut arrays: BTreeMap<(String, String), Vec<Address>> = BTreeMap::new();
    for (tag, address) in gone {
        let Some(now) = new.get_mut(address).and_then(VecDeque::pop_front) else { continue };
        if let (Some(from), Some(to)) = (array_of(tag), array_of(now)) {
            arrays.entry((from, to)).or_default().push(*address);
            continue;
        }
        let text = format!("tag {tag} ({address}) was renamed to {now}");
        let cells = cells(layout, *address);
        plan.add_line_with_state(
            text,
            OldState::Named { cells, force: "the force stays on it".to_owned() },
        );
    }
    for ((from, to), addresses) in arrays {
        let text =
            format!("array {from} ({}) was renamed to {to}", span(addresses.iter().copied()));
        let cells = addresses.iter().flat_map(|address| cells(layout, *address)).collect();
        let force = "its forces stay".to_owned();
        plan.add_line_with_state(text, OldState::Named { cells, force });
    }
}

/// Reports removed tags whose address has no tag any more, if the address is forced.
pub(super) fn report_unnamed(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
) {
    for (tag, address) in &names.old.tags {
        let has_tag = || names.new.names.tag(*address).is_some();
        let is_kept = names.moves.after(*address) == Some(*address);
        if names.new.tags.contains_key(tag) || has_tag() || !is_kept {
            continue;
        }
        let cells = cells(&old.symbols.layout, *address);
        let force = format!("tag {tag} is gone; the force stays on {address}");
        plan.add_line_with_state(String::new(), OldState::Named { cells, force });
    }
}

/// All cells of an address; for a structure, those of its members.
fn cells(layout: &Layout, address: Address) -> Vec<Cell> {
    address.operands().into_iter().filter_map(|operand| layout.cell(operand)).collect()
}

/// Reports words with changed limits; with a warning, if the value is beyond the new limits.
pub(super) fn report_limits(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
    new: LoweredProgram<'_>,
) {
    let values = NewValues::of(plan);
    let mut told = BTreeSet::new();
    for address in &names.new.addresses_in_order() {
        let Address::Word(word) = *address else { continue };
        let (min, max) = new.symbols.limits(word);
        let Some(Address::Word(was)) = names.moves.before(*address) else { continue };
        let before = old.symbols.limits(was);
        if before == (min, max) || !names.old.addresses.contains(&Address::Word(was)) {
            continue;
        }
        let said = |side: LoweredProgram<'_>, word: Word, (min, max): (i32, i32)| {
            let text = |content| {
                side.symbols.layout.text(Cell::Word(side.symbols.layout.word(word)), content)
            };
            match (min, max) == word.range() {
                true => "none".to_owned(),
                false => format!("{} to {}", text(min), text(max)),
            }
        };
        let (before, now) = (said(old, was, before), said(new, word, (min, max)));
        // The elements of an array have the same limits.
        let name = match names.new.names.tag(*address).and_then(array_of) {
            Some(array) => array.to_owned(),
            None => names.new.names.say(*address),
        };
        let line = format!("limits of {name} {before} → {now}");
        if told.insert(line.clone()) {
            plan.add_line(line);
        }
        let cell = Cell::Word(old.symbols.layout.word(was));
        let begins = new.symbols.layout.cell(*address).and_then(|cell| values.get(cell));
        plan.add_line_with_state(
            names.new.names.say(*address),
            OldState::Limits { cell, begins, limits: min..=max },
        );
    }
}

/// Reports changed values of `initial`. They act at the next cold start; the present value stays.
pub(super) fn report_initial(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
    new: LoweredProgram<'_>,
) {
    let value = |side: LoweredProgram<'_>, address: Address, number: Option<&i32>| {
        let content = number.copied().unwrap_or(0);
        match (number, address) {
            (None, _) => "none".to_owned(),
            (Some(_), _) => side.symbols.names.say_value(address, content),
        }
    };
    for address in &names.new.addresses_in_order() {
        let Some(before) = names.moves.before(*address) else { continue };
        if !names.old.addresses.contains(&before) {
            continue;
        }
        let (was, is) = (names.old.initial.get(&before), names.new.initial.get(address));
        if was == is {
            continue;
        }
        let (was, is) = (value(old, before, was), value(new, *address, is));
        let said = names.new.names.say(*address);
        plan.add_line(format!("initial of {said} {was} → {is}, from the next cold start on"));
    }
}

/// The address that holds the value: for a structure, its `.Acc`.
fn held(address: Address) -> Address {
    match address {
        Address::Structure(structure) => Address::Word(Word::Acc(structure)),
        Address::Bit(_) | Address::Word(_) => address,
    }
}
