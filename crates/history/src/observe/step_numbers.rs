//! The numbers of the steps of a call: the same whenever the call is executed from the same state,
//! even if batches are left out.

use rungd_engine::{ScanStep, Slice};

/// The number of the step that executes now. The numbers rise in the order of execution.
#[derive(Clone, Debug, Default)]
pub(super) struct StepNumbers {
    now: u32,
    /// The elements that execute: a block or Stage, then the subroutines that CALLs have entered.
    active: Vec<ActiveElement>,
}

/// An element that executes.
#[derive(Clone, Copy, Debug)]
struct ActiveElement {
    /// Its first batch, and the number of its batches.
    first: u32,
    count: u32,
    /// Its own number, and the numbers of the steps of its CALLs so far.
    base: u32,
    /// The number of the CALL that entered it.
    entered: u32,
}

impl StepNumbers {
    /// The number of a step at its beginning.
    pub fn before(&mut self, deed: ScanStep, slice: &Slice) -> u32 {
        match deed {
            ScanStep::Batch(at) => {
                if let Some(element) = self.active.last() {
                    self.now = element.base + 1 + (at - element.first);
                }
            }
            ScanStep::Turn(_) | ScanStep::Pass(_) => self.now += 1,
            ScanStep::Element(of) => {
                let (entered, batches) = (self.now, &slice.code(of).batches);
                self.now += 1;
                let (base, first) = (self.now, batches.start);
                let count = batches.end - batches.start;
                self.active.push(ActiveElement { first, count, base, entered });
            }
        }
        self.now
    }

    /// The number of a step at its end. The end of a turn, block or Stage has a new number.
    pub fn after(&mut self, deed: ScanStep) -> u32 {
        match deed {
            ScanStep::Batch(_) | ScanStep::Pass(_) => {}
            ScanStep::Turn(_) => self.now += 1,
            ScanStep::Element(_) => {
                if let Some(element) = self.active.pop() {
                    self.now = element.base + element.count + 1;
                    if let Some(caller) = self.active.last_mut() {
                        caller.base += self.now - element.entered;
                    }
                }
            }
        }
        self.now
    }
}
