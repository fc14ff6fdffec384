//! Compares structures and data: finds the state to keep and the state to reset. Called by
//! `ReloadPlan::new`.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::moves::OldAndNew;
use super::plan::{ElementPairs, LoweredProgram, MovedStage, OldState, ReloadPlan};
use super::report::preset;
use rungd_engine::isa::{
    Address, Bit, BitSpace, ElementId, Flag, Mnemonic, Space, Structure, Word,
};
use rungd_engine::{BitCell, Cell, PassStep, WordCell};
use rungd_language::lower::identity::{Identity, Owner};
pub use rungd_language::resolve::program::Value;
use rungd_language::source::indexed::IndexedName;

/// The kept owners of the old program: record, CTU or CTD, and element.
#[derive(Default)]
pub(super) struct KeptOwners(HashMap<(u32, Option<Mnemonic>), ElementId>);

impl KeptOwners {
    fn note(&mut self, record: u32, owner: &Owner) {
        let halves = [Mnemonic::Ctu, Mnemonic::Ctd];
        let half = Some(owner.mnemonic).filter(|mnemonic| halves.contains(mnemonic));
        self.0.insert((record, half), owner.element);
    }

    /// Whether the instruction of a pass step is kept.
    pub fn is_kept(&self, termination: &PassStep, element: ElementId) -> bool {
        let half = match termination {
            PassStep::CountUp(_) => Some(Mnemonic::Ctu),
            PassStep::CountDown(_) => Some(Mnemonic::Ctd),
            PassStep::BitOff(_)
            | PassStep::WordBitOff(_)
            | PassStep::HistoryOff(_)
            | PassStep::Counter(..)
            | PassStep::Timer(..)
            | PassStep::HoldTimer(_)
            | PassStep::DisableTask(_)
            | PassStep::Pick(_) => None,
        };
        let record = termination.record();
        record.is_some_and(|record| self.0.get(&(record, half)) == Some(&element))
    }
}

/// Keeps the structures whose owner has the same mnemonic in the same block. A structure with a
/// different owner is reset.
pub(super) fn structures(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
    new: LoweredProgram<'_>,
) -> KeptOwners {
    let mut kept = KeptOwners::default();
    let (before, now) = (by_structure(&names.old.owners), by_structure(&names.new.owners));
    for (structure, owners) in &now {
        let mut continues = false;
        let was = names.structure_before(*structure);
        let before = was.and_then(|was| before.get(&was));
        for owner in owners {
            let same = before.and_then(|before| {
                before.iter().find(|before| {
                    let block = names.block(before.element.block);
                    before.mnemonic == owner.mnemonic && block == Some(owner.element.block)
                })
            });
            let Some(same) = same else { continue };
            continues = true;
            kept.note(old.symbols.layout.record(same.structure), same);
            plan.record_move(names, same.element, owner.element);
            report_kept(plan, names, old, OldAndNew { old: same, new: owner });
        }
        if let Some(was) = was.filter(|_| continues) {
            let both = OldAndNew { old: was, new: *structure };
            sensaphone_preset(plan, both, OldAndNew { old, new });
            continue;
        }
        plan.transfer.fresh.push(new.symbols.layout.record(*structure));
        if let Structure::Sensaphone(_) = structure {
            put_preset(plan, *structure, new);
        }
        let before = before.and_then(|before| before.first().copied());
        tell_new(plan, names, before, owners[0]);
    }
    for (structure, owners) in &before {
        if names.structure(*structure).is_none_or(|now_is| !now.contains_key(&now_is)) {
            let said = names.old.names.say(Address::Structure(*structure));
            let Owner { mnemonic, element, .. } = owners[0];
            let (name, block) = (mnemonic.spec().name, &names.old.names.block(element.block).name);
            plan.add_line(format!("{said} is gone: {name} in {block}"));
        }
    }
    kept
}

fn by_structure(owners: &[Owner]) -> BTreeMap<Structure, Vec<&Owner>> {
    let mut lists: BTreeMap<Structure, Vec<&Owner>> = BTreeMap::new();
    for owner in owners {
        lists.entry(owner.structure).or_default().push(owner);
    }
    lists
}

