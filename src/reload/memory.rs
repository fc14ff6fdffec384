//! Structures and data: whose state goes on, and what begins anew.

use std::collections::{BTreeMap, HashMap};

use super::report::{preset, same};
use super::{Elsewhere, Names, Plan, Side, State};
use crate::engine::{Cell, Termination};
use crate::isa::{Address, Bit, BitSpace, MemorySizes, Mnemonic, Structure, Word};
use crate::lower::identity::{Owner, Standing};
use crate::resolve::program::Value;

/// The old owners that go on: record, which of CTU and CTD, and where they stand.
#[derive(Default)]
pub(super) struct Kept(HashMap<(u32, Option<Mnemonic>), Standing>);

impl Kept {
    fn note(&mut self, record: u32, owner: &Owner) {
        let halves = [Mnemonic::Ctu, Mnemonic::Ctd];
        let half = Some(owner.mnemonic).filter(|mnemonic| halves.contains(mnemonic));
        self.0.insert((record, half), owner.standing);
    }

    /// Whether the instruction of a termination goes on.
    pub fn goes_on(&self, termination: &Termination, standing: Standing) -> bool {
        let half = match termination {
            Termination::CountUp(_) => Some(Mnemonic::Ctu),
            Termination::CountDown(_) => Some(Mnemonic::Ctd),
            Termination::BitOff(_)
            | Termination::HistoryOff(_)
            | Termination::Counter(..)
            | Termination::Timer(..)
            | Termination::HoldTimer(_)
            | Termination::DisableTask(_) => None,
        };
        let record = termination.record();
        record.is_some_and(|record| self.0.get(&(record, half)) == Some(&standing))
    }
}

/// Structures whose owner has the same mnemonic in the same block go on; what another owner has
/// begins anew.
pub(super) fn structures(plan: &mut Plan, names: &Names<'_>, old: Side<'_>, new: Side<'_>) -> Kept {
    let mut kept = Kept::default();
    let (before, now) = (by_structure(&names.old.owners), by_structure(&names.new.owners));
    for (structure, owners) in &now {
        let mut goes_on = false;
        for owner in owners {
            let same = before.get(structure).and_then(|before| {
                before.iter().find(|before| {
                    let block = names.block(before.standing.block);
                    before.mnemonic == owner.mnemonic && block == Some(owner.standing.block)
                })
            });
            let Some(same) = same else { continue };
            goes_on = true;
            kept.note(old.symbols.layout.record(*structure), same);
            plan.moves(names, same.standing, owner.standing);
            tell_kept(plan, names, old, (same, owner));
        }
        if goes_on {
            sensaphone_preset(plan, *structure, (old, new));
            continue;
        }
        plan.transfer.fresh.push(new.symbols.layout.record(*structure));
        if let Structure::Sensaphone(_) = structure {
            put_preset(plan, *structure, new);
        }
        tell_new(
            plan,
            names,
            *structure,
            (before.get(structure).and_then(|b| b.first()), owners[0]),
        );
    }
    for (structure, owners) in &before {
        if !now.contains_key(structure) {
            let said = names.old.say(Address::Structure(*structure));
            let Owner { mnemonic, standing, .. } = owners[0];
            let (name, block) = (mnemonic.spec().name, &names.old.block(standing.block).name);
            plan.say(format!("{said} is gone: {name} in {block}"));
        }
    }
    kept
}

fn by_structure(owners: &[Owner]) -> BTreeMap<Structure, Vec<&Owner>> {
    let mut of: BTreeMap<Structure, Vec<&Owner>> = BTreeMap::new();
    for owner in owners {
        of.entry(owner.structure).or_default().push(owner);
    }
    of
}

/// PRE is memory; a constant preset that was edited is put there, as a cold start would.
fn sensaphone_preset(plan: &mut Plan, structure: Structure, (old, new): (Side<'_>, Side<'_>)) {
    let Structure::Sensaphone(n) = structure else { return };
    let constant = |side: Side<'_>| {
        let cell = side.symbols.layout.word(Word::Pre(n));
        side.program.initial_words.iter().find(|(at, _)| *at == cell).map(|(_, value)| *value)
    };
    if constant(old) != constant(new) {
        put_preset(plan, structure, new);
    }
}

fn put_preset(plan: &mut Plan, structure: Structure, new: Side<'_>) {
    let cell = new.symbols.layout.word(Word::Pre(structure.number()));
    let initial = new.program.initial_words.iter().find(|(at, _)| *at == cell);
    plan.transfer.new_words.push((cell, initial.map_or(0, |(_, value)| *value)));
}

