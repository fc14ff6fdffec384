//! A pace: the least time between two turns, over all clients.
//!
//! Used by the server for clients that connect, and by sessions for requests. A single client does
//! not wait. A crowd waits in the order of arrival, and costs the machine no more turns than the
//! pace allows.

use std::future::poll_fn;
use std::pin::pin;
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};
use tokio::time::{Instant, sleep_until};

use rungd_base::locked::locked;

/// All turns of a pace together take at most 1/`SHARE` of the thread's time.
const SHARE: u32 = 3;

/// The processor time that this thread has used.
fn thread_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), u32::try_from(time.tv_nsec).unwrap_or(0))
}

/// A future's output, and the processor time that its steps took on this thread. Other tasks of the
/// thread that run while it waits are not counted.
pub(super) async fn metered<F: Future>(future: F) -> (F::Output, Duration) {
    let (mut future, mut cost) = (pin!(future), Duration::ZERO);
    let output = poll_fn(|context| {
        let began = thread_time();
        let polled = future.as_mut().poll(context);
        cost += thread_time().saturating_sub(began);
        polled
    });
    (output.await, cost)
}

/// Gives turns in order.
pub(super) struct TurnPace {
    every: Duration,
    /// The most time that unused turns save up for a later crowd.
    saved_max: Duration,
    next: Mutex<Instant>,
    /// The queue of the waiting clients. The first of them holds the lock.
    waiting: tokio::sync::Mutex<()>,
}

impl TurnPace {
    /// One turn per `every`. After a rest, `at_once` turns need no wait.
    pub fn new(every: Duration, at_once: u32) -> TurnPace {
        TurnPace {
            every,
            saved_max: every * at_once,
            next: Mutex::new(Instant::now()),
            waiting: tokio::sync::Mutex::default(),
        }
    }

    /// Takes the next turn; returns its time.
    pub fn take(&self, now: Instant) -> Instant {
        let mut next = self.next();
        let saved = now.checked_sub(self.saved_max).unwrap_or(now);
        let turn = (*next).max(saved);
        *next = turn + self.every;
        turn.max(now)
    }

    /// Waits for the next turn. A client that leaves before its turn takes none.
    pub async fn turn(&self) {
        let _first = self.waiting.lock().await;
        loop {
            let turn = *self.next();
            if turn <= Instant::now() {
                break;
            }
            sleep_until(turn).await;
        }
        self.take(Instant::now());
    }

    /// Delays the next turn if this one cost more than its share. The cost is measured by
    /// [`metered`], not by the time of day, so a busy machine delays no turn.
    pub fn charge(&self, cost: Duration) {
        *self.next() += (cost * SHARE).saturating_sub(self.every);
    }

    fn next(&self) -> MutexGuard<'_, Instant> {
        locked(&self.next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rare_requests_do_not_wait_and_frequent_requests_are_paced() {
        let ms = Duration::from_millis;
        let pace = TurnPace::new(ms(2), 3);
        let start = Instant::now() + ms(1000);
        let waits = |at: Instant| (0..6).map(|_| pace.take(at) - at).collect::<Vec<_>>();
        assert_eq!(waits(start), [ms(0), ms(0), ms(0), ms(0), ms(2), ms(4)]);
        assert_eq!(pace.take(start + ms(6)), start + ms(6));
        assert_eq!(pace.take(start + ms(100)), start + ms(100));
        assert_eq!(waits(start + ms(101))[..3], [ms(0), ms(0), ms(0)]);
    }

    #[tokio::test(start_paused = true)]
    async fn expensive_answers_leave_most_of_the_time_to_others() {
        let ms = Duration::from_millis;
        let pace = TurnPace::new(ms(1), 3);
        for (cost, least, most) in [(ms(10), ms(1450), ms(1540)), (ms(0), ms(45), ms(90))] {
            let start = Instant::now();
            for _ in 0..50 {
                pace.turn().await;
                pace.charge(cost);
            }
            assert!((least..=most).contains(&start.elapsed()), "{:?}", start.elapsed());
        }
    }

    #[tokio::test]
    async fn a_request_is_charged_only_for_its_own_work() {
        fn work() {
            let began = thread_time();
            while thread_time() - began < Duration::from_millis(50) {
                std::hint::spin_loop();
            }
        }
        let (working, waits) = (tokio::sync::Notify::new(), tokio::sync::Notify::new());
        let waiting = metered(async {
            waits.notify_one();
            working.notified().await;
        });
        let other = metered(async {
            waits.notified().await;
            work();
            working.notify_one();
        });
        let ((_, waiting), (_, other)) = tokio::join!(waiting, other);
        assert!(waiting < other / 2, "{waiting:?} of {other:?}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_client_that_leaves_before_its_turn_uses_no_turn() {
        let ms = Duration::from_millis;
        let pace = TurnPace::new(ms(20), 1);
        pace.turn().await;
        pace.turn().await;
        let start = Instant::now();
        for _ in 0..1000 {
            let waited = tokio::time::timeout(Duration::ZERO, pace.turn()).await;
            assert!(waited.is_err(), "it had to wait");
        }
        pace.turn().await;
        assert!(start.elapsed() <= ms(21), "{:?}", start.elapsed());
    }
}
