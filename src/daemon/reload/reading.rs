//! Reading files on a thread of its own, within a limit.
//!
//! A network mount that stalls holds up whoever reads from it, and nobody can call that off. So a
//! reload waits for its thread for so long and no longer; the thread may linger until the mount
//! comes back, and what it then has is dropped. Some may linger, and no more.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use tokio::sync::oneshot;
use tokio::time::timeout;

use crate::daemon::narration::span;

/// How many threads may linger.
const LINGER_MAX: usize = 4;
/// The stack of a thread that loads, as large as a main thread's.
const STACK_BYTES: usize = 8 << 20;

/// Where files are read.
pub(super) struct Reading {
    limit: Duration,
    threads: Arc<AtomicUsize>,
}

/// A thread that is there, until it is over, by a panic too.
struct There(Arc<AtomicUsize>);

impl Drop for There {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

impl Reading {
    pub fn new(limit: Duration) -> Reading {
        Reading { limit, threads: Arc::default() }
    }

    /// Does the work on a thread of its own; `Err` says why there is nothing of it.
    pub async fn done<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, String> {
        let there = There(Arc::clone(&self.threads));
        if self.threads.fetch_add(1, Ordering::AcqRel) >= LINGER_MAX {
            return Err(format!(
                "{LINGER_MAX} reloads before this one still wait for their files: what they lie \
                 on does not answer"
            ));
        }
        let (tell, told) = oneshot::channel();
        let named = thread::Builder::new().name("rungd-reload".into()).stack_size(STACK_BYTES);
        let started = named.spawn(move || {
            let _there = there;
            let _ = tell.send(work());
        });
        started.map_err(|error| format!("no thread to read the files: {error}"))?;
        match timeout(self.limit, told).await {
            Ok(Ok(done)) => Ok(done),
            Ok(Err(_)) => Err("a bug in rungd: see the log".to_owned()),
            Err(_) => Err(format!(
                "the files were not read and checked within {}: does what they lie on (a network \
                 mount, say) answer?",
                span(self.limit.as_nanos() as u64)
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    fn block_on<T>(future: impl Future<Output = T>) -> T {
        tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .build()
            .unwrap()
            .block_on(future)
    }

    #[test]
    fn what_does_not_come_in_time_is_given_up_and_some_may_linger() {
        let reading = Reading::new(Duration::from_millis(20));
        assert_eq!(block_on(reading.done(|| 7)), Ok(7));
        let (stalls, mut ends) = (LINGER_MAX, Vec::new());
        for _ in 0..stalls {
            let (end, wait) = channel::<()>();
            ends.push(end);
            let given_up = block_on(reading.done(move || wait.recv())).unwrap_err();
            assert!(given_up.contains("within 20ms"), "{given_up}");
        }
        let refused = block_on(reading.done(|| 7)).unwrap_err();
        assert!(refused.contains("still wait for their files"), "{refused}");
        drop(ends);
        while reading.threads.load(Ordering::Acquire) > 0 {
            thread::yield_now();
        }
        assert_eq!(block_on(reading.done(|| 7)), Ok(7), "when they are over it is as before");
    }

    #[test]
    fn a_panic_is_told() {
        let reading = Reading::new(Duration::from_secs(9));
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let bug: Result<(), String> = block_on(reading.done(|| panic!("no")));
        std::panic::set_hook(hook);
        assert!(bug.unwrap_err().contains("a bug in rungd"));
    }
}
