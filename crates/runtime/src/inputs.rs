//! The entry for a device's inputs: a driver's task hands in the values that it has read.
//!
//! An image goes to the scan's end (`field`) as a whole (`latest`), each input with the time at
//! which it was read. Ages are computed in the scan, so a hanging task cannot look healthy.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::latest::{InputWriter, LatestInput};
use super::wiring::WiringTarget;

/// The state of a device's exchanges, shared by both ends.
#[derive(Default)]
pub(super) struct ExchangePulse {
    /// The end of the last good exchange (CLOCK_MONOTONIC); 0: there was none.
    good_ns: AtomicU64,
    /// The last exchange failed.
    troubled: AtomicBool,
}

/// The entry for a device's inputs: held by its driver's task.
pub struct InputEnd {
    pulse: Arc<ExchangePulse>,
    images: InputWriter,
    targets: Vec<WiringTarget>,
    /// The inputs as they were read last.
    known: Box<[LatestInput]>,
}

impl fmt::Debug for InputEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "InputEnd of {} inputs", self.targets.len())
    }
}

impl InputEnd {
    /// Begins with inputs that were never read.
    pub(super) fn new(
        pulse: Arc<ExchangePulse>,
        images: InputWriter,
        targets: Vec<WiringTarget>,
    ) -> InputEnd {
        let known = vec![LatestInput::default(); targets.len()].into();
        InputEnd { pulse, images, targets, known }
    }

    /// Hands on the inputs that an exchange has read, one value for each point. `None`: the
    /// exchange did not read the point; its value stays and grows older.
    pub fn deliver(&mut self, inputs: &[Option<i32>], now_ns: u64) {
        let mut any = false;
        for ((known, target), read) in self.known.iter_mut().zip(&self.targets).zip(inputs) {
            if let Some(value) = read {
                // The value is limited to the range of its cell.
                *known = LatestInput { value: target.held(*value), read_ns: now_ns.max(1) };
                any = true;
            }
        }
        if any {
            self.images.write(&self.known);
        }
    }

    /// Reports a completely successful exchange, after its inputs have been delivered.
    pub fn well(&mut self, now_ns: u64) {
        self.pulse.well(now_ns);
    }

    /// Reports a failed exchange. Called before the inputs that it could read are delivered, so
    /// that no scan takes a partial image for a complete one.
    pub fn trouble(&self) {
        self.pulse.trouble();
    }
}

impl ExchangePulse {
    /// The end of the last good exchange; 0: there was none.
    pub(crate) fn good_ns(&self) -> u64 {
        self.good_ns.load(Ordering::Acquire)
    }

    /// Whether the last exchange failed.
    pub(crate) fn is_troubled(&self) -> bool {
        self.troubled.load(Ordering::Acquire)
    }

    /// Notes a completely successful exchange.
    pub(crate) fn well(&self, now_ns: u64) {
        self.good_ns.store(now_ns.max(1), Ordering::Release);
        self.troubled.store(false, Ordering::Release);
    }

    /// Notes a failed exchange.
    pub(crate) fn trouble(&self) {
        self.troubled.store(true, Ordering::Release);
    }
}
