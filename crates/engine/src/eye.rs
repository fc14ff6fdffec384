//! The interface of an observer of a scan: it sees memory before and after each step, in order.
//!
//! `observe` uses an eye to explain a scan. The scan thread, the simulator and every other caller
//! execute without one ([`NoObserver`]); the compiler then removes all calls of the eye. In a
//! program that `lower::lower_seen` made, a batch is one operation.

use std::ops::Range;

use super::events::Element;
use super::image::Image;
use crate::isa::BlockId;

/// A step of a scan. Steps nest: a turn has the steps of its block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ScanStep {
    /// The turn of a block: it starts the block's initial Stage, ends a Task that runs once, and
    /// turns Stages OFF after the block's pass.
    Turn(BlockId),
    /// A block's own rungs execute, or a Stage does.
    Element(Element),
    /// A batch of operations, by its index in the program.
    Batch(u32),
    /// A step of a termination pass, by its index in the program.
    Pass(u32),
}

/// Sees the steps of a scan.
pub trait ScanObserver {
    /// Returns the next batch to execute among the remaining batches of an element; the end of the
    /// range means none. An eye may skip a batch that would change nothing.
    #[inline(always)]
    fn next(&mut self, batches: Range<u32>) -> u32 {
        batches.start
    }

    /// The step begins.
    fn before(&mut self, deed: ScanStep, image: &Image);

    /// The step has ended.
    fn after(&mut self, deed: ScanStep, image: &Image);
}

/// No eye.
pub(super) struct NoObserver;

impl ScanObserver for NoObserver {
    #[inline(always)]
    fn before(&mut self, _: ScanStep, _: &Image) {}

    #[inline(always)]
    fn after(&mut self, _: ScanStep, _: &Image) {}
}
