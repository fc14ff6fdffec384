//! What a program does to what is retained: who owns structures, which constant a Sensaphone
//! counter's PRE has from the ladder, what a stop terminates.
//!
//! Asked by `plan`, which writes it down with every image, so that the next program can tell what
//! has changed.

use std::collections::{HashMap, HashSet};

use super::content::{Element, Kind};
use super::plan::element_of;
use crate::isa::instruction::Termination;
use crate::isa::{Address, Mnemonic};
use crate::resolve::program::{ArgValue, Block, Instruction, Program, Rung, Value};

/// Stands between an owner and the preset that it states.
const WITH_PRESET: &str = " with PRE ";
const FROM_LOCATION: &str = "from a location";

/// Which preset the instructions of a Sensaphone counter state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Preset {
    Constant(i32),
    Location,
}

/// What the termination passes of a program switch OFF or reset.
pub(super) fn terminated(program: &Program) -> HashSet<Element> {
    let terminates = |mnemonic: Mnemonic| {
        matches!(mnemonic.spec().termination, Termination::Off | Termination::Reset)
    };
    let all = program.blocks.iter().flat_map(rungs).flat_map(instructions);
    let args = all.filter(|one| terminates(one.mnemonic)).flat_map(|one| &one.args);
    let elements = args.filter_map(|arg| match arg.value {
        ArgValue::Bit(bit) => element_of(Address::Bit(bit)),
        ArgValue::Structure(at) => element_of(Address::Structure(at)),
        _ => None,
    });
    elements.collect()
}

fn rungs(block: &Block) -> impl Iterator<Item = &Rung> {
    block.rungs.iter().chain(block.stages.iter().flat_map(|stage| &stage.rungs))
}

/// The owners of structures: `UDCG in Main`; of a Sensaphone counter, each that counts, and the
/// preset: `CTU in Main with PRE 10`.
pub(super) fn owners(program: &Program) -> Vec<(String, Element)> {
    let mut owners: Vec<(String, Element)> = Vec::new();
    let mut presets = HashMap::new();
    for block in &program.blocks {
        for instruction in rungs(block).flat_map(instructions) {
            let Some(ArgValue::Structure(at)) = instruction.args.first().map(|arg| arg.value)
            else {
                continue;
            };
            let Some(element) = element_of(Address::Structure(at)) else { continue };
            if !instruction.mnemonic.owns_structure() {
                continue;
            }
            let own = format!("{} in {}", instruction.mnemonic.spec().name, block.name);
            if element.0 == Kind::N
                && let Some(ArgValue::Value(preset)) = instruction.arg("preset").map(|a| a.value)
            {
                presets.insert(element, preset);
            }
            match owners.iter_mut().find(|(_, other)| *other == element) {
                Some((text, _)) => *text = format!("{text}, {own}"),
                None => owners.push((own, element)),
            }
        }
    }
    for (text, element) in &mut owners {
        match presets.get(element) {
            Some(Value::Const(preset, _)) => *text = format!("{text}{WITH_PRESET}{preset}"),
            Some(Value::Word(_)) => *text = format!("{text}{WITH_PRESET}{FROM_LOCATION}"),
            None => {}
        }
    }
    owners
}

/// The preset in the text of an owner; none where it does not say.
pub(super) fn preset(owner: &str) -> Option<Preset> {
    match owner.rsplit_once(WITH_PRESET)?.1 {
        FROM_LOCATION => Some(Preset::Location),
        constant => constant.parse().ok().map(Preset::Constant),
    }
}

fn instructions(rung: &Rung) -> impl Iterator<Item = &Instruction> {
    rung.body.iter().chain(rung.branches.iter().flat_map(|branch| &branch.body))
}
