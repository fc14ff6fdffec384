//! Limits requests that cost much: one at a time, during at most half of the time.
//!
//! A dry run reads and checks files like a reload, and changes nothing. A recording can have many
//! megabytes. Only this limit prevents clients from requesting them without end. Used by
//! `daemon::reload` for all dry runs together, and by `daemon::operator_server` for the recordings
//! of each user.

use std::sync::Arc;

use tokio::sync::{Mutex, OwnedMutexGuard};
use tokio::time::{Instant, sleep_until};

/// Gives one turn at a time.
#[derive(Clone)]
pub(super) struct Turns {
    /// The earliest start of the next turn.
    next: Arc<Mutex<Instant>>,
}

/// A turn; dropping it ends the turn.
pub(super) struct Turn {
    next: OwnedMutexGuard<Instant>,
    began: Instant,
}

impl Turns {
    pub fn new() -> Turns {
        Turns { next: Arc::new(Mutex::new(Instant::now())) }
    }

    /// Waits for the next turn. Before a turn there is a pause as long as the last turn took.
    pub async fn turn(&self) -> Turn {
        Turn::after_pause(Arc::clone(&self.next).lock_owned().await).await
    }

    /// Does the same; `None` while somebody else has a turn or waits in its pause.
    pub async fn try_turn(&self) -> Option<Turn> {
        Some(Turn::after_pause(Arc::clone(&self.next).try_lock_owned().ok()?).await)
    }

    /// Whether the next turn would not come at once.
    pub fn is_busy(&self) -> bool {
        self.next.try_lock().map_or(true, |next| *next > Instant::now())
    }
}

impl Turn {
    async fn after_pause(next: OwnedMutexGuard<Instant>) -> Turn {
        sleep_until(*next).await;
        Turn { next, began: Instant::now() }
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        let ended = Instant::now();
        *self.next = ended + (ended - self.began);
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use tokio::time::sleep;

    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[tokio::test(start_paused = true)]
    async fn requests_are_answered_one_at_a_time_with_equal_pauses() {
        let (turns, start) = (Turns::new(), Instant::now());
        let long = async {
            let _turn = turns.turn().await;
            sleep(5 * SECOND).await;
        };
        let second = async {
            sleep(SECOND).await;
            turns.try_turn().await.is_none() && turns.is_busy()
        };
        assert!(tokio::join!(long, second).1, "refused while the first one is under way");
        assert!(turns.is_busy(), "it rests");
        assert!(turns.try_turn().await.is_some());
        assert_eq!(start.elapsed(), 10 * SECOND);
        drop(turns.turn().await);
        assert_eq!(start.elapsed(), 10 * SECOND);
        assert!(!turns.is_busy());
    }

    #[tokio::test(start_paused = true)]
    async fn clients_are_served_in_order_of_arrival() {
        let (turns, start) = (Turns::new(), Instant::now());
        let client = || async {
            let _turn = turns.turn().await;
            let began = start.elapsed();
            sleep(SECOND).await;
            began
        };
        let began = tokio::join!(client(), client(), client());
        assert_eq!(began, (Duration::ZERO, 2 * SECOND, 4 * SECOND));
    }
}