fn tell_kept(plan: &mut Plan, names: &Names<'_>, old: Side<'_>, (before, now): (&Owner, &Owner)) {
    let said = names.new.say(Address::Structure(now.structure));
    let timer = matches!(now.structure, Structure::Timer(_));
    let of = |owner: &Owner, name| owner.presets.iter().find(|(n, _)| *n == name).map(|(_, v)| *v);
    for name in ["preset", "up-preset", "dn-preset"] {
        let (was, is) = (of(before, name), of(now, name));
        let say = |value: Option<Value>| value.map_or("none".into(), |value| preset(value, timer));
        let differ = match (was, is) {
            (Some(was), Some(is)) => !same(was, is),
            (was, is) => was.is_some() != is.is_some(),
        };
        if differ {
            plan.say(format!("{name} of {said} {} → {}", say(was), say(is)));
        }
    }
    let layout = &old.symbols.layout;
    let now_preset = of(now, "preset").or(of(now, "up-preset"));
    let preset_word = match now_preset {
        Some(Value::Word(word)) => Some(layout.word(word).0),
        _ => None,
    };
    let acc = layout.word(Word::Acc(now.structure)).0;
    let into = into(plan, names, old, (before.standing, now.standing));
    plan.say_of(said, State::Keeps { timer, acc, preset: now_preset, preset_word, into });
}

/// The Stage that an instruction stands in now and did not before.
fn into(
    plan: &Plan,
    names: &Names<'_>,
    old: Side<'_>,
    (before, now): (Standing, Standing),
) -> Option<Elsewhere> {
    let stage = now.stage.filter(|_| names.standing(before) != Some(now))?;
    let was = names.stage_before(stage).map(|id| old.symbols.layout.bit(Bit::Stage(id)).0);
    let start = plan.starts.get(&now.block).filter(|(initial, _)| *initial == stage);
    let start = start.map(|(_, start)| start.clone());
    Some(Elsewhere { said: names.new.stage(stage), stage: was, start })
}

fn tell_new(
    plan: &mut Plan,
    names: &Names<'_>,
    structure: Structure,
    (before, now): (Option<&&Owner>, &Owner),
) {
    let said = names.new.say(Address::Structure(structure));
    let Some(before) = before else {
        return plan.say(format!("{said} is new"));
    };
    let owner = |owner: &Owner, block: &str| format!("{} in {block}", owner.mnemonic.spec().name);
    let was = owner(before, &names.old.block(before.standing.block).name);
    let is = owner(now, &names.new.block(now.standing.block).name);
    plan.say(format!("{said} begins anew: {is}, was {was}"));
}

/// What a tag's `initial` says of an address that the old program knows nothing of.
pub(super) fn initial(plan: &mut Plan, names: &Names<'_>, old: Side<'_>, new: Side<'_>) {
    for (address, value) in &names.new.initial {
        if names.old.addresses.contains_key(address) {
            continue;
        }
        match new.symbols.layout.cell(*address) {
            // Inputs are as they are driven.
            _ if matches!(address, Address::Bit(Bit::Space(BitSpace::X, _))) => continue,
            Some(Cell::Bit(cell)) => plan.transfer.new_bits.push((cell, *value != 0)),
            Some(Cell::Word(cell)) => plan.transfer.new_words.push((cell, *value)),
            None => continue,
        }
        let Some(cell) = old.symbols.layout.cell(*address) else { continue };
        plan.say_of(names.new.say(*address), State::Initial { cell, value: *value });
    }
    let (before, now) = (sizes(old.symbols.layout.sizes()), sizes(new.symbols.layout.sizes()));
    for ((name, before), (_, now)) in before.into_iter().zip(now) {
        if before != now {
            plan.say(format!("memory {name} {before} → {now}"));
        }
    }
}

/// What a cell of memory begins with, if it does not go on. Memory lies in the same cells in both.
pub(super) fn begins(plan: &Plan, cell: Cell) -> Option<i32> {
    let transfer = &plan.transfer;
    match cell {
        Cell::Bit(_) => {
            let of = transfer.new_bits.iter().find(|(bit, _)| Cell::Bit(*bit) == cell);
            of.map(|(_, on)| i32::from(*on))
        }
        Cell::Word(at) => {
            let of = transfer.new_words.iter().find(|(word, _)| *word == at).map(|(_, v)| *v);
            of.or_else(|| transfer.fresh.contains(&at.0).then_some(0))
        }
    }
}

fn sizes(sizes: &MemorySizes) -> [(&'static str, u32); 11] {
    let MemorySizes { x, y, c, mc, mi, v, d, mhr, mir, ct, t, devices: _ } = *sizes;
    [
        ("X", x),
        ("Y", y),
        ("C", c),
        ("MC", mc),
        ("MI", mi),
        ("V", v),
        ("D", d),
        ("MHR", mhr),
        ("MIR", mir),
        ("CT", ct),
        ("T", t),
    ]
}
