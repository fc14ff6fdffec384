//! The effect of restoring an image: the cells to set, and what the log says about it.
//!
//! `plan` and `stages` fill it in; the daemon and the rig apply it before the first scan.

use rungd_engine::Cell;

/// The effect of restoring an image.
#[derive(Clone, Debug, Default)]
pub struct Restoration {
    /// Cells and their restored values.
    pub puts: Vec<(Cell, i32)>,
    /// The number of restored elements.
    pub restored: usize,
    /// The elements that were not restored, with the reasons: tags one by one, addresses in runs.
    pub dropped: Vec<DroppedElement>,
    /// Remarks on restored values that the author may not expect.
    pub notes: Vec<String>,
    /// The number of elements that are set to OFF or 0. The image was taken in RUN, and its program
    /// terminates these elements at a stop.
    pub terminated: usize,
    /// The number of retained elements without a usable value in the image: they are as after a
    /// cold start.
    pub fresh: usize,
}

/// A cell that an image restores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RestoredCell {
    /// The cell.
    pub cell: Cell,
    /// The limits outside of which it is not restored: the least and the greatest content.
    pub limits: Option<[i32; 2]>,
}

/// The size of an engine's memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryCount {
    /// The number of bits.
    pub bits: usize,
    /// The number of words.
    pub words: usize,
}

/// An element of the image that was not restored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DroppedElement {
    /// A tag with its address, or a run of addresses.
    pub what: String,
    /// The reason.
    pub why: String,
}
