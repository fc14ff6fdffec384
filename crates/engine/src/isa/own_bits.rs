//! The bits that every block and every field device has: `Fill.Running`, `io.Ok`.
//!
//! Their names and meanings stand here for all that reads, shows or explains them.

use rungd_base::variants::all_variants;

/// A bit of a block. A Program has only [`BlockBit::Running`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockBit {
    /// The block runs.
    Running,
    /// A Task has run to its end.
    Done,
}

/// A status bit of a field device (`docs/devices.md`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DeviceBit {
    /// Its last exchange succeeded.
    Ok,
    /// Its last good exchange, or the start if there was none yet, is longer ago than `loss-after`.
    Stale,
}

impl BlockBit {
    /// All bits of a block.
    pub const ALL: [BlockBit; 2] = all_variants![BlockBit::Running, BlockBit::Done];

    /// The name as written after the dot.
    pub fn name(self) -> &'static str {
        match self {
            BlockBit::Running => "Running",
            BlockBit::Done => "Done",
        }
    }

    /// Its meaning.
    pub fn meaning(self) -> &'static str {
        match self {
            BlockBit::Running => "ON while the block runs",
            BlockBit::Done => "ON when the Task has run to its end",
        }
    }

    /// The bit with this name.
    pub fn from_name(name: &str) -> Option<BlockBit> {
        BlockBit::ALL.into_iter().find(|bit| bit.name() == name)
    }
}

impl DeviceBit {
    /// All status bits of a device, in the order of their cells.
    pub const ALL: [DeviceBit; 2] = all_variants![DeviceBit::Ok, DeviceBit::Stale];

    /// The name as written after the dot.
    pub fn name(self) -> &'static str {
        match self {
            DeviceBit::Ok => "Ok",
            DeviceBit::Stale => "Stale",
        }
    }

    /// Its meaning.
    pub fn meaning(self) -> &'static str {
        match self {
            DeviceBit::Ok => "ON if the last exchange with the device succeeded",
            DeviceBit::Stale => "ON if the last good exchange is longer ago than `loss-after`",
        }
    }

    /// The bit with this name.
    pub fn from_name(name: &str) -> Option<DeviceBit> {
        DeviceBit::ALL.into_iter().find(|health| health.name() == name)
    }
}
