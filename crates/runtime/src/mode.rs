//! The modes of a controller, and the reasons for them.
//!
//! The scan thread enters a mode, snapshots contain it, the log reports it. This file has only
//! numbers and words; the transitions are in `scanner`, `scan_loop` and `obey`.

use std::fmt;

/// The mode of the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// It scans, and outputs are driven.
    Run,
    /// It does not scan; outputs are safe; every block had its termination pass.
    Stop(StopReason),
    /// It does not scan; outputs are safe; no termination pass ran.
    Fault(FaultReason),
}

/// Why the controller is in STOP.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The first scan is still to come.
    NotStarted,
    /// The ladder executed STOP.
    Instruction,
    /// A signal requested it.
    Signal,
    /// The requested number of scans is complete.
    ScanLimit,
    /// An operator requested it.
    Operator,
    /// The command line requested a start in STOP.
    CommandLine,
    /// It was restarted too often in too short a time, and so started in STOP.
    RestartGuard,
    /// No saved memory was found, and memory is as after a cold start.
    NothingRestored,
}

/// Why the controller is in FAULT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultReason {
    /// A scan took longer than the watchdog allows.
    ScanTooLong {
        /// The duration of the scan, in microseconds.
        scan_us: u32,
    },
    /// A scan has not ended within the time of the watchdog.
    ScanNeverEnds,
    /// A scan was due and has not begun within the time of the watchdog.
    ScanNeverBegins,
    /// The engine panicked (a bug in rungd, not in the ladder).
    EnginePanic,
    /// The scan thread has ended unexpectedly (a bug in rungd).
    ScanThreadGone,
}

impl StopReason {
    /// Whether the process continues, so that an operator can start RUN again.
    pub fn waits_for_operator(self) -> bool {
        self == StopReason::Instruction || self.is_meant()
    }

    /// Whether the STOP is intended: the controller is then ready although it does not scan.
    pub fn is_meant(self) -> bool {
        use StopReason::{CommandLine, NothingRestored, Operator, RestartGuard};
        matches!(self, Operator | CommandLine | RestartGuard | NothingRestored)
    }
}

impl Mode {
    /// The name of RUN.
    pub const RUN: &'static str = "RUN";
    /// The name of STOP, for every reason.
    pub const STOP: &'static str = "STOP";
    /// The name of FAULT, for every reason.
    pub const FAULT: &'static str = "FAULT";

    /// `RUN`, `STOP` or `FAULT`.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Run => Mode::RUN,
            Mode::Stop(_) => Mode::STOP,
            Mode::Fault(_) => Mode::FAULT,
        }
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Mode::Run => f.write_str(self.name()),
            Mode::Stop(reason) => write!(f, "{}: {reason}", self.name()),
            Mode::Fault(reason) => write!(f, "{}: {reason}", self.name()),
        }
    }
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            StopReason::NotStarted => "the first scan is still to come",
            StopReason::Instruction => "the ladder executed STOP",
            StopReason::Signal => "a signal requested it",
            StopReason::ScanLimit => "the requested number of scans is complete",
            StopReason::Operator => "an operator requested it",
            StopReason::CommandLine => "the command line requested it (`--stopped`)",
            StopReason::RestartGuard => "it was restarted too often in a short time",
            StopReason::NothingRestored => {
                "nothing was found to restore, and memory is as after a cold start"
            }
        })
    }
}

impl fmt::Display for FaultReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FaultReason::ScanTooLong { scan_us } => {
                write!(f, "a scan took {scan_us} us, longer than the watchdog allows")
            }
            FaultReason::ScanNeverEnds => {
                f.write_str("a scan has not ended within the watchdog's time")
            }
            FaultReason::ScanNeverBegins => {
                f.write_str("a scan was due and has not begun within the watchdog's time")
            }
            FaultReason::EnginePanic => f.write_str("the engine panicked, which is a bug in rungd"),
            FaultReason::ScanThreadGone => {
                f.write_str("the scan thread has ended, which is a bug in rungd")
            }
        }
    }
}
