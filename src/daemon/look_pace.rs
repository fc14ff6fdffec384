//! How often the shell looks at the scan thread.
//!
//! Called by `shell`. Nothing of the plant waits for a look: it feeds systemd's watchdog, and sees
//! the ends of a start, of a stop and of a probation. A controller that just runs needs few.

use std::time::{Duration, Instant};

/// The time between two looks while nothing is near.
const IDLE: Duration = Duration::from_millis(100);
/// The time between two looks while a start, a stop or a probation ends.
const NEAR: Duration = Duration::from_millis(20);
/// The time between two looks while a thread ends that has said so.
const ENDING: Duration = Duration::from_millis(1);
/// The longest time of such an end.
const ENDING_MAX: Duration = Duration::from_millis(100);
/// The looks within systemd's limit: it is fed four times.
const LOOKS_OF_LIMIT: u32 = 20;

/// The pace of the looks.
pub(super) struct LookPace {
    idle: Duration,
    ending: Option<Instant>,
}

impl LookPace {
    /// The pace for a limit of systemd's watchdog.
    pub fn new(limit: Option<Duration>) -> LookPace {
        let of_limit = limit.map_or(IDLE, |limit| limit / LOOKS_OF_LIMIT);
        LookPace { idle: IDLE.min(of_limit).max(ENDING), ending: None }
    }

    /// Notes that the monitor ends.
    pub fn end(&mut self) {
        self.ending = Some(Instant::now());
    }

    /// The time until the next look. `is_near`: a start, a stop or a probation is under way.
    pub fn next(&self, is_near: bool) -> Duration {
        match self.ending.is_some_and(|begin| begin.elapsed() < ENDING_MAX) {
            true => ENDING,
            false if is_near => NEAR.min(self.idle),
            false => self.idle,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shell_looks_ten_times_a_second_and_more_often_near_an_end() {
        let mut pace = LookPace::new(None);
        assert_eq!([pace.next(false), pace.next(true)], [IDLE, NEAR]);
        pace.end();
        assert_eq!([pace.next(false), pace.next(true)], [ENDING, ENDING]);
    }

    #[test]
    fn the_shell_looks_five_times_before_systemd_is_fed() {
        let pace = LookPace::new(Some(Duration::from_millis(400)));
        assert_eq!([pace.next(false), pace.next(true)], [NEAR, NEAR]);
        let pace = LookPace::new(Some(Duration::from_secs(30)));
        assert_eq!(pace.next(false), IDLE);
    }
}
