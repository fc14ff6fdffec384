//! A suite with its lowered programs, as all players of tests get it.
//!
//! The flag `given_up` ends them before the next scan: a test may take weeks, and an editor gives
//! it up when its text changes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::suite::Suite;
use crate::rig::RigProgram;

/// The suite and its lowered programs, in the same order.
#[derive(Clone, Copy)]
pub(super) struct LoweredSuite<'a> {
    pub suite: &'a Suite,
    pub programs: &'a [Arc<RigProgram>],
    /// `true`: the results are no longer wanted.
    pub given_up: Option<&'a AtomicBool>,
}

impl LoweredSuite<'_> {
    /// Whether the results are no longer wanted. Asked before every scan.
    pub fn is_given_up(&self) -> bool {
        self.given_up.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
