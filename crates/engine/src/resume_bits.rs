//! The bits of a Program whose Stages are retained.
//!
//! They say whether it runs and which of its Stages are ON. They lie behind all addresses, among
//! the public bits. `lower` allots them; `kept` writes them behind every scan and restores from
//! them; `retain` and `reload` read and set them.

use super::image::BitCell;
use crate::isa::BlockId;

/// A Program whose Stages are retained, and its first bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ResumeBits {
    /// The Program.
    pub program: BlockId,
    /// The first of its bits.
    pub first: u32,
    /// The number of its Stages.
    pub stages: u32,
}

impl ResumeBits {
    /// The number of its bits for a number of Stages.
    pub fn bits(stages: u32) -> u32 {
        3 + stages
    }

    /// Whether the other bits hold: a scan has ended, or an image was restored.
    pub fn holds(self) -> BitCell {
        BitCell(self.first)
    }

    /// Whether it runs.
    pub fn running(self) -> BitCell {
        BitCell(self.first + 1)
    }

    /// Whether its first turn was still to come: it begins at its initial Stage.
    pub fn begins(self) -> BitCell {
        BitCell(self.first + 2)
    }

    /// Whether its n-th Stage is ON.
    pub fn stage(self, n: u32) -> BitCell {
        BitCell(self.first + 3 + n)
    }
}
