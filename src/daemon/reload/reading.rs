//! Reads and checks files on a separate thread, within a time limit. Called by `daemon::reload`.
//!
//! After the limit, the [`Progress`] makes the load stop, and its thread ends; the answer names the
//! step that took longest. A thread within a system call (a stalled network mount) cannot be ended:
//! it ends when the mount answers, and its result is dropped. The number of such threads is
//! limited.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use tokio::sync::oneshot;
use tokio::time::timeout;

use crate::daemon::narration::span;
use crate::progress::{Progress, Step};

/// The greatest number of threads that still run after the limit.
const LEFT_MAX: usize = 4;
/// The stack of a loading thread: the same size as a main thread's.
const STACK_BYTES: usize = 8 << 20;

/// Reads files, each time on a separate thread.
pub(super) struct FileReader {
    limit: Duration,
    threads: Arc<AtomicUsize>,
}

/// Counts a thread until it ends, even if it panics.
struct Counted(Arc<AtomicUsize>);

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

impl FileReader {
    pub fn new(limit: Duration) -> FileReader {
        FileReader { limit, threads: Arc::default() }
    }

    /// Does the work on a separate thread; `Err` is the reason why there is no result.
    pub async fn done<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Progress) -> T + Send + 'static,
    ) -> Result<T, String> {
        let counted = Counted(Arc::clone(&self.threads));
        if self.threads.fetch_add(1, Ordering::AcqRel) >= LEFT_MAX {
            return Err(format!(
                "{LEFT_MAX} earlier reloads still wait for the system to read their files: the \
                 disk or network mount does not answer."
            ));
        }
        let (tell, told) = oneshot::channel();
        let progress = Progress::new();
        let named = thread::Builder::new().name("rungd-reload".into()).stack_size(STACK_BYTES);
        let started = named.spawn({
            let progress = progress.clone();
            move || {
                let _counted = counted;
                let _ = tell.send(work(&progress));
            }
        });
        started.map_err(|error| format!("no thread to read the files: {error}."))?;
        match timeout(self.limit, told).await {
            Ok(Ok(done)) => Ok(done),
            Ok(Err(_)) => Err("a bug in rungd: see the log.".to_owned()),
            Err(_) => {
                progress.end();
                Err(too_long(self.limit, &progress))
            }
        }
    }
}

/// The message after the limit: it contains the limit, and the step that took longest.
fn too_long(limit: Duration, progress: &Progress) -> String {
    let limit = span(limit.as_nanos() as u64);
    match progress.longest() {
        Some(step @ Step::Reading(_)) => format!(
            "the files were not read and checked within {limit}. What took longest was {step}: \
             does the disk or network mount answer?"
        ),
        Some(step) => format!(
            "the files were not read and checked within {limit}. What took longest was {step}."
        ),
        None => format!("no thread began to read the files within {limit}."),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use tokio::task::yield_now;

    use super::*;

    /// The error of `done` for work that begins a step and then takes longer than the limit.
    async fn given_up(
        reader: &FileReader,
        wait: impl FnOnce(&Progress) + Send + 'static,
    ) -> String {
        let (begun, mut has_begun) = oneshot::channel();
        let done = reader.done(move |progress| {
            progress.begin(Step::Names);
            let _ = begun.send(());
            wait(progress);
        });
        // Virtual time stands still while a task is ready. This task is ready until the step has
        // begun.
        let begun = async {
            while has_begun.try_recv().is_err() {
                yield_now().await
            }
        };
        tokio::join!(done, begun).0.unwrap_err()
    }

    /// The result of `done` for short work, while virtual time stands still.
    async fn judged(reader: &FileReader) -> Result<i32, String> {
        let ended = async {
            while reader.threads.load(Ordering::Acquire) > 0 {
                yield_now().await;
            }
        };
        tokio::join!(reader.done(|_| 7), ended).0
    }

    #[tokio::test(start_paused = true)]
    async fn a_load_whose_time_is_over_ends_and_its_step_is_named() {
        let reader = FileReader::new(Duration::from_secs(30));
        assert_eq!(judged(&reader).await, Ok(7));
        for _ in 0..=2 * LEFT_MAX {
            let said = given_up(&reader, |progress| {
                while !progress.is_over() {
                    thread::yield_now();
                }
            });
            let said = said.await;
            let wanted = "within 30s. What took longest was looking up names.";
            assert!(said.ends_with(wanted), "{said}");
            while reader.threads.load(Ordering::Acquire) > 0 {
                thread::yield_now();
            }
        }
        assert_eq!(judged(&reader).await, Ok(7), "a correct file is judged after all of them");
    }

    #[tokio::test(start_paused = true)]
    async fn threads_that_the_system_holds_are_few_and_the_file_is_named() {
        let reader = FileReader::new(Duration::from_secs(30));
        let mut ends = Vec::new();
        for _ in 0..LEFT_MAX {
            let (end, wait) = channel::<()>();
            ends.push(end);
            let said = given_up(&reader, move |progress| {
                progress.begin(Step::Reading("/mnt/line.toml".to_owned()));
                let _ = wait.recv();
            });
            let said = said.await;
            assert!(said.contains("within 30s"), "{said}");
        }
        let refused = reader.done(|_| 7).await.unwrap_err();
        assert!(refused.contains("4 earlier reloads still wait for the system"), "{refused}");
        drop(ends);
        while reader.threads.load(Ordering::Acquire) > 0 {
            thread::yield_now();
        }
        assert_eq!(judged(&reader).await, Ok(7), "when they have ended it is as before");
    }

    #[test]
    fn a_file_that_does_not_come_is_the_disks_cause_and_nothing_else_is() {
        let said = |step| {
            let progress = Progress::new();
            progress.begin(step);
            too_long(Duration::from_secs(30), &progress)
        };
        let read = said(Step::Reading("a.toml".to_owned()));
        assert!(read.contains("reading `a.toml`: does the disk or network mount"), "{read}");
        let rule = said(Step::Rule("unused-tag"));
        assert!(rule.ends_with("What took longest was the rule `unused-tag`."), "{rule}");
    }

    #[tokio::test]
    async fn a_panic_is_told() {
        let reader = FileReader::new(Duration::from_secs(9));
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let bug: Result<(), String> = reader.done(|_| panic!("no")).await;
        std::panic::set_hook(hook);
        assert!(bug.unwrap_err().contains("a bug in rungd"));
    }
}
