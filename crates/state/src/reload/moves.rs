//! Pairs the elements of tags with a `type` by the tag's name: finds the element of the old
//! program that an element of the new program continues.
//!
//! Called by `ReloadPlan::new` before everything else. An address of such a tag may mean different
//! elements in the two programs, so the other files look it up in [`MovedElements`]. All other
//! addresses mean the same in both programs.
//!
//! | old program | new program | what is kept |
//! |---|---|---|
//! | `type` | the same `type` | everything, at any address |
//! | `at` | `type` of that space | everything; only the value if the address is still in use |
//! | `type` | `at` of that space | everything, if the old program did not name the address |
//! | `type` | a different `type`, or no such tag | nothing: its forces end |

use std::collections::{HashMap, HashSet};

use rungd_engine::isa::{Address, Bit, BitSpace, Space, Structure, Word, WordBit};
pub use rungd_engine::{Cell, KeptCells, Layout, Renumbered, RenumberedCell, Transfer};
use rungd_language::lower::identity::Identity;
use rungd_language::resolve::places::TagPlace;

/// A part of the old program, and its counterpart in the new one; or both programs.
#[derive(Clone, Copy, Debug)]
pub(super) struct OldAndNew<T> {
    pub old: T,
    pub new: T,
}

/// Pairs of elements, by address; a structure stands for its members.
#[derive(Default)]
pub(super) struct MovedElements {
    after: HashMap<Address, Option<Address>>,
    before: HashMap<Address, Option<Address>>,
    /// The names in the texts of the old program, each with its name in the texts of the new one.
    texts: HashMap<String, String>,
}

impl MovedElements {
    pub fn of(old: &Identity, new: &Identity) -> MovedElements {
        let mut moves = MovedElements::default();
        let elements = |identity: &Identity| -> Vec<Address> {
            identity
                .names
                .places
                .by_name()
                .flat_map(|place| place.addresses().collect::<Vec<_>>())
                .collect()
        };
        for element in elements(old).into_iter().chain(elements(new)) {
            moves.after.insert(element, None);
            moves.before.insert(element, None);
        }
        let (old_named, new_named) = (named(old), named(new));
        for place in new.names.places.by_name() {
            if let Some(was) = old.names.places.named(&place.name) {
                moves.same_type(was, place);
                continue;
            }
            for (index, at) in addresses(old, place) {
                moves.before.insert(place.address(index), Some(at));
                if !new_named.contains(&at) {
                    moves.after.insert(at, Some(place.address(index)));
                    moves.texts.insert(at.to_string(), place.name_of(index));
                }
            }
        }
        for place in old.names.places.by_name() {
            if new.names.places.named(&place.name).is_some() {
                continue;
            }
            let free = addresses(new, place).filter(|(_, at)| !old_named.contains(at));
            for (index, at) in free {
                moves.pair(place.address(index), at);
                moves.texts.insert(place.name_of(index), at.to_string());
            }
        }
        moves
    }

    fn same_type(&mut self, was: &TagPlace, is: &TagPlace) {
        if (was.space, was.is_array) == (is.space, is.is_array) {
            was.addresses().zip(is.addresses()).for_each(|(from, to)| self.pair(from, to));
        }
    }

    fn pair(&mut self, from: Address, to: Address) {
        self.after.insert(from, Some(to));
        self.before.insert(to, Some(from));
    }

    /// The new address of an old one; `None` if the element is gone.
    pub fn after(&self, old: Address) -> Option<Address> {
        follow(&self.after, old)
    }

    /// The old address of a new one; `None` if the element is new.
    pub fn before(&self, new: Address) -> Option<Address> {
        follow(&self.before, new)
    }

    /// The old program's names with the texts of the new one; `None` if no text has changed.
    pub fn renamed(&self, old: &Identity) -> Option<Identity> {
        (!self.texts.is_empty()).then(|| old.with_texts(&|text| renamed(text, &self.texts)))
    }

    /// Adds the copies, the values of new elements, and the new numbers of cells.
    pub fn enter(&self, transfer: &mut Transfer, layouts: OldAndNew<&Layout>, new: &Identity) {
        let mut elements: Vec<_> = self.before.iter().collect();
        elements.sort_unstable();
        for (to, from) in elements {
            match from {
                Some(from) if from == to => {}
                Some(from) => copy(transfer, OldAndNew { old: *from, new: *to }, layouts),
                None if !new.initial.contains_key(to) => {
                    clear(transfer, *to, layouts.new);
                }
                None => {}
            }
        }
        let mut cells = Vec::new();
        for (from, to) in &self.after {
            for from in from.operands() {
                let to = to.and_then(|_| self.after(from)).and_then(|to| layouts.new.cell(to));
                cells.extend(layouts.old.cell(from).map(|from| RenumberedCell { from, to }));
            }
        }
        transfer.renumbered = Renumbered::new(cells);
    }
}

