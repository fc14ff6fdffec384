//! The mode of a controller on the rig.

/// The mode of the controller. Nothing here leads to FAULT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RigMode {
    /// It scans.
    Run,
    /// It does not scan.
    Stop,
}

/// The nanoseconds of a millisecond.
pub(super) const MS_NS: u64 = 1_000_000;
