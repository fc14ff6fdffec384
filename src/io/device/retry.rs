//! When to try again: later each time, and never all devices at the same moment.

use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

/// The first wait, without jitter.
const FIRST: Duration = Duration::from_millis(100);
/// The longest, likewise.
const LONGEST: Duration = Duration::from_secs(5);

/// The waits between attempts to connect: doubled each time, up to five seconds, each between
/// half and three halves of that.
#[derive(Debug)]
pub(in crate::io) struct Retry {
    wait: Duration,
    random: RandomState,
    attempts: u64,
}

impl Retry {
    pub fn new() -> Retry {
        Retry { wait: FIRST, random: RandomState::new(), attempts: 0 }
    }

    /// The next wait.
    pub fn next(&mut self) -> Duration {
        let wait = self.wait;
        self.wait = (wait * 2).min(LONGEST);
        self.attempts += 1;
        let permille = self.random.hash_one(self.attempts) % 1000;
        wait / 2 + wait * permille as u32 / 1000
    }

    /// An exchange has succeeded: the next wait is a short one again.
    pub fn reset(&mut self) {
        self.wait = FIRST;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_grow_to_five_seconds_with_jitter_and_begin_anew() {
        let mut retry = Retry::new();
        for expected_ms in [100, 200, 400, 800, 1600, 3200, 5000, 5000] {
            let wait_ms = retry.next().as_millis();
            assert!((expected_ms / 2..=expected_ms * 3 / 2).contains(&wait_ms), "{wait_ms}");
        }
        retry.reset();
        assert!(retry.next() <= FIRST * 3 / 2);
    }

    #[test]
    fn two_devices_do_not_wait_alike() {
        let waits = |mut retry: Retry| (0..8).map(|_| retry.next()).collect::<Vec<_>>();
        assert_ne!(waits(Retry::new()), waits(Retry::new()));
    }
}