/// The elements that a program's tags and operands name by address.
fn named(identity: &Identity) -> HashSet<Address> {
    let elements = identity.addresses.iter().filter_map(|address| Space::with_members(*address));
    let elements = elements.map(|(space, number)| space.address(number));
    elements.filter(|element| identity.names.places.at(*element).is_none()).collect()
}

/// The addresses of the tags with the names of a place's elements, in the place's space.
pub(super) fn addresses<'a>(
    identity: &'a Identity,
    place: &'a TagPlace,
) -> impl Iterator<Item = (u32, Address)> + 'a {
    (0..place.count).filter_map(|index| {
        let address = *identity.tags.get(&place.name_of(index))?;
        let (space, _) = Space::of(address)?;
        let fits = space == place.space && identity.names.places.at(address).is_none();
        fits.then_some((index, address))
    })
}

fn follow(pairs: &HashMap<Address, Option<Address>>, address: Address) -> Option<Address> {
    if let Some(other) = pairs.get(&address) {
        return *other;
    }
    if let Address::Bit(Bit::InWord(bit)) = address {
        let Some(Address::Word(word)) = follow(pairs, Address::Word(bit.word)) else { return None };
        return Some(Address::Bit(Bit::InWord(WordBit { word, ..bit })));
    }
    let Some((structure, member)) = address.structure().zip(address.member()) else {
        return Some(address);
    };
    match pairs.get(&Address::Structure(structure)) {
        None => Some(address),
        Some(Some(Address::Structure(other))) => other.member(member),
        Some(_) => None,
    }
}

/// A text of the old program with the names of the new one.
fn renamed(text: &str, texts: &HashMap<String, String>) -> String {
    let in_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '[' | ']');
    let mut said = String::with_capacity(text.len());
    let mut rest = text;
    while !rest.is_empty() {
        let (name, behind) = rest.split_at(rest.find(|c| !in_name(c)).unwrap_or(rest.len()));
        let (base, member) = match name.rsplit_once('.') {
            Some((base, _)) if texts.contains_key(base) => (base, &name[base.len()..]),
            Some(_) | None => (name, ""),
        };
        said.push_str(texts.get(base).map_or(base, String::as_str));
        said.push_str(member);
        let end = behind.find(in_name).unwrap_or(behind.len());
        said.push_str(&behind[..end]);
        rest = &behind[end..];
    }
    said
}

/// Adds the copy of an element.
fn copy(
    transfer: &mut Transfer,
    OldAndNew { old: from, new: to }: OldAndNew<Address>,
    OldAndNew { old, new }: OldAndNew<&Layout>,
) {
    if let (Address::Structure(from), Address::Structure(to)) = (from, to) {
        let (first, behind) = (old.record_bits(from), new.record_bits(to));
        let stretch = KeptCells { from: first.start, to: behind.start, count: first.len() as u32 };
        transfer.bits.push(stretch);
    }
    for (from, to) in from.operands().into_iter().zip(to.operands()) {
        match (old.cell(from), new.cell(to)) {
            (Some(Cell::Bit(from)), Some(Cell::Bit(to))) => {
                push(&mut transfer.bits, from.0, to.0);
            }
            (Some(Cell::Word(from)), Some(Cell::Word(to))) => {
                push(&mut transfer.words, from.0, to.0);
            }
            (Some(_), _) | (None, _) => {}
        }
    }
}

/// Adds a cell: to the last stretch if it follows it directly, else as a new stretch.
fn push(stretches: &mut Vec<KeptCells>, from: u32, to: u32) {
    match stretches.last_mut() {
        Some(last) if (last.from + last.count, last.to + last.count) == (from, to) => {
            last.count += 1;
        }
        _ => stretches.push(KeptCells { from, to, count: 1 }),
    }
}

/// Sets an element to its state after a cold start.
fn clear(transfer: &mut Transfer, element: Address, layout: &Layout) {
    // Inputs keep the state of their terminals.
    if matches!(element, Address::Bit(Bit::Space(BitSpace::X, _))) {
        return;
    }
    match element {
        Address::Structure(structure) => {
            transfer.fresh.push(layout.record(structure));
            if let Structure::Sensaphone(number) = structure {
                transfer.new_words.push((layout.word(Word::Pre(number)), 0));
            }
        }
        Address::Bit(Bit::InWord(_)) => {}
        Address::Bit(bit) => transfer.new_bits.push((layout.bit(bit), false)),
        Address::Word(word) => transfer.new_words.push((layout.word(word), 0)),
    }
}
