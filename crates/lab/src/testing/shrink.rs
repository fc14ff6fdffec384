//! Makes a failing random run short: first the fewest changes that still break a line of `always`,
//! then the shortest times between them.
//!
//! Called by `runner` with a run that broke a line; `pasted` prints the result. Each attempt plays
//! the run again, so the result is known to break a line, and is one that the generator could have
//! made: a word that walks still takes steps. The number of scans of all attempts is limited.

use super::lowered_suite::LoweredSuite;
use super::random_run::{BrokenRun, RandomEvent, replay};
use super::suite::RandomTest;

/// The maximum number of scans of all attempts together.
const SCANS_MAX: u64 = 4_000_000;

/// A search in progress.
struct Shrinking<'a> {
    stage: LoweredSuite<'a>,
    test: &'a RandomTest,
    best: BrokenRun,
    scans_left: u64,
}

/// The shortest failing run that was found.
pub(super) fn shrink(stage: LoweredSuite, test: &RandomTest, broken: BrokenRun) -> BrokenRun {
    let mut search = Shrinking { stage, test, best: broken, scans_left: SCANS_MAX };
    loop {
        let before = (search.best.events.len(), search.best.scan);
        search.drop_events();
        search.close_gaps();
        if (search.best.events.len(), search.best.scan) == before {
            return search.best;
        }
    }
}

impl Shrinking<'_> {
    /// Plays a run; if it breaks a line, it becomes the best run. Returns whether it does.
    fn attempt(&mut self, mut events: Vec<RandomEvent>) -> bool {
        let scans = self.best.scan + 1;
        if self.scans_left < scans {
            return false;
        }
        events.sort_by_key(|event| (event.scan, event.source));
        let broken = replay(self.stage, self.test, &events, scans);
        self.scans_left -= broken.as_ref().map_or(scans, |broken_run| broken_run.scan + 1);
        let Some(broken) = broken else { return false };
        self.best = broken;
        true
    }

    /// Removes changes: halves, then quarters …, then one by one.
    fn drop_events(&mut self) {
        let mut size = self.best.events.len().max(1);
        loop {
            // From the end, because late changes depend on early changes.
            let mut end = self.best.events.len();
            while end > 0 {
                let from = end.saturating_sub(size);
                let mut events = self.best.events.clone();
                events.drain(from..end);
                self.attempt(events);
                end = from.min(self.best.events.len());
            }
            if size == 1 {
                return;
            }
            size = size.div_ceil(2);
        }
    }

    /// Moves each change as close to the change before as possible; all later changes move with it.
    fn close_gaps(&mut self) {
        let mut at = 0;
        while at < self.best.events.len() {
            let events = &self.best.events;
            let before = at.checked_sub(1).map_or(0, |before| events[before].scan);
            let gap = events[at].scan - before;
            self.close_gap(at, gap);
            at += 1;
        }
    }

    /// Finds a short gap before a change by bisection.
    fn close_gap(&mut self, at: usize, gap: u64) {
        let (mut low, mut high) = (0, gap);
        while low < high && at < self.best.events.len() {
            let middle = low + (high - low) / 2;
            let mut events = self.best.events.clone();
            events[at..].iter_mut().for_each(|event| event.scan -= high - middle);
            match self.attempt(events) {
                true => high = middle,
                false => low = middle + 1,
            }
        }
    }
}
