//! The world's end of a device's inputs: a driver's task hands in the values that it has read.
//!
//! Images pass whole (`latest`) to the scan's end (`field`), each input with the time at which it
//! was read. Ages are computed in the scan, so a hanging task cannot look healthy.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::latest::{InputWriter, LatestInput};
use super::wiring::WiringTarget;

/// The state of a device's exchanges, known to both ends.
#[derive(Default)]
pub(super) struct Pulse {
    /// When the last good one ended (CLOCK_MONOTONIC); 0: there was none.
    good_ns: AtomicU64,
    /// The last one failed.
    troubled: AtomicBool,
}

/// The world's end of a device's inputs: held by its driver's task.
pub struct InputEnd {
    pulse: Arc<Pulse>,
    images: InputWriter,
    targets: Vec<WiringTarget>,
    /// As read last.
    known: Box<[LatestInput]>,
}

impl fmt::Debug for InputEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "InputEnd of {} inputs", self.targets.len())
    }
}

impl InputEnd {
    /// Of inputs that were never read.
    pub(super) fn new(
        pulse: Arc<Pulse>,
        images: InputWriter,
        targets: Vec<WiringTarget>,
    ) -> InputEnd {
        let known = vec![LatestInput::default(); targets.len()].into();
        InputEnd { pulse, images, targets, known }
    }

    /// Hands on the inputs that an exchange has read, one a point; `None`: not read. These stay
    /// as they are and grow older.
    pub fn deliver(&mut self, inputs: &[Option<i32>], now_ns: u64) {
        let mut any = false;
        for ((known, target), read) in self.known.iter_mut().zip(&self.targets).zip(inputs) {
            if let Some(value) = read {
                // Never beyond the range of its cell.
                *known = LatestInput { value: target.held(*value), read_ns: now_ns.max(1) };
                any = true;
            }
        }
        if any {
            self.images.write(&self.known);
        }
    }

    /// An exchange has succeeded in all; its inputs have been delivered.
    pub fn well(&mut self, now_ns: u64) {
        self.pulse.well(now_ns);
    }

    /// An exchange has failed. Told before those of its inputs are delivered that it has read all
    /// the same, so that no scan takes a part for the whole.
    pub fn trouble(&self) {
        self.pulse.trouble();
    }
}

impl Pulse {
    /// When the last good exchange ended; 0: there was none.
    pub(crate) fn good_ns(&self) -> u64 {
        self.good_ns.load(Ordering::Acquire)
    }

    /// The last exchange failed.
    pub(crate) fn is_troubled(&self) -> bool {
        self.troubled.load(Ordering::Acquire)
    }

    /// An exchange has succeeded in all.
    pub(crate) fn well(&self, now_ns: u64) {
        self.good_ns.store(now_ns.max(1), Ordering::Release);
        self.troubled.store(false, Ordering::Release);
    }

    /// An exchange has failed.
    pub(crate) fn trouble(&self) {
        self.troubled.store(true, Ordering::Release);
    }
}
