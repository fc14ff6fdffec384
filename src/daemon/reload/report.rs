//! The report of a reload: the differences of two programs, with the values of the old memory and
//! the texts of both programs' files. Called by `daemon::reload`.

use crate::daemon::config::ControllerSetup;
use rungd_engine::Cell;
use rungd_runtime::{Package, Taped};
use rungd_state::reload::{FileTexts, OldMemory, ReloadPlan};

/// The controllers before and after a swap.
#[derive(Clone, Copy)]
pub(super) struct SwappedSetups<'a> {
    pub old: &'a ControllerSetup,
    pub new: &'a ControllerSetup,
}

/// The report of a swap, made of the values before the swap and the image after the termination
/// passes.
pub(super) fn of_swap(
    plan: &ReloadPlan,
    package: &Package<Taped>,
    forces: &[Cell],
    setups: SwappedSetups,
) -> Vec<String> {
    let engine = package.machine.engine();
    let image = engine.image();
    let (mut bits, mut words) = (image.bits().to_vec(), image.words().to_vec());
    for (cell, value) in &package.asked {
        match cell {
            Cell::Bit(bit) => bits[bit.0 as usize] = *value as u8,
            Cell::Word(word) => words[word.0 as usize] = *value,
            Cell::WordBit(_) => unreachable!("a report asks for whole words"),
        }
    }
    let passed = Some(image.bits());
    let (old, new) = (&setups.old.symbols, &setups.new.symbols);
    let seen = OldMemory { old, new, bits: &bits, words: &words, forces, passed };
    with_texts(plan, &seen, setups.old, setups.new)
}

/// The report with the texts of the rungs in the files of the old and the new program.
pub(super) fn with_texts(
    plan: &ReloadPlan,
    seen: &OldMemory<'_>,
    old: &ControllerSetup,
    new: &ControllerSetup,
) -> Vec<String> {
    let (old, new) = (texts(old), texts(new));
    plan.report(seen, FileTexts { old: &old, new: &new })
}

fn texts(setup: &ControllerSetup) -> Vec<&str> {
    setup.files.iter().map(|file| &*file.text).collect()
}
