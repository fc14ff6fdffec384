//! A block: one section of the tape, packed, with a head that contains its place in time.
//!
//! `recorder` makes blocks; `recent` keeps them, the store writes them. Both may omit the base
//! image of a block, because the block before it leads to the same state.

use std::sync::Arc;

use super::program::RecordedProgram;
use super::section::SectionBody;
use super::zip::packed;
use rungd_engine::EngineState;

/// The facts of a section that can be read without unpacking it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockHead {
    /// Its number among the sections of its process; the first one is 0.
    pub sequence: u64,
    /// The number of its first scan; the first of a process is 1.
    pub number: u64,
    /// The scans that begin in it.
    pub scans: u32,
    /// The time of its first scan, ns since 1970 (UTC); if it has no scan, the time of recording.
    pub begin_ns: i64,
    /// The time of its last scan, ns since 1970 (UTC).
    pub end_ns: i64,
    /// Whether it continues the section before it without a gap.
    pub follows: bool,
    /// The hash of the state at its end, if the state is known.
    pub end_hash: Option<StateHash>,
}

/// The first 16 bytes of the SHA-256 of a state's bytes.
pub type StateHash = [u8; 16];

/// The hash of a state's bytes.
pub(super) fn hash_of(state_bytes: &[u8]) -> StateHash {
    let hash = hmac_sha256::Hash::hash(state_bytes);
    std::array::from_fn(|at| hash[at])
}

/// The hash of a state.
pub fn state_hash(state: &EngineState) -> StateHash {
    let mut bytes = Vec::new();
    state.write(&mut bytes);
    hash_of(&bytes)
}

/// A finished section that can be kept and written.
#[derive(Clone, Debug)]
pub struct RecordBlock {
    /// Its program.
    pub program: Arc<RecordedProgram>,
    /// Its place.
    pub head: BlockHead,
    /// The state at its start, packed.
    pub(super) base: Option<Vec<u8>>,
    /// The section, packed.
    pub(super) section: Vec<u8>,
}

impl RecordBlock {
    /// Packs a section. `state`: the bytes of the state at its start.
    pub fn new(
        program: Arc<RecordedProgram>,
        head: BlockHead,
        state: Option<&[u8]>,
        section: &SectionBody,
    ) -> RecordBlock {
        let (base, section) = (state.map(packed), packed(&section.write()));
        RecordBlock { program, head, base, section }
    }

    /// Whether it has a base image, so that the block before it is not needed.
    pub fn has_base(&self) -> bool {
        self.base.is_some()
    }
}
