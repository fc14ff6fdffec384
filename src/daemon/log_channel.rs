//! The bounded channel of log lines, with the counts of the lines that wait and that were dropped.
//!
//! Any number of threads send lines, and none of them waits; one thread receives them. The counts
//! only count: lines and requests go through the channel, so no other order of memory matters than
//! that of the steps here. `loom/` executes this file in every order of its accesses.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::Duration;

/// What goes through the channel.
pub(super) enum LogItem<T> {
    /// A line.
    Line(T),
    /// Requests an answer once all earlier lines are written.
    Flush(SyncSender<()>),
}

/// The number of lines that may wait.
#[derive(Clone, Copy)]
pub(super) struct LogRoom {
    /// If this many lines wait, details are dropped.
    pub details: usize,
    /// If this many lines wait, all lines are dropped.
    pub lines: usize,
}

#[derive(Default)]
struct LineCounts {
    waiting: AtomicUsize,
    /// The dropped lines that the log has not reported yet.
    dropped: AtomicU64,
}

/// The sending end. Cheap to clone.
pub(super) struct LineSender<T> {
    sender: SyncSender<LogItem<T>>,
    counts: Arc<LineCounts>,
    room: LogRoom,
}

impl<T> Clone for LineSender<T> {
    fn clone(&self) -> LineSender<T> {
        let (sender, counts) = (self.sender.clone(), Arc::clone(&self.counts));
        LineSender { sender, counts, room: self.room }
    }
}

/// The receiving end.
pub(super) struct LineReceiver<T> {
    receiver: Receiver<LogItem<T>>,
    counts: Arc<LineCounts>,
}

/// Both ends of an empty channel.
pub(super) fn line_channel<T>(room: LogRoom) -> (LineSender<T>, LineReceiver<T>) {
    let (sender, receiver) = sync_channel(room.lines);
    let counts = Arc::new(LineCounts::default());
    let sender = LineSender { sender, counts: Arc::clone(&counts), room };
    (sender, LineReceiver { receiver, counts })
}

impl<T> LineSender<T> {
    /// Hands a line over; false if it was dropped, and counted as such. Never waits.
    pub fn send(&self, line: T, is_detail: bool) -> bool {
        let is_crowded = is_detail && self.waiting() >= self.room.details;
        // A line counts before it can be received, so that the count never falls below 0.
        self.counts.waiting.fetch_add(1, Ordering::Relaxed);
        let is_sent = !is_crowded && self.sender.try_send(LogItem::Line(line)).is_ok();
        if !is_sent {
            self.counts.waiting.fetch_sub(1, Ordering::Relaxed);
            self.counts.dropped.fetch_add(1, Ordering::Relaxed);
        }
        is_sent
    }

    /// Hands over the request for an answer, if there is room.
    ///
    /// # Errors
    /// There is no room, or no receiver.
    pub fn request_flush(&self, done: SyncSender<()>) -> Result<(), TrySendError<LogItem<T>>> {
        self.sender.try_send(LogItem::Flush(done))
    }

    /// The number of lines that wait.
    pub fn waiting(&self) -> usize {
        self.counts.waiting.load(Ordering::Relaxed)
    }

    /// The number of dropped lines that the log has not reported yet.
    #[cfg(test)]
    pub fn dropped(&self) -> u64 {
        self.counts.dropped.load(Ordering::Relaxed)
    }
}

impl<T> LineReceiver<T> {
    /// The next item.
    ///
    /// # Errors
    /// None came within this time, or all senders are gone.
    pub fn receive(&self, within: Duration) -> Result<LogItem<T>, RecvTimeoutError> {
        let item = self.receiver.recv_timeout(within)?;
        if let LogItem::Line(_) = item {
            self.counts.waiting.fetch_sub(1, Ordering::Relaxed);
        }
        Ok(item)
    }

    /// Counts lines as dropped, until the log reports them.
    pub fn count_dropped(&self, lines: u64) {
        self.counts.dropped.fetch_add(lines, Ordering::Relaxed);
    }

    /// Takes the number of dropped lines, to report it.
    pub fn take_dropped(&self) -> u64 {
        self.counts.dropped.swap(0, Ordering::Relaxed)
    }
}