/// Writes an edited constant preset to PRE, as a cold start would. If the preset is unedited, PRE
/// keeps its value.
fn sensaphone_preset(
    plan: &mut ReloadPlan,
    structure: OldAndNew<Structure>,
    OldAndNew { old, new }: OldAndNew<LoweredProgram<'_>>,
) {
    let Structure::Sensaphone(_) = structure.new else { return };
    let constant = |side: LoweredProgram<'_>, structure: Structure| {
        let cell = side.symbols.layout.word(Word::Pre(structure.number()));
        side.program.initial_words.iter().find(|(at, _)| *at == cell).map(|(_, value)| *value)
    };
    if constant(old, structure.old) != constant(new, structure.new) {
        put_preset(plan, structure.new, new);
    }
}

fn put_preset(plan: &mut ReloadPlan, structure: Structure, new: LoweredProgram<'_>) {
    let cell = new.symbols.layout.word(Word::Pre(structure.number()));
    let initial = new.program.initial_words.iter().find(|(at, _)| *at == cell);
    plan.transfer.new_words.push((cell, initial.map_or(0, |(_, value)| *value)));
}

fn report_kept(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
    OldAndNew { old: before, new: now }: OldAndNew<&Owner>,
) {
    let said = names.new.names.say(Address::Structure(now.structure));
    let timer = matches!(now.structure, Structure::Timer(_));
    let preset_value =
        |owner: &Owner, name| owner.presets.iter().find(|(n, _)| *n == name).map(|(_, v)| *v);
    for name in ["preset", "up-preset", "dn-preset"] {
        let (was, is) = (preset_value(before, name), preset_value(now, name));
        let say = |identity: &Identity, value: Option<Value>| {
            value.map_or("none".into(), |value| preset(identity, value, timer))
        };
        let differ = match (was, is) {
            (Some(was), Some(is)) => !names.same(was, is),
            (was, is) => was.is_some() != is.is_some(),
        };
        if differ {
            let (was, is) = (say(names.old, was), say(names.new, is));
            plan.add_line(format!("{name} of {said} {was} → {is}"));
        }
    }
    let layout = &old.symbols.layout;
    let now_preset = preset_value(now, "preset").or(preset_value(now, "up-preset"));
    let preset_word = match now_preset {
        Some(Value::Word(word)) => match names.moves.before(Address::Word(word)) {
            Some(Address::Word(word)) => Some(layout.word(word).0),
            _ => None,
        },
        _ => None,
    };
    let acc = layout.word(Word::Acc(before.structure)).0;
    let into = into(plan, names, old, OldAndNew { old: before.element, new: now.element });
    let done = Bit::Flag(before.structure, Flag::Done);
    let done = is_done_at_preset(now.mnemonic).then(|| layout.bit(done).0);
    plan.add_line_with_state(
        said,
        OldState::Keeps { timer, acc, preset: now_preset, preset_word, done, into },
    );
}

/// Whether Done is `.Acc >= preset` at each execution, so that a smaller preset turns it ON.
fn is_done_at_preset(mnemonic: Mnemonic) -> bool {
    let all = [
        Mnemonic::Cnt,
        Mnemonic::Udc,
        Mnemonic::Udcg,
        Mnemonic::Tmr,
        Mnemonic::Tmra,
        Mnemonic::Tmrag,
        Mnemonic::Ondtmr,
    ];
    all.contains(&mnemonic)
}

/// The Stage of an instruction, if the instruction is in a different element now.
fn into(
    plan: &ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
    OldAndNew { old: before, new: now }: OldAndNew<ElementId>,
) -> Option<MovedStage> {
    let stage = now.stage.filter(|_| names.element(before) != Some(now))?;
    let was = names.stage_before(stage).map(|id| old.symbols.layout.bit(Bit::Stage(id)).0);
    let start = plan.starts.get(&now.block).filter(|(initial, _)| *initial == stage);
    let start = start.map(|(_, start)| start.clone());
    Some(MovedStage { said: names.new.names.stage(stage).to_owned(), stage: was, start })
}

/// Reports a structure that begins anew: `now` is its owner, `before` the owner of its counterpart
/// in the old program.
fn tell_new(plan: &mut ReloadPlan, names: &ElementPairs<'_>, before: Option<&Owner>, now: &Owner) {
    let said = names.new.names.say(Address::Structure(now.structure));
    let Some(before) = before else {
        return plan.add_line(format!("{said} is new"));
    };
    let owner = |owner: &Owner, block: &str| format!("{} in {block}", owner.mnemonic.spec().name);
    let was = owner(before, &names.old.names.block(before.element.block).name);
    let is = owner(now, &names.new.names.block(now.element.block).name);
    plan.add_line(format!("{said} starts again: {is}, was {was}"));
}

