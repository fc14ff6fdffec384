//! The image that other threads see: memory after one complete scan, with its mode and forces.
//!
//! `link` fills the image, `exchange` hands it out. After that it is never changed.

use std::sync::Arc;

use super::forces::Forces;
use super::mode::Mode;
use rungd_engine::{BitCell, Cell, WordCell};

/// The whole image of the last complete scan, for other threads.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The generation of the program, one more with every reload. The cells are those of this
    /// program.
    pub generation: u32,
    /// Complete scans since the process started.
    pub scans: u64,
    /// The timestamp of that scan (CLOCK_MONOTONIC, ns).
    pub now_ns: u64,
    /// The mode.
    pub mode: Mode,
    /// The time of the last change of mode (CLOCK_MONOTONIC, ns).
    pub since_ns: u64,
    /// A stop was requested: this scan or the next one is the last of its RUN.
    pub ending: bool,
    /// Every bit, by [`BitCell`]; 0 or 1.
    pub bits: Box<[u8]>,
    /// Every word, by [`WordCell`].
    pub words: Box<[i32]>,
    /// Y0, Y1, … as driven: the values of the image in RUN, else the safe values. 0 or 1.
    pub outputs: Box<[u8]>,
    /// Every batch with a ticket up to this one has been seen by a complete scan or refused.
    pub tickets_done: u64,
    /// The forced cells.
    pub forces: Forces,
    /// The safe state of each Y, outside RUN.
    pub safe: Arc<[SafeState]>,
}

impl Snapshot {
    /// A bit.
    pub fn bit(&self, cell: BitCell) -> bool {
        self.bits[cell.0 as usize] != 0
    }

    /// A word.
    pub fn word(&self, cell: WordCell) -> i32 {
        self.words[cell.0 as usize]
    }

    /// A bit (0 or 1) or word.
    pub fn value(&self, cell: Cell) -> i32 {
        match cell {
            Cell::Bit(bit) => i32::from(self.bit(bit)),
            Cell::Word(word) => self.word(word),
            Cell::WordBit(bit) => i32::from(bit.is_on(self.word(bit.word))),
        }
    }
}

/// The safe state of an output, outside RUN.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SafeState {
    /// OFF.
    #[default]
    Off,
    /// ON.
    On,
    /// In STOP the value after the termination passes; in FAULT the value of the last complete
    /// scan.
    Hold,
}

impl SafeState {
    /// The value of the output outside RUN. `held`: its value when RUN ended.
    pub fn driven(self, held: bool) -> bool {
        match self {
            SafeState::Off => false,
            SafeState::On => true,
            SafeState::Hold => held,
        }
    }
}
