//! The mode of a controller on the rig, and the time between two of its processes.

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

/// What a power cut costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PowerOff {
    /// The time without a process, ms. Field devices and the time of day go on.
    pub down_ms: u32,
    /// The process finds an image of retentive memory that is at least so much older than the
    /// newest one, ms.
    pub lose_ms: u32,
}
