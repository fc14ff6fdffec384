//! What this machine keeps an ordinary thread from: a control for whatever goes by time.
//!
//! A thread wakes every two milliseconds, as a controller does, and notes how many of these moments
//! it slept through. A controller may miss what the metronome missed too.

use std::sync::{Mutex, Once, PoisonError};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

const BEAT: Duration = Duration::from_millis(2);

/// When it woke, and the time that it had slept too long.
static LATE: Mutex<Vec<(Instant, Duration)>> = Mutex::new(Vec::new());

/// Starts it, once in a process.
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

/// The time of these last moments in which it did not get a processor when it was due.
pub fn held_up_within(last: Duration) -> Duration {
    let late = LATE.lock().unwrap_or_else(PoisonError::into_inner);
    late.iter().rev().take_while(|(at, _)| at.elapsed() < last).map(|(_, late)| *late).sum()
}

/// The longest of them.
pub fn longest_within(last: Duration) -> Duration {
    let late = LATE.lock().unwrap_or_else(PoisonError::into_inner);
    let recent = late.iter().rev().take_while(|(at, _)| at.elapsed() < last);
    recent.map(|(_, late)| *late).max().unwrap_or_default()
}
