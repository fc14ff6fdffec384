//! The use of retained elements by a program: the owners of structures, the presets that the ladder
//! states for Sensaphone counters, and the elements that a stop terminates.
//!
//! `plan` stores these with every image, so that the next program can tell what has changed.

use std::collections::{HashMap, HashSet};

use super::content::{RetainedElement, element_of};
use crate::isa::Address;
use crate::resolve::program::{Action, Program, Value};

/// The text between an owner and the preset that it states.
const WITH_PRESET: &str = " with PRE ";
const FROM_LOCATION: &str = "from a location";

/// The preset that the instructions of a Sensaphone counter state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Preset {
    Constant(i32),
    Location,
}

/// The elements that the termination passes of a program switch OFF or reset.
pub(super) fn terminated(program: &Program) -> HashSet<RetainedElement> {
    let all = program.instructions().map(|(_, instruction)| instruction);
    let terminated = all.filter(|one| one.mnemonic.spec().termination.switches_off());
    let elements = terminated.flat_map(|one| {
        let bit = one.action.written_bit().map(|bit| Address::Bit(bit.value));
        let structure = one.action.structure().map(Address::Structure);
        [bit, structure].into_iter().flatten()
    });
    elements.filter_map(element_of).collect()
}

/// The owners of structures, as `UDCG in Main`. The text of a Sensaphone counter names all its
/// counting instructions and the preset: `CTU in Main with PRE 10`.
pub(super) fn owners(program: &Program) -> Vec<(String, RetainedElement)> {
    let mut owners: Vec<(String, RetainedElement)> = Vec::new();
    let mut presets = HashMap::new();
    for (block, instruction) in program.instructions() {
        let Some(at) = instruction.owned() else { continue };
        let Some(element) = element_of(Address::Structure(at)) else { continue };
        let own = format!("{} in {}", instruction.mnemonic.spec().name, block.name);
        if let Action::Sensaphone { preset: Some(preset), .. } = &instruction.action {
            presets.insert(element, preset.value);
        }
        match owners.iter_mut().find(|(_, other)| *other == element) {
            Some((text, _)) => *text = format!("{text}, {own}"),
            None => owners.push((own, element)),
        }
    }
    for (text, element) in &mut owners {
        match presets.get(element) {
            Some(Value::Const(preset, _)) => *text = format!("{text}{WITH_PRESET}{preset}"),
            Some(Value::Word(_) | Value::Element(_)) => {
                *text = format!("{text}{WITH_PRESET}{FROM_LOCATION}")
            }
            Some(Value::Real(_)) | None => {}
        }
    }
    owners
}

/// The preset in the text of an owner; `None` if the text has none.
pub(super) fn preset(owner: &str) -> Option<Preset> {
    match owner.rsplit_once(WITH_PRESET)?.1 {
        FROM_LOCATION => Some(Preset::Location),
        constant => constant.parse().ok().map(Preset::Constant),
    }
}
