//! Limits the dry runs of a reload: one at a time, during at most half of the time.
//!
//! A dry run reads and checks files like a reload, and changes nothing. Only this limit prevents
//! clients from requesting dry runs without end. Used by `daemon::reload`.

use std::future::Future;

use tokio::sync::Mutex;
use tokio::time::{Instant, sleep_until};

/// Lets one dry run through at a time.
pub(super) struct DryRuns {
    /// The earliest start of the next dry run.
    next: Mutex<Instant>,
}

impl DryRuns {
    pub fn new() -> DryRuns {
        DryRuns { next: Mutex::new(Instant::now()) }
    }

    /// Does a dry run; `None` while another dry run is under way. Before the start there is a pause
    /// as long as the last dry run took.
    pub async fn one<T>(&self, run: impl Future<Output = T>) -> Option<T> {
        let mut next = self.next.try_lock().ok()?;
        sleep_until(*next).await;
        let began = Instant::now();
        let done = run.await;
        let ended = Instant::now();
        *next = ended + (ended - began);
        Some(done)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use tokio::time::sleep;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn one_at_a_time_and_a_rest_as_long_as_the_last_one_took() {
        let (dry, start) = (DryRuns::new(), Instant::now());
        let long = dry.one(sleep(Duration::from_secs(5)));
        let second = async {
            sleep(Duration::from_secs(1)).await;
            dry.one(async {}).await
        };
        assert_eq!(tokio::join!(long, second), (Some(()), None));
        assert_eq!(dry.one(async { start.elapsed().as_secs() }).await, Some(10));
        assert_eq!(dry.one(async { start.elapsed().as_secs() }).await, Some(10));
    }
}
