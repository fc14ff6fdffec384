//! Signs of life of the scan thread, and the request to stop, as atomics.
//!
//! The scan thread notes when a scan is due, when it begins and when it ends; the monitor thread
//! reads this. One compare-and-swap decides whether a scan counts as too long or missing, so both
//! threads agree.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

const IDLE: u64 = 0;
const TRIPPED: u64 = u64::MAX;

/// The state of the scan thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Life {
    Alive,
    /// It has ended as it should.
    Ended,
    /// It has ended in a panic.
    Lost,
}

#[derive(Debug)]
pub(super) struct Beat {
    /// The timestamp of the scan that executes, or [`IDLE`], or [`TRIPPED`].
    scan_since_ns: AtomicU64,
    /// The deadline of the next scan, or [`IDLE`], or [`TRIPPED`].
    due_ns: AtomicU64,
    /// The number of complete scans, of ticks, and of checks for commands during long waits.
    pulses: AtomicU64,
    stop: AtomicBool,
    life: AtomicU8,
}

impl Default for Beat {
    fn default() -> Self {
        Beat {
            scan_since_ns: AtomicU64::new(IDLE),
            due_ns: AtomicU64::new(IDLE),
            pulses: AtomicU64::new(0),
            stop: AtomicBool::new(false),
            life: AtomicU8::new(Life::Alive as u8),
        }
    }
}

impl Beat {
    /// Sets the deadline of the next scan, unless the monitor has reported the last one as missing.
    pub fn expect(&self, due_ns: u64) {
        let due_ns = due_ns.clamp(1, TRIPPED - 1);
        let (order, failed) = (Ordering::AcqRel, Ordering::Acquire);
        let _ = self.due_ns.compare_exchange(IDLE, due_ns, order, failed);
    }

    /// Notes that the due scan has come; false if the monitor has reported it as missing.
    pub fn arrive(&self) -> bool {
        self.due_ns.swap(IDLE, Ordering::AcqRel) != TRIPPED
    }

    /// The deadline of the next scan, if the scan thread waits for one.
    pub fn awaited(&self) -> Option<u64> {
        let due_ns = self.due_ns.load(Ordering::Acquire);
        (due_ns != IDLE && due_ns != TRIPPED).then_some(due_ns)
    }

    /// Marks the scan with this deadline as missing, if it still has not come.
    pub fn miss(&self, due_ns: u64) -> bool {
        let (order, failed) = (Ordering::AcqRel, Ordering::Acquire);
        self.due_ns.compare_exchange(due_ns, TRIPPED, order, failed).is_ok()
    }

    /// Notes that a scan begins.
    pub fn begin(&self, now_ns: u64) {
        self.scan_since_ns.store(now_ns.clamp(1, TRIPPED - 1), Ordering::Release);
    }

    /// Notes that the scan is over; false if the monitor has reported it as too long.
    pub fn end(&self) -> bool {
        self.scan_since_ns.swap(IDLE, Ordering::AcqRel) != TRIPPED
    }

    /// Marks the current scan as too long, if it exceeds the watchdog and is not marked yet.
    pub fn trip(&self, now_ns: u64, watchdog_ns: u64) -> bool {
        let since = self.scan_since_ns.load(Ordering::Acquire);
        if since == IDLE || since == TRIPPED || now_ns.saturating_sub(since) <= watchdog_ns {
            return false;
        }
        let exchange = self.scan_since_ns.compare_exchange(
            since,
            TRIPPED,
            Ordering::AcqRel,
            Ordering::Acquire,
        );
        exchange.is_ok()
    }

    /// Counts a complete scan, a tick in STOP or FAULT, or a check for commands during a long wait.
    pub fn pulse(&self) {
        self.pulses.fetch_add(1, Ordering::Release);
    }

    pub fn pulses(&self) -> u64 {
        self.pulses.load(Ordering::Acquire)
    }

    pub fn request_stop(&self) {
        self.stop.store(true, Ordering::Release);
    }

    pub fn stop_requested(&self) -> bool {
        self.stop.load(Ordering::Acquire)
    }

    pub fn set_life(&self, life: Life) {
        self.life.store(life as u8, Ordering::Release);
    }

    pub fn life(&self) -> Life {
        match self.life.load(Ordering::Acquire) {
            0 => Life::Alive,
            1 => Life::Ended,
            _ => Life::Lost,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_too_long_scan_is_reported_once_and_both_threads_agree() {
        let beat = Beat::default();
        assert!(!beat.trip(1000, 10), "no scan is under way");
        beat.begin(100);
        assert!(!beat.trip(110, 10), "as long as the watchdog is not too long");
        assert!(beat.trip(111, 10));
        assert!(!beat.trip(120, 10), "called so already");
        assert!(!beat.end());
        beat.begin(200);
        assert!(beat.end());
    }

    #[test]
    fn a_missing_scan_is_reported_once_and_both_threads_agree() {
        let beat = Beat::default();
        assert_eq!((beat.awaited(), beat.miss(100)), (None, false));
        beat.expect(100);
        assert_eq!(beat.awaited(), Some(100));
        assert!(beat.arrive());
        assert!(!beat.miss(100), "it came in between");
        beat.expect(200);
        assert!(beat.miss(200) && !beat.miss(200));
        assert_eq!(beat.awaited(), None);
        assert!(!beat.arrive());
    }
}
