//! Whether the disk of the scan log stalls: it does from the first block that found no room, until
//! half of the room is free again.
//!
//! Used by `record_disk`, whose two threads share it. A disk that works off a full queue has room
//! for one block, then for none, then for one: that is one stall, told once.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

/// The blocks that wait for the disk, and whether it stalls.
#[derive(Debug, Default)]
pub(super) struct Backlog {
    waiting: AtomicUsize,
    is_stalled: AtomicBool,
}

/// What the thread that hands blocks over knows of a stall.
#[derive(Debug, Default)]
pub(super) struct DiskStall {
    /// Since when, and the blocks that were left out.
    since: Option<(Instant, u64)>,
}

/// What is told of a stall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StallNews {
    Begins,
    /// It began then; this number of blocks was left out.
    Ends(Instant, u64),
}

impl Backlog {
    /// A block waits.
    pub fn put(&self) {
        self.waiting.fetch_add(1, Ordering::Relaxed);
    }

    /// The disk has taken a block.
    pub fn taken(&self) {
        self.waiting.fetch_sub(1, Ordering::Relaxed);
    }

    /// Whether the disk stalls.
    pub fn is_stalled(&self) -> bool {
        self.is_stalled.load(Ordering::Relaxed)
    }
}

impl DiskStall {
    /// There was no room for a block.
    pub fn left_out(&mut self, backlog: &Backlog, now: Instant) -> Option<StallNews> {
        let is_first = self.since.is_none();
        self.since.get_or_insert((now, 0)).1 += 1;
        backlog.is_stalled.store(true, Ordering::Relaxed);
        is_first.then_some(StallNews::Begins)
    }

    /// There was room for a block, of `room` in all.
    pub fn put(&mut self, backlog: &Backlog, room: usize) -> Option<StallNews> {
        if backlog.waiting.load(Ordering::Relaxed) > room / 2 {
            return None;
        }
        self.over(backlog)
    }

    /// All blocks that waited are written.
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
        // Room for one, for none, for one.
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
