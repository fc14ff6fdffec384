//! A shelf of an alarm: who wants it, why, and when it ends.

use super::time::BookTime;
use rungd_client::operator::protocol::AlarmShelf;

/// How far the clock may run away before the end of a shelf is told anew: 2 s.
const CLOCK_SET_NS: u64 = 2_000_000_000;
const NS_PER_MS: u64 = 1_000_000;

/// A shelf that somebody wants.
#[derive(Clone, Debug)]
pub(in super::super) struct WantedShelf {
    pub who: String,
    pub why: String,
    /// The time until the alarm comes back, ms; `None`: out of service.
    pub for_ms: Option<u64>,
}

/// A shelf in the book.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct BookedShelf {
    pub shown: AlarmShelf,
    /// When the alarm comes back (CLOCK_MONOTONIC); `None`: it is out of service.
    pub until_ns: Option<u64>,
}

/// A shelf that ended without a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in super::super) struct EndedShelf {
    pub tag: String,
    pub text: String,
    pub shelf: AlarmShelf,
    pub why: ShelfEnd,
}

/// Why a shelf ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum ShelfEnd {
    /// Its time is over.
    TimeOver,
    /// The program says that the alarm is critical, and critical alarms are not shelved.
    Critical,
    /// The program does not have the alarm.
    Gone,
}

impl BookedShelf {
    /// A shelf from now on.
    pub fn new(wanted: WantedShelf, now: BookTime) -> BookedShelf {
        let WantedShelf { who, why, for_ms } = wanted;
        let for_ns = for_ms.map(|ms| ms.saturating_mul(NS_PER_MS));
        let until_ns = for_ns.map(|ns| now.unix_ns.saturating_add_unsigned(ns));
        BookedShelf {
            shown: AlarmShelf { who, why, since_ns: now.unix_ns, until_ns },
            until_ns: for_ns.map(|ns| now.at_ns.saturating_add(ns)),
        }
    }

    /// Tells the end by the present clock, if somebody has set the clock.
    pub fn follow_clock(&mut self, now: BookTime) {
        let (Some(until_ns), Some(shown)) = (self.until_ns, &mut self.shown.until_ns) else {
            return;
        };
        let is = now.unix_ns.saturating_add_unsigned(until_ns.saturating_sub(now.at_ns));
        if is.abs_diff(*shown) > CLOCK_SET_NS {
            *shown = is;
        }
    }
}
