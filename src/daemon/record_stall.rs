//! Whether the disk of the scan log stalls, and how far it is behind. A stall begins with the first
//! block that finds no room, and ends when half of the room is free again. The copy on disk is
//! behind by the age of the oldest block that is not durable yet.
//!
//! Used by `record_disk`, whose two threads share it. While a disk works off a full queue, there is
//! room for one block, then for none, then for one again: this counts as one stall and is reported
//! once.

use std::collections::VecDeque;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use rungd_base::locked::locked;

/// The log reports a copy that is further behind than this.
const BEHIND_MOST: Duration = Duration::from_secs(5);
/// The log reports the end once the copy is this close again: a slow disk is never as close.
const CLOSE: Duration = Duration::from_secs(1);

/// The blocks that wait for the disk, and whether it stalls.
#[derive(Debug, Default)]
pub(super) struct Backlog {
    waiting: AtomicUsize,
    is_stalled: AtomicBool,
    /// The times at which the blocks were handed over that are not durable yet. There are at most
    /// as many as wait, and as the disk takes before it makes them durable.
    handed: Mutex<VecDeque<Instant>>,
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
    pub fn put(&self, now: Instant) {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        locked(&self.handed).push_back(now);
    }

    /// Takes back the count of a block that found no room.
    pub fn refused(&self) {
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        locked(&self.handed).pop_back();
    }

    /// Counts a block that the disk has taken.
    pub fn taken(&self) {
        self.waiting.fetch_sub(1, Ordering::Relaxed);
    }

    /// Notes that the oldest blocks wait no more: they are durable, or lost.
    pub fn settled(&self, count: usize) {
        let mut handed = locked(&self.handed);
        let count = count.min(handed.len());
        handed.drain(..count);
    }

    /// How far the copy on disk is behind.
    pub fn behind(&self, now: Instant) -> Duration {
        let oldest = locked(&self.handed).front().copied();
        oldest.map_or(Duration::ZERO, |oldest| now.saturating_duration_since(oldest))
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

/// A disk that is behind, as the log reports it: once, and once when it is over.
#[derive(Debug, Default)]
pub(super) struct DiskLag {
    /// When the copy was first too far behind, and the most that it was behind.
    since: Option<(Instant, Duration)>,
}

/// A report about a disk that is behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LagNews {
    /// The copy is this far behind.
    Begins(Duration),
    /// When it began, and the most that the copy was behind.
    Ends(Instant, Duration),
}

impl DiskLag {
    /// Looks at how far the copy is behind.
    pub fn look(&mut self, behind: Duration, now: Instant) -> Option<LagNews> {
        match &mut self.since {
            None if behind > BEHIND_MOST => {
                self.since = Some((now, behind));
                Some(LagNews::Begins(behind))
            }
            None => None,
            Some((since, most)) if behind < CLOSE => {
                let news = LagNews::Ends(*since, *most);
                self.since = None;
                Some(news)
            }
            Some((_, most)) => {
                *most = behind.max(*most);
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disk_that_works_off_a_full_queue_counts_as_one_stall() {
        let (backlog, mut stall, now) = (Backlog::default(), DiskStall::default(), Instant::now());
        for _ in 0..4 {
            backlog.put(now);
            assert_eq!(stall.put(&backlog, 4), None);
        }
        assert_eq!(stall.left_out(&backlog, now), Some(StallNews::Begins));
        assert_eq!(stall.left_out(&backlog, now), None);
        // There is room for one block, then for none, then for one.
        backlog.taken();
        backlog.put(now);
        assert_eq!(stall.put(&backlog, 4), None);
        assert_eq!(stall.left_out(&backlog, now), None);
        assert!(backlog.is_stalled());
        (0..3).for_each(|_| backlog.taken());
        backlog.put(now);
        assert_eq!(stall.put(&backlog, 4), Some(StallNews::Ends(now, 3)));
        assert!(!backlog.is_stalled());
        backlog.put(now);
        assert_eq!(stall.put(&backlog, 4), None);
        assert_eq!(stall.over(&backlog), None);
    }

    /// One block a second, and a disk that needs `sync_s` for each sync and drains its queue
    /// before.
    /// Returns the times of the reports and the most that the copy was behind, in seconds.
    fn lag_of(sync_s: u64, seconds: u64) -> (Vec<(u64, bool)>, u64) {
        let (backlog, mut lag, begin) = (Backlog::default(), DiskLag::default(), Instant::now());
        let (mut told, mut most, mut taken, mut done_s) = (Vec::new(), 0, 0, 0);
        for at in 0..seconds {
            let now = begin + Duration::from_secs(at);
            backlog.put(now);
            let sync_s = if at < seconds / 2 { sync_s } else { 0 };
            if at >= done_s {
                backlog.settled(taken);
                taken = backlog.waiting.swap(0, Ordering::Relaxed);
                done_s = at + sync_s;
                if sync_s == 0 {
                    backlog.settled(std::mem::take(&mut taken));
                }
            }
            let behind = backlog.behind(now);
            most = behind.as_secs().max(most);
            let news = lag.look(behind, now);
            told.extend(news.map(|news| (at, matches!(news, LagNews::Begins(_)))));
        }
        (told, most)
    }

    #[test]
    fn a_slow_disk_lags_by_two_syncs_and_is_reported_once() {
        // The oldest block of a batch waited almost one sync, and is durable after the next one:
        // looked at once a second, two syncs less two seconds.
        assert_eq!(lag_of(2, 200), (vec![], 2));
        assert_eq!(lag_of(3, 200), (vec![], 4));
        let (told, most) = lag_of(10, 200);
        assert!(matches!(told[..], [(6, true), (end, false)] if end >= 100), "{told:?}");
        assert!((15..=20).contains(&most), "{most}");
    }
}
