//! The outputs that never moved and the inputs that never changed in the runs of a random test:
//! what such a test cannot have tested.
//!
//! `random_run` notes them, scan by scan; `runner` joins the runs, and `report` shows the names.

use super::suite::TestProgram;
use crate::rig::RigProgram;
use rungd_engine::isa::{Address, Bit, BitSpace};
use rungd_engine::{Cell, Image};
use rungd_runtime::wiring::{OutputSource, WiringTarget};
use std::collections::BTreeSet;

/// The outputs and inputs of a program that its ladder names, or that a device exchanges.
#[derive(Debug)]
pub(super) struct MovableCells {
    all: Vec<MovableCell>,
}

#[derive(Debug)]
struct MovableCell {
    cell: Cell,
    name: String,
    is_output: bool,
}

/// The movable cells that still have their first value in a run.
#[derive(Clone, Debug)]
pub(super) struct UnmovedCells {
    /// The index of each among the movable cells, its cell, and its first value.
    still: Vec<StillCell>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct StillCell {
    index: usize,
    cell: Cell,
    value: i32,
}

/// The names of what never moved in any run of a random test.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct UnmovedNames {
    /// Output bits that were OFF in all scans.
    pub never_on: Vec<String>,
    /// Output bits that were ON in all scans.
    pub never_off: Vec<String>,
    /// Words that devices take, and that kept one value.
    pub never_moved: Vec<String>,
    /// Inputs that kept one value.
    pub never_changed: Vec<String>,
}

impl MovableCells {
    /// Those of a program, in the order of their cells.
    pub fn of(program: &TestProgram, lowered: &RigProgram) -> MovableCells {
        let layout = &lowered.symbols.layout;
        let mut outputs: BTreeSet<Cell> = BTreeSet::new();
        let mut inputs: BTreeSet<Cell> = BTreeSet::new();
        for operand in &program.program.operands {
            let Some(cell) = layout.cell(operand.address) else { continue };
            match operand.address {
                Address::Bit(Bit::Space(BitSpace::Y, _)) => drop(outputs.insert(cell)),
                Address::Bit(Bit::Space(BitSpace::X, _)) => drop(inputs.insert(cell)),
                Address::Bit(_) | Address::Word(_) | Address::Structure(_) => {}
            }
        }
        let written = &lowered.symbols.identity.written;
        // A bit that no instruction writes is an operator's: a fault of a plant.
        let is_of_ladder = |cell| match layout.address(cell) {
            Some(Address::Bit(bit)) => written.contains(&bit),
            Some(Address::Word(_) | Address::Structure(_)) | None => true,
        };
        for wiring in lowered.wirings() {
            outputs.extend(wiring.outputs.iter().filter_map(|source| match source {
                OutputSource::Cell(cell, _) => Some(*cell).filter(|cell| is_of_ladder(*cell)),
                OutputSource::Output(_) => None,
            }));
            inputs.extend(wiring.inputs.iter().filter_map(|target| match *target {
                WiringTarget::Bit(bit) => Some(Cell::Bit(bit)),
                WiringTarget::Word { cell, .. } => Some(Cell::Word(cell)),
                WiringTarget::Input(_) => None,
            }));
        }
        let name = |cell| match layout.address(cell) {
            Some(address) => lowered.symbols.names.name(address),
            None => String::new(),
        };
        let outputs = outputs.into_iter().map(|cell| (cell, true));
        let all = outputs.chain(inputs.into_iter().map(|cell| (cell, false)));
        let movable = |(cell, is_output)| MovableCell { cell, name: name(cell), is_output };
        MovableCells { all: all.map(movable).collect() }
    }

    /// All of them, for a run that begins.
    pub fn unmoved(&self) -> UnmovedCells {
        let still = self.all.iter().enumerate();
        let still = still.map(|(index, MovableCell { cell, .. })| StillCell {
            index,
            cell: *cell,
            value: 0,
        });
        UnmovedCells { still: still.collect() }
    }

    /// The names of what never moved.
    pub fn names(&self, unmoved: &UnmovedCells) -> UnmovedNames {
        let mut names = UnmovedNames::default();
        for StillCell { index, cell, value } in &unmoved.still {
            let MovableCell { name, is_output, .. } = &self.all[*index];
            let list = match (is_output, cell.is_bit(), value) {
                (false, ..) => &mut names.never_changed,
                (true, true, 0) => &mut names.never_on,
                (true, true, _) => &mut names.never_off,
                (true, false, _) => &mut names.never_moved,
            };
            list.push(name.clone());
        }
        names
    }
}

impl UnmovedCells {
    /// Takes the first values, before the first scan.
    pub fn begin(&mut self, image: &Image) {
        self.still.iter_mut().for_each(|still| still.value = image.value(still.cell));
    }

    /// Takes away what has moved, at the end of a scan.
    pub fn scanned(&mut self, image: &Image) {
        self.still.retain(|still| image.value(still.cell) == still.value);
    }

    /// Takes away what has moved in another run.
    pub fn join(&mut self, other: &UnmovedCells) {
        self.still.retain(|still| other.still.contains(still));
    }
}

impl UnmovedNames {
    /// One line: `never ON: burner2; never changed: X3`; empty if everything moved.
    pub fn text(&self) -> String {
        let lists = [
            ("never ON", &self.never_on),
            ("never OFF", &self.never_off),
            ("never moved", &self.never_moved),
            ("never changed", &self.never_changed),
        ];
        let lists = lists.iter().filter(|(_, names)| !names.is_empty());
        let lists = lists.map(|(words, names)| format!("{words}: {}", names.join(", ")));
        lists.collect::<Vec<_>>().join("; ")
    }
}
