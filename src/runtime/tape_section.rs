//! A section of the tape: a state, and what came in after it, until the next state.
//!
//! `record` makes sections of the tape, keeps them and reads them again; `observe` executes them
//! again. The entries of a section have no state among them.

use super::mode::Mode;
use super::origin::Origin;
use super::tape::TapeEntry;
use crate::engine::EngineState;

/// A state and the entries after it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TapeSection {
    /// How it begins.
    pub start: SectionStart,
    /// The state at its start.
    pub state: EngineState,
    /// What came in, in order.
    pub entries: Vec<TapeEntry>,
    /// Who stands behind an origin, for people: `root`, `Modbus client 10.0.0.7`.
    pub who: Vec<(Origin, String)>,
}

/// How a section begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SectionStart {
    /// The number of its program: one more with every reload.
    pub generation: u32,
    /// The number of the next scan; the first of a process is 1.
    pub number: u64,
    /// The mode.
    pub mode: Mode,
    /// Add it to a monotonic time to have ns since 1970 (UTC).
    pub unix_offset_ns: i64,
    /// Steps that are lost right before it.
    pub lost: u64,
    /// Whether it goes on where the section before it ended: the same process, and nothing lost.
    /// A swap may lie between the two.
    pub follows: bool,
}