/// Applies a tag's `initial` to an address that the old program does not use. Also reports changed
/// memory sizes.
pub(super) fn initial(
    plan: &mut ReloadPlan,
    names: &ElementPairs<'_>,
    old: LoweredProgram<'_>,
    new: LoweredProgram<'_>,
) {
    let mut arrays = NewElements::new();
    for (address, value) in &names.new.initial {
        let before = names.moves.before(*address);
        if before.is_some_and(|before| names.old.addresses.contains(&before)) {
            continue;
        }
        match new.symbols.layout.cell(*address) {
            // Inputs keep the state of their terminals.
            _ if matches!(address, Address::Bit(Bit::Space(BitSpace::X, _))) => continue,
            Some(Cell::Bit(cell)) => plan.transfer.new_bits.push((cell, *value != 0)),
            Some(Cell::Word(cell)) => plan.transfer.new_words.push((cell, *value)),
            Some(Cell::WordBit(_)) | None => continue,
        }
        let Some(cell) = old.symbols.layout.cell(*address) else { continue };
        // The place of a tag with a `type` does not get the force of its address.
        let state = OldState::Initial { cell, value: *value, forced: before.map(|_| cell) };
        match names.new.names.tag(*address).and_then(array_of) {
            Some(array) => {
                let said = names.new.names.say(*address);
                arrays.entry(array).or_default().push((said, state));
            }
            None => plan.add_line_with_state(names.new.names.say(*address), state),
        }
    }
    tell_arrays(plan, names, arrays);
    let (before, now) = (old.symbols.layout.sizes(), new.symbols.layout.sizes());
    for space in Space::ALL {
        let (before, now) = (space.count(before), space.count(now));
        if before != now {
            plan.add_line(format!("memory {} {before} → {now}", space.name()));
        }
    }
}

/// The array in the name of an element: `recipe.target` of `recipe[3].target`.
pub(super) fn array_of(tag: &str) -> Option<String> {
    IndexedName::of(tag).map(|name| name.column())
}

/// The array elements that begin with their `initial`, by array.
type NewElements = BTreeMap<String, Vec<(String, OldState)>>;

/// Reports each array with new elements in one line. `places` reports a `type` tag whose `count`
/// has changed.
fn tell_arrays(plan: &mut ReloadPlan, names: &ElementPairs<'_>, arrays: NewElements) {
    for (array, mut elements) in arrays {
        let (old, new) =
            (names.old.names.places.named(&array), names.new.names.places.named(&array));
        match elements.len() {
            _ if old.is_some() && new.is_some() => {}
            1 => elements.drain(..).for_each(|(said, state)| plan.add_line_with_state(said, state)),
            count => {
                let text = format!("{array}: {count} elements are new, with their `initial`");
                let forced = elements.iter().filter_map(|(_, state)| {
                    let OldState::Initial { forced, .. } = state else { return None };
                    *forced
                });
                let cells = forced.collect();
                let force = "those that are forced stay as they are".to_owned();
                plan.add_line_with_state(text, OldState::Named { cells, force });
            }
        }
    }
}

/// The values that memory cells begin with. Memory has the same cell numbers in both programs.
pub(super) struct NewValues {
    bits: HashMap<BitCell, bool>,
    words: HashMap<WordCell, i32>,
    fresh: HashSet<u32>,
}

impl NewValues {
    pub fn of(plan: &ReloadPlan) -> NewValues {
        let transfer = &plan.transfer;
        // The first value of a cell counts.
        NewValues {
            bits: transfer.new_bits.iter().rev().copied().collect(),
            words: transfer.new_words.iter().rev().copied().collect(),
            fresh: transfer.fresh.iter().copied().collect(),
        }
    }

    /// The value that a cell begins with; `None` if it keeps its value.
    pub fn get(&self, cell: Cell) -> Option<i32> {
        match cell {
            Cell::Bit(at) => self.bits.get(&at).map(|on| i32::from(*on)),
            Cell::Word(at) => {
                let word = self.words.get(&at).copied();
                word.or_else(|| self.fresh.contains(&at.0).then_some(0))
            }
            Cell::WordBit(bit) => {
                let word = self.get(Cell::Word(bit.word));
                word.map(|content| i32::from(bit.is_on(content)))
            }
        }
    }
}
