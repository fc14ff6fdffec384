//! The wiring of a device to memory: the targets of its inputs, the sources of its outputs, and its
//! output values outside RUN.
//!
//! The daemon makes it from the controller file. The scan (`field`, `local`) and drivers read it.

use super::exchange::{Mode, Snapshot};
use super::machine::ScannedMachine;
use rungd_engine::{BitCell, Cell, WordCell};

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
        /// The least value; a lower value becomes this one.
        min: i32,
        /// The greatest value; a higher value becomes this one.
        max: i32,
    },
}

/// The source of an output point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputSource {
    /// An output, as driven, by its number.
    Output(u32),
    /// Any other cell, with its value outside RUN; `None`: the value of the cell itself.
    Cell(Cell, Option<i32>),
}

/// The wiring of a device, with all that the scan needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wiring {
    /// The targets of the inputs, one for each point.
    pub inputs: Vec<WiringTarget>,
    /// The sources of the outputs, one for each point.
    pub outputs: Vec<OutputSource>,
    /// The cell of its `.Ok`.
    pub ok: BitCell,
    /// The cell of its `.Stale`.
    pub stale: BitCell,
    /// The greatest age of the last good exchange, and of each input.
    pub loss_after_ns: u64,
    /// Whether an input that is older becomes OFF or 0; else it keeps its last value.
    pub zero_on_loss: bool,
    /// For a device that the scan thread itself exchanges: the time that one exchange may take.
    /// Several late exchanges in a row are a failure.
    pub local_budget_ns: Option<u64>,
}

impl WiringTarget {
    /// The number of the input, if it is one.
    pub(super) fn input(&self) -> Option<u32> {
        match *self {
            WiringTarget::Input(x) => Some(x),
            WiringTarget::Bit(_) | WiringTarget::Word { .. } => None,
        }
    }

    pub(super) fn receive<M: ScannedMachine>(&self, machine: &mut M, value: i32) {
        match *self {
            WiringTarget::Input(x) => machine.set_input(x, value != 0),
            WiringTarget::Bit(cell) => machine.write_bit(cell, value != 0),
            WiringTarget::Word { cell, .. } => machine.write_word(cell, value),
        }
    }

    /// The nearest value that the target can hold.
    pub(super) fn held(&self, value: i32) -> i32 {
        match *self {
            WiringTarget::Input(_) | WiringTarget::Bit(_) => i32::from(value != 0),
            WiringTarget::Word { min, max, .. } => value.clamp(min, max),
        }
    }
}

/// The present values of the outputs: in RUN those of the last complete scan, else the safe values.
pub fn outgoing(sources: &[OutputSource], image: &Snapshot, values: &mut [i32]) {
    for (value, present) in values.iter_mut().zip(present_values(sources, image)) {
        *value = present;
    }
}

/// Whether the present values of the outputs are others than these.
pub fn is_other(sources: &[OutputSource], image: &Snapshot, values: &[i32]) -> bool {
    !present_values(sources, image).eq(values.iter().copied())
}

fn present_values(sources: &[OutputSource], image: &Snapshot) -> impl Iterator<Item = i32> {
    let is_safe = image.mode != Mode::Run;
    sources.iter().map(move |source| match *source {
        OutputSource::Output(y) => i32::from(image.outputs[y as usize]),
        OutputSource::Cell(_, Some(fixed)) if is_safe => fixed,
        OutputSource::Cell(cell, _) => image.value(cell),
    })
}

/// The values of the outputs at the end of the process, in every mode.
pub fn last_words(sources: &[OutputSource], image: &Snapshot, values: &mut [i32]) {
    outgoing(sources, image, values);
    for (value, source) in values.iter_mut().zip(sources) {
        match *source {
            OutputSource::Output(y) => *value = image.safe[y as usize].driven(*value != 0).into(),
            OutputSource::Cell(_, Some(fixed)) => *value = fixed,
            OutputSource::Cell(_, None) => {}
        }
    }
}
