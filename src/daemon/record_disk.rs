//! The disk's thread of the scan log: writes blocks to the folder, and tells what becomes of it.
//!
//! `record_thread` hands blocks over and never waits: while the disk stalls, a bounded number of
//! blocks waits; then blocks are left out, which the recording shows as a gap.

use std::time::Duration;

use crate::record::RecordBlock;

/// What `status` shows of the folder.
#[derive(Clone, Debug, Default)]
pub(super) struct DiskFigures {
    pub dir: String,
    pub bytes: u64,
    /// The most bytes that it may take.
    pub size: u64,
    /// Why it cannot be written at present.
    pub failing: Option<String>,
}

/// A handle to the thread.
pub(super) struct RecordDisk {}

impl RecordDisk {
    pub fn put(&mut self, _: RecordBlock) {}

    pub fn figures(&self) -> DiskFigures {
        DiskFigures::default()
    }

    /// Waits until the last block is durable.
    pub fn end(&mut self, _: Duration) {}
}
