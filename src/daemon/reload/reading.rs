//! Reads and checks files on a separate thread, within a time limit. Called by `daemon::reload`.
//!
//! After the limit, the [`Progress`] makes the load stop, and its thread ends; the answer names the
//! step that took longest. A thread within a system call (a stalled network mount) cannot be ended:
//! it ends when the mount answers, and its result is dropped. The number of such threads is
//! limited; a refusal for this reason names the steps of the threads.

use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use tokio::sync::oneshot;
use tokio::time::timeout;

use rungd_base::duration_text::duration_text;
use rungd_base::locked::locked;
use rungd_base::progress::{LoadStep, Progress};

/// The greatest number of threads that still run after the limit.
const LEFT_MAX: usize = 4;
/// The stack of a loading thread: the same size as a main thread's.
const STACK_BYTES: usize = 8 << 20;

/// Reads files, each time on a separate thread.
pub(super) struct FileReader {
    limit: Duration,
    threads: Arc<Mutex<ReadingThreads>>,
}

/// The threads that have not ended.
#[derive(Default)]
struct ReadingThreads {
    /// The number of the next thread.
    next: u64,
    /// Each thread's number and progress.
    left: Vec<(u64, Progress)>,
}

/// Counts a thread until it ends, even if it panics.
struct CountedThread {
    threads: Arc<Mutex<ReadingThreads>>,
    number: u64,
}

impl Drop for CountedThread {
    fn drop(&mut self) {
        locked(&self.threads).left.retain(|(number, _)| *number != self.number);
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
        let progress = Progress::new();
        let counted = self.counted(&progress)?;
        let (tell, told) = oneshot::channel();
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

    /// Counts a thread with this progress; `Err` is the reason why there are too many.
    fn counted(&self, progress: &Progress) -> Result<CountedThread, String> {
        let mut threads = locked(&self.threads);
        if threads.left.len() >= LEFT_MAX {
            let steps: Vec<_> =
                threads.left.iter().map(|(_, progress)| progress.current()).collect();
            return Err(too_many(&steps));
        }
        let number = threads.next;
        threads.next += 1;
        threads.left.push((number, progress.clone()));
        Ok(CountedThread { threads: Arc::clone(&self.threads), number })
    }
}

/// The message while too many threads have not ended: it contains the number of threads at each
/// step. Only a thread that reads a file waits for the system; any other thread works.
fn too_many(steps: &[Option<LoadStep>]) -> String {
    let mut counts: Vec<((&str, String), usize)> = Vec::new();
    for step in steps {
        let part = match step {
            Some(step @ LoadStep::Reading(_)) => {
                ("wait", format!(" for the disk or network mount ({step})"))
            }
            Some(step) => ("work", format!(" on {step}")),
            None => ("begin", String::new()),
        };
        match counts.iter_mut().find(|(known, _)| *known == part) {
            Some((_, count)) => *count += 1,
            None => counts.push((part, 1)),
        }
    }
    let parts = counts.iter().map(|((verb, rest), count)| {
        let s = if *count == 1 { "s" } else { "" };
        format!("{count} {verb}{s}{rest}")
    });
    let parts: Vec<String> = parts.collect();
    format!("{} earlier reloads have not ended: {}.", steps.len(), parts.join(", "))
}

/// The message after the limit: it contains the limit, and the step that took longest.
fn too_long(limit: Duration, progress: &Progress) -> String {
    let limit = duration_text(limit.as_nanos() as u64);
    match progress.longest() {
        Some(step @ LoadStep::Reading(_)) => format!(
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

    /// The number of threads that have not ended.
    fn left(reader: &FileReader) -> usize {
        locked(&reader.threads).left.len()
    }

    /// The error of `done` for work that begins a step and then takes longer than the limit.
    async fn given_up(
        reader: &FileReader,
        step: LoadStep,
        wait: impl FnOnce(&Progress) + Send + 'static,
    ) -> String {
        let (begun, mut has_begun) = oneshot::channel();
        let done = reader.done(move |progress| {
            progress.begin(step);
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
            while left(reader) > 0 {
                yield_now().await;
            }
        };
        tokio::join!(reader.done(|_| 7), ended).0
    }

    #[tokio::test(start_paused = true)]
    async fn a_load_that_times_out_ends_and_its_step_is_named() {
        let reader = FileReader::new(Duration::from_secs(30));
        assert_eq!(judged(&reader).await, Ok(7));
        for _ in 0..=2 * LEFT_MAX {
            let said = given_up(&reader, LoadStep::Names, |progress| {
                while !progress.is_over() {
                    thread::yield_now();
                }
            });
            let said = said.await;
            let wanted = "within 30s. What took longest was looking up names.";
            assert!(said.ends_with(wanted), "{said}");
            while left(&reader) > 0 {
                thread::yield_now();
            }
        }
        assert_eq!(judged(&reader).await, Ok(7), "a correct file is judged after all of them");
    }

    #[tokio::test(start_paused = true)]
    async fn unfinished_load_threads_are_limited_and_their_steps_are_named() {
        let reading = || LoadStep::Reading("/mnt/line.toml".to_owned());
        let mixed = [reading(), LoadStep::Settings, LoadStep::Lowering, LoadStep::Settings];
        for (steps, said) in [
            (
                [reading(), reading(), reading(), reading()],
                "4 wait for the disk or network mount (reading `/mnt/line.toml`)",
            ),
            (
                mixed,
                "1 waits for the disk or network mount (reading `/mnt/line.toml`), 2 work on the \
                 settings of the controller file, 1 works on lowering the program",
            ),
        ] {
            let reader = FileReader::new(Duration::from_secs(30));
            let mut ends = Vec::new();
            for step in steps {
                let (end, wait) = channel::<()>();
                ends.push(end);
                let wait = move |_: &Progress| {
                    let _ = wait.recv();
                };
                let told = given_up(&reader, step, wait).await;
                assert!(told.contains("within 30s"), "{told}");
            }
            let refused = reader.done(|_| 7).await.unwrap_err();
            assert_eq!(refused, format!("4 earlier reloads have not ended: {said}."));
            drop(ends);
            while left(&reader) > 0 {
                thread::yield_now();
            }
            assert_eq!(judged(&reader).await, Ok(7), "when they have ended it is as before");
        }
    }

    #[test]
    fn only_a_slow_file_read_is_blamed_on_the_disk() {
        let said = |step| {
            let progress = Progress::new();
            progress.begin(step);
            too_long(Duration::from_secs(30), &progress)
        };
        let read = said(LoadStep::Reading("a.toml".to_owned()));
        assert!(read.contains("reading `a.toml`: does the disk or network mount"), "{read}");
        let rule = said(LoadStep::Rule("unused-tag"));
        assert!(rule.ends_with("What took longest was the rule `unused-tag`."), "{rule}");
    }

    #[tokio::test]
    async fn a_panic_of_a_load_is_reported() {
        let reader = FileReader::new(Duration::from_secs(9));
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let bug: Result<(), String> = reader.done(|_| panic!("no")).await;
        std::panic::set_hook(hook);
        assert!(bug.unwrap_err().contains("a bug in rungd"));
    }
}
