//! Measures how far this machine holds up an ordinary thread: a control for tests that depend on
//! time.
//!
//! A thread wakes every two milliseconds, as a controller does, and notes the beats that it
//! overslept. If the metronome missed beats, a controller may miss scans too.

use std::sync::{Mutex, Once, PoisonError};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

const BEAT: Duration = Duration::from_millis(2);

/// Each late wake-up: its time, and how late it was.
static LATE: Mutex<Vec<(Instant, Duration)>> = Mutex::new(Vec::new());

/// Starts the metronome, once per process.
pub fn begin() {
    static BEGUN: Once = Once::new();
    BEGUN.call_once(|| {
        spawn(|| {
            let mut next = Instant::now();
            loop {
                next += BEAT;
                sleep(next.saturating_duration_since(Instant::now()));
                let late = next.elapsed();
                if late >= BEAT {
                    next += late;
                    LATE.lock()
                        .unwrap_or_else(PoisonError::into_inner)
                        .push((Instant::now(), late));
                }
            }
        });
    });
}

/// The sum of the delays within the time `last` before now.
pub fn held_up_within(last: Duration) -> Duration {
    let late = LATE.lock().unwrap_or_else(PoisonError::into_inner);
    late.iter().rev().take_while(|(at, _)| at.elapsed() < last).map(|(_, late)| *late).sum()
}

/// The longest delay within the time `last` before now.
pub fn longest_within(last: Duration) -> Duration {
    let late = LATE.lock().unwrap_or_else(PoisonError::into_inner);
    let recent = late.iter().rev().take_while(|(at, _)| at.elapsed() < last);
    recent.map(|(_, late)| *late).max().unwrap_or_default()
}
