//! How a device is wired to memory: what its inputs move, what goes out to it, and what goes out
//! outside RUN.
//!
//! Made by the daemon of the controller file. Read by the scan (`field`, `local`) and by drivers.

use super::exchange::{Mode, Snapshot};
use super::image::Safe;
use super::machine::Machine;
use crate::engine::{BitCell, Cell, WordCell};

/// The target of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WiringTarget {
    /// An input, by its number.
    Input(u32),
    /// A bit.
    Bit(BitCell),
    /// A word, and its range.
    Word {
        /// The word.
        cell: WordCell,
        /// The least value; a lower one becomes this.
        min: i32,
        /// The greatest.
        max: i32,
    },
}

/// The source of an output point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// An output, as driven: by its number.
    Output(u32),
    /// Anything else, with what it is outside RUN; `None`: as it is.
    Cell(Cell, Option<i32>),
}

/// A device, as the scan has to know it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wiring {
    /// One a point that comes in.
    pub inputs: Vec<WiringTarget>,
    /// One a point that goes out.
    pub outputs: Vec<Source>,
    /// The cell of its `.Ok`.
    pub ok: BitCell,
    /// The cell of its `.Stale`.
    pub stale: BitCell,
    /// The greatest age of the last good exchange, and of each input.
    pub loss_after_ns: u64,
    /// An input that is older is OFF or 0, instead of as read last.
    pub zero_on_loss: bool,
    /// The device is exchanged by the scan thread itself, and one exchange may take this time.
    /// Several late ones running are a failure.
    pub local_budget_ns: Option<u64>,
}

impl WiringTarget {
    /// The input that it is, by its number.
    pub(super) fn input(&self) -> Option<u32> {
        match *self {
            WiringTarget::Input(x) => Some(x),
            WiringTarget::Bit(_) | WiringTarget::Word { .. } => None,
        }
    }

    pub(super) fn receive<M: Machine>(&self, machine: &mut M, value: i32) {
        match *self {
            WiringTarget::Input(x) => machine.set_input(x, value != 0),
            WiringTarget::Bit(cell) => machine.write_bit(cell, value != 0),
            WiringTarget::Word { cell, .. } => machine.write_word(cell, value),
        }
    }

    /// The value that it can hold, nearest to this one.
    pub(super) fn held(&self, value: i32) -> i32 {
        match *self {
            WiringTarget::Input(_) | WiringTarget::Bit(_) => i32::from(value != 0),
            WiringTarget::Word { min, max, .. } => value.clamp(min, max),
        }
    }
}

/// The values that go out now: in RUN those of the last complete scan, else the safe ones.
pub fn outgoing(sources: &[Source], image: &Snapshot, values: &mut [i32]) {
    let safe = image.mode != Mode::Run;
    for (value, source) in values.iter_mut().zip(sources) {
        *value = match *source {
            Source::Output(y) => i32::from(image.outputs[y as usize]),
            Source::Cell(_, Some(fixed)) if safe => fixed,
            Source::Cell(cell, _) => image.value(cell),
        };
    }
}

/// The values that go out at the end of the process, in every mode.
pub fn last_words(sources: &[Source], image: &Snapshot, values: &mut [i32]) {
    outgoing(sources, image, values);
    for (value, source) in values.iter_mut().zip(sources) {
        match *source {
            Source::Output(y) => match image.safe[y as usize] {
                Safe::Off => *value = 0,
                Safe::On => *value = 1,
                Safe::Hold => {}
            },
            Source::Cell(_, Some(fixed)) => *value = fixed,
            Source::Cell(_, None) => {}
        }
    }
}
