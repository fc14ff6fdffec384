//! How a device is, for the log and who looks: shared by its task or keeper and its readers.
//!
//! The log hears edges: trouble begins, its reason changes, it is over. A device that comes and
//! goes all the time is limited to lines of its own, and hides no other's.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::runtime::field::Exchanged;
use crate::say::say;

/// How a device is. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Health {
    inner: Arc<Mutex<Reading>>,
    lines: Arc<Mutex<Lines>>,
}

/// So many lines of trouble a device may write at once.
const LINES_MAX: u32 = 20;
/// And one so often in the long run.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// What the log knows of it, and how much more it may be told.
#[derive(Debug)]
struct Lines {
    left: u32,
    filled: Instant,
    withheld: u64,
    /// Since when there is trouble.
    troubled: Option<Instant>,
    /// The log was told of that.
    is_told: bool,
}

/// What can be read of it.
#[derive(Clone, Debug, Default)]
pub struct Reading {
    /// Its name.
    pub name: String,
    /// Its driver's name.
    pub driver: &'static str,
    /// Whom it reaches.
    pub peer: String,
    /// Exchanges that succeeded since the start.
    pub exchanges: u64,
    /// Exchanges and connections that failed.
    pub failures: u64,
    /// How long the last good exchange took.
    pub took: Duration,
    /// How long the slowest one took.
    pub took_max: Duration,
    /// It is open, for the scan itself to exchange; not said of a device beside the scan.
    pub is_open: bool,
    /// Why the last one failed; nothing once one has succeeded again.
    pub trouble: Option<String>,
}

impl Health {
    /// Of a device that has not exchanged yet.
    pub fn new(name: &str, driver: &'static str, peer: String) -> Health {
        let reading = Reading { name: name.to_owned(), driver, peer, ..Reading::default() };
        let (left, filled) = (LINES_MAX, Instant::now());
        let lines = Lines { left, filled, withheld: 0, troubled: None, is_told: false };
        Health { inner: Arc::new(Mutex::new(reading)), lines: Arc::new(Mutex::new(lines)) }
    }

    /// As it is now.
    pub fn reading(&self) -> Reading {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Whether an exchange has succeeded since the start, or the first scan's will.
    pub fn has_exchanged(&self) -> bool {
        let reading = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        reading.exchanges > 0 || reading.is_open
    }

    /// Whether a line of trouble may be written, and what it adds of those that were not.
    pub fn may_tell(&self) -> Option<String> {
        let mut lines = self.lines();
        let earned = lines.filled.elapsed().as_secs() / LINE_EVERY.as_secs();
        if earned > 0 {
            let earned = u32::try_from(earned).unwrap_or(LINES_MAX);
            lines.left = lines.left.saturating_add(earned).min(LINES_MAX);
            lines.filled = Instant::now();
        }
        if lines.left == 0 {
            lines.withheld += 1;
            return None;
        }
        lines.left -= 1;
        Some(match std::mem::take(&mut lines.withheld) {
            0 => String::new(),
            withheld => format!(" ({withheld} lines about it were left out)"),
        })
    }

    /// An exchange succeeded.
    pub(super) fn good(&self, took: Duration) {
        {
            let mut reading = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            reading.exchanges += 1;
            reading.took = took;
            reading.took_max = reading.took_max.max(took);
            reading.trouble = None;
        }
        self.tell_well("exchanges again");
    }

    /// It is open, and the scan has exchanged so much by now.
    pub(super) fn open(&self, exchanged: Exchanged) {
        {
            let mut reading = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            (reading.is_open, reading.exchanges) = (true, exchanged.count);
            reading.took = Duration::from_nanos(exchanged.last_ns);
            reading.took_max = Duration::from_nanos(exchanged.slowest_ns);
            reading.trouble = None;
        }
        self.tell_well("is open again");
    }

    /// Its task is gone, for this reason: nothing is exchanged any more.
    pub fn end(&self, reason: &str) {
        self.bad(reason);
        let reading = self.reading();
        let (device, peer) = (&reading.name, &reading.peer);
        say!(DEVICE_ENDED, %device, %peer, "{device}: {reason}");
    }

    /// An exchange failed, or it could not be reached or opened.
    pub(super) fn trouble(&self, reason: &str) {
        let is_news = self.bad(reason);
        self.lines().troubled.get_or_insert_with(Instant::now);
        if !is_news {
            return;
        }
        let Some(withheld) = self.may_tell() else { return };
        self.lines().is_told = true;
        let reading = self.reading();
        let (device, peer) = (&reading.name, &reading.peer);
        say!(DEVICE_TROUBLE, %device, %peer, "{device}: {reason} ({peer}){withheld}");
    }

    /// Trouble is over, if there was any.
    fn tell_well(&self, again: &str) {
        let (since, is_told) = {
            let mut lines = self.lines();
            (lines.troubled.take(), std::mem::take(&mut lines.is_told))
        };
        let Some(lasted) = since.filter(|_| is_told).map(|since| since.elapsed()) else { return };
        let (reading, lasted_ms) = (self.reading(), lasted.as_millis() as u64);
        let (device, peer, seconds) = (&reading.name, &reading.peer, lasted.as_secs_f64());
        say!(
            DEVICE_WELL,
            %device, %peer, lasted_ms, "{device} {again} after {seconds:.1} s of trouble"
        );
    }

    fn lines(&self) -> MutexGuard<'_, Lines> {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts a failure; true if the one before it had not failed, or for another reason.
    fn bad(&self, reason: &str) -> bool {
        let mut reading = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        reading.failures += 1;
        reading.is_open = false;
        let is_news = reading.trouble.as_deref() != Some(reason);
        reading.trouble = Some(reason.to_owned());
        is_news
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_that_comes_and_goes_is_limited_by_itself_task_and_keeper_alike() {
        let health = Health::new("panel", "gpio", "/dev/gpiochip0".to_owned());
        for n in 0..50 {
            health.trouble(&format!("reason {n}"));
        }
        assert_eq!(health.lines().withheld, 30);
        assert_eq!(health.reading().failures, 50);
        health.good(Duration::ZERO);
        assert!(health.lines().troubled.is_none() && health.reading().trouble.is_none());
    }
}
