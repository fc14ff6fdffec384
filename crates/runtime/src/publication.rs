//! What the scan thread publishes: images, faults, and the facts beside an image.
//!
//! Used by both ends of `link`. Nothing here publishes.

use std::sync::Arc;

use super::forces::Forces;
use super::image::Snapshot;
use super::mode::{FaultReason, Mode};

/// The objects that the scan thread hands over.
#[derive(Debug)]
pub enum Publication {
    /// A complete scan, or the memory after the passes of a stop.
    Image(Arc<Snapshot>),
    /// The memory with which a new program begins its first scan in RUN. It is shown only if a
    /// fault comes before the first image of that program.
    Beginning(Arc<Snapshot>),
    /// A fault and its time; there is no new image.
    Fault(FaultReason, u64),
    /// A spare of an earlier program.
    Outlived(Arc<Snapshot>),
}

/// The values that the scan thread publishes beside its image.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct ScanFacts<'a> {
    pub scans: u64,
    pub now_ns: u64,
    pub mode: Mode,
    /// The time of the last change of mode.
    pub since_ns: u64,
    /// A stop was requested: this scan or the next one is the last of its RUN.
    pub ending: bool,
    pub forces: &'a Forces,
}
