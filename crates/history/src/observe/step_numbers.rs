//! The numbers of the steps of a call: the same whenever the call is executed from the same state,
//! even if batches are left out.

use rungd_engine::{ScanStep, Slice};

/// The number of the step that executes now. The numbers rise in the order of execution.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StepNumbers {
    now: u32,
    /// The element that executes: its own number, its first batch, the number of its batches.
    element: u32,
    first: u32,
    count: u32,
}

impl StepNumbers {
    /// The number of a step at its beginning.
    pub fn before(&mut self, deed: ScanStep, slice: &Slice) -> u32 {
        match deed {
            ScanStep::Batch(at) => self.now = self.element + 1 + (at - self.first),
            ScanStep::Turn(_) | ScanStep::Pass(_) => self.now += 1,
            ScanStep::Element(of) => {
                let batches = &slice.code(of).batches;
                self.now += 1;
                self.element = self.now;
                (self.first, self.count) = (batches.start, batches.end - batches.start);
            }
        }
        self.now
    }

    /// The number of a step at its end. The end of a turn, block or Stage has a new number.
    pub fn after(&mut self, deed: ScanStep) -> u32 {
        match deed {
            ScanStep::Batch(_) | ScanStep::Pass(_) => {}
            ScanStep::Turn(_) => self.now += 1,
            ScanStep::Element(_) => self.now = self.element + self.count + 1,
        }
        self.now
    }
}
