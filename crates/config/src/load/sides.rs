//! The ladders beside the controller's that a load has resolved and not judged yet.
//!
//! Kept by `load`; `side_ladders` makes and judges them.

use std::path::Path;
use std::sync::Arc;

use crate::controller::side_ladder::WrittenSideLadder;
use rungd_language::resolve::program::Program;
use rungd_language::source::finding::Finding;

/// A ladder beside the controller's, with its findings so far.
#[derive(Debug)]
pub(super) struct LoadedSide {
    pub program: Arc<Program>,
    pub written: WrittenSideLadder,
    /// Their places may be in layers of the program.
    pub findings: Vec<Finding>,
}

/// Where the files of ladders are.
#[derive(Clone, Copy)]
pub(super) enum SideFiles<'a> {
    /// Relative to this file, which is of this kind.
    Named(&'a Path, &'static str),
    /// Already among the files of the load: those from here on, in order.
    Given(usize),
}
