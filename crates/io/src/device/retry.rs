//! The waits between attempts: longer each time, and random, so that devices do not all try at the
//! same moment.

use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

/// The waits between attempts to connect. The base doubles each time up to the longest; a wait is
/// a random time between half and one and a half of the base.
#[derive(Debug)]
pub(crate) struct Retry {
    first: Duration,
    longest: Duration,
    wait: Duration,
    random: RandomState,
    attempts: u64,
}

impl Retry {
    /// For attempts that never end: from 100 ms to 5 s.
    pub fn new() -> Retry {
        Retry::between(Duration::from_millis(100), Duration::from_secs(5))
    }

    /// For the two seconds at the end of the process: from 50 ms to 400 ms. These waits grow too:
    /// otherwise, devices that do not answer would keep a line busy that they share with other
    /// devices.
    pub fn at_the_end() -> Retry {
        Retry::between(Duration::from_millis(50), Duration::from_millis(400))
    }

    fn between(first: Duration, longest: Duration) -> Retry {
        Retry { first, longest, wait: first, random: RandomState::new(), attempts: 0 }
    }

    /// The next wait.
    pub fn next(&mut self) -> Duration {
        let wait = self.wait;
        self.wait = (wait * 2).min(self.longest);
        self.attempts += 1;
        let permille = self.random.hash_one(self.attempts) % 1000;
        wait / 2 + wait * permille as u32 / 1000
    }

    /// Makes the next wait short again, after an exchange has succeeded.
    pub fn reset(&mut self) {
        self.wait = self.first;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_grow_to_five_seconds_with_jitter_and_restart_after_a_reset() {
        let mut retry = Retry::new();
        for expected_ms in [100, 200, 400, 800, 1600, 3200, 5000, 5000] {
            let wait_ms = retry.next().as_millis();
            assert!((expected_ms / 2..=expected_ms * 3 / 2).contains(&wait_ms), "{wait_ms}");
        }
        retry.reset();
        assert!(retry.next() <= Duration::from_millis(150));
    }

    #[test]
    fn two_devices_wait_for_different_times() {
        let waits = |mut retry: Retry| (0..8).map(|_| retry.next()).collect::<Vec<_>>();
        assert_ne!(waits(Retry::new()), waits(Retry::new()));
    }
}
