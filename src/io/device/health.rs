//! How a device is, for the log and for who looks: shared by its task and its readers.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tracing::error;

use crate::runtime::field::Exchanged;

/// How a device is. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Health {
    inner: Arc<Mutex<Reading>>,
    lines: Arc<Mutex<Lines>>,
}

/// How many lines of trouble a device may write: so many at once, one in ten seconds in the long
/// run. One that comes and goes all the time hides no other's.
#[derive(Debug)]
struct Lines {
    left: u32,
    filled: Instant,
    withheld: u64,
}

const LINES_MAX: u32 = 20;
const LINE_EVERY: Duration = Duration::from_secs(10);

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
        let lines = Lines { left: LINES_MAX, filled: Instant::now(), withheld: 0 };
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
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
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

    /// An exchange succeeded; gives what the trouble before it was.
    pub(super) fn good(&self, took: Duration) -> Option<String> {
        let mut reading = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        reading.exchanges += 1;
        reading.took = took;
        reading.took_max = reading.took_max.max(took);
        reading.trouble.take()
    }

    /// It is open, and the scan has exchanged so much by now.
    pub(super) fn open(&self, exchanged: Exchanged) {
        let mut reading = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        (reading.is_open, reading.exchanges) = (true, exchanged.count);
        reading.took = Duration::from_nanos(exchanged.last_ns);
        reading.took_max = Duration::from_nanos(exchanged.slowest_ns);
        reading.trouble = None;
    }

    /// Its task is gone, for this reason: nothing is exchanged any more.
    pub fn end(&self, reason: &str) {
        self.bad(reason);
        let reading = self.reading();
        let (device, peer) = (&reading.name, &reading.peer);
        error!(event = "device-ended", %device, %peer, "{device}: {reason}");
    }

    /// An exchange failed; true if the one before it had not, or for another reason.
    pub(super) fn bad(&self, reason: &str) -> bool {
        let mut reading = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        reading.failures += 1;
        reading.is_open = false;
        let is_news = reading.trouble.as_deref() != Some(reason);
        reading.trouble = Some(reason.to_owned());
        is_news
    }
}
