//! Whether the disk of the scan log stalls. A stall begins with the first block that finds no room,
//! and ends when half of the room is free again.
//!
//! Used by `record_disk`, whose two threads share it. While a disk works off a full queue, there is
//! room for one block, then for none, then for one again: this counts as one stall and is reported
//! once.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

/// The blocks that wait for the disk, and whether it stalls.
#[derive(Debug, Default)]
pub(super) struct Backlog {
    waiting: AtomicUsize,
    is_stalled: AtomicBool,
}

/// The current stall, as recorded by the thread that hands blocks over.
#[derive(Debug, Default)]
pub(super) struct DiskStall {
    /// The start of the stall, and the number of blocks left out.
    since: Option<(Instant, u64)>,
}

/// A report about a stall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StallNews {
    Begins,
    /// The start of the stall, and the number of blocks left out.
    Ends(Instant, u64),
}

impl Backlog {
    /// Counts a block that waits.
    pub fn put(&self) {
        self.waiting.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts a block that the disk has taken.
    pub fn taken(&self) {
        self.waiting.fetch_sub(1, Ordering::Relaxed);
    }

    /// Whether the disk stalls.
    pub fn is_stalled(&self) -> bool {
        self.is_stalled.load(Ordering::Relaxed)
    }
}

impl DiskStall {
    /// Notes that there was no room for a block.
    pub fn left_out(&mut self, backlog: &Backlog, now: Instant) -> Option<StallNews> {
        let is_first = self.since.is_none();
        self.since.get_or_insert((now, 0)).1 += 1;
        backlog.is_stalled.store(true, Ordering::Relaxed);
        is_first.then_some(StallNews::Begins)
    }

    /// Notes that there was room for a block; `room` is the number of places in total.
    pub fn put(&mut self, backlog: &Backlog, room: usize) -> Option<StallNews> {
        if backlog.waiting.load(Ordering::Relaxed) > room / 2 {
            return None;
        }
        self.over(backlog)
    }

    /// Notes that all blocks that waited are written.
    pub fn over(&mut self, backlog: &Backlog) -> Option<StallNews> {
        let (since, lost) = self.since.take()?;
        backlog.is_stalled.store(false, Ordering::Relaxed);
        Some(StallNews::Ends(since, lost))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disk_that_works_off_a_full_queue_has_stalled_once() {
        let (backlog, mut stall, now) = (Backlog::default(), DiskStall::default(), Instant::now());
        for _ in 0..4 {
            backlog.put();
            assert_eq!(stall.put(&backlog, 4), None);
        }
        assert_eq!(stall.left_out(&backlog, now), Some(StallNews::Begins));
        assert_eq!(stall.left_out(&backlog, now), None);
        // There is room for one block, then for none, then for one.
        backlog.taken();
        backlog.put();
        assert_eq!(stall.put(&backlog, 4), None);
        assert_eq!(stall.left_out(&backlog, now), None);
        assert!(backlog.is_stalled());
        (0..3).for_each(|_| backlog.taken());
        backlog.put();
        assert_eq!(stall.put(&backlog, 4), Some(StallNews::Ends(now, 3)));
        assert!(!backlog.is_stalled());
        backlog.put();
        assert_eq!(stall.put(&backlog, 4), None);
        assert_eq!(stall.over(&backlog), None);
    }
}
