//! The tasks that wait at a port, and for what.
//!
//! `exchange` makes a [`PortWait`] for each of its waits; the monitor thread calls
//! [`Waiting::wake`] after everything that it has published. A task that waits for a certain image
//! sleeps until that image is there: an image of every scan would wake a device a thousand times a
//! second for outputs that have not changed. No time limit is set here.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Waker};

use super::image::Snapshot;
use rungd_base::locked::locked;

/// What an image must be to end a wait.
pub(super) type ImageCondition = Arc<dyn Fn(&Snapshot) -> bool + Send + Sync>;

/// The waiting tasks.
#[derive(Default)]
pub(super) struct Waiting {
    tasks: Mutex<WaitingTasks>,
}

#[derive(Default)]
struct WaitingTasks {
    /// The number of the newest wait.
    last: u64,
    all: Vec<WaitingTask>,
}

struct WaitingTask {
    /// The number of its wait.
    wait: u64,
    waker: Waker,
    /// `None`: it looks again after every change.
    wanted: Option<ImageCondition>,
}

impl Waiting {
    /// Wakes the tasks that have to look again; `latest` is the latest image.
    pub fn wake(&self, latest: impl FnOnce() -> Arc<Snapshot>) {
        let mut tasks = locked(&self.tasks);
        if tasks.all.is_empty() {
            return;
        }
        let latest = latest();
        let is_due = |task: &mut WaitingTask| task.wanted.as_ref().is_none_or(|is| is(&latest));
        let due: Vec<WaitingTask> = tasks.all.extract_if(.., is_due).collect();
        drop(tasks);
        due.into_iter().for_each(|task| task.waker.wake());
    }
}

/// A wait at a port: a future that ends with the result of `look`.
pub(super) struct PortWait<L> {
    waiting: Arc<Waiting>,
    look: L,
    wanted: Option<ImageCondition>,
    /// Its number, once it has waited.
    number: Option<u64>,
}

impl<L> PortWait<L> {
    /// A wait that calls `look` now, and after every change, or with `wanted` after every image
    /// that meets this condition.
    pub fn new(waiting: Arc<Waiting>, look: L, wanted: Option<ImageCondition>) -> PortWait<L> {
        PortWait { waiting, look, wanted, number: None }
    }
}

impl<T, L: FnMut() -> Option<T> + Unpin> Future for PortWait<L> {
    type Output = T;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<T> {
        let wait = &mut *self;
        let mut tasks = locked(&wait.waiting.tasks);
        // `look` is called under the lock. A thread that publishes a change takes the lock after
        // that: either this look finds the change, or this waker is called.
        if let Some(found) = (wait.look)() {
            return Poll::Ready(found);
        }
        let number = *wait.number.get_or_insert_with(|| {
            tasks.last += 1;
            tasks.last
        });
        match tasks.all.iter_mut().find(|task| task.wait == number) {
            Some(task) => task.waker.clone_from(context.waker()),
            None => {
                let (waker, wanted) = (context.waker().clone(), wait.wanted.clone());
                tasks.all.push(WaitingTask { wait: number, waker, wanted });
            }
        }
        Poll::Pending
    }
}

impl<L> Drop for PortWait<L> {
    fn drop(&mut self) {
        let Some(number) = self.number else { return };
        locked(&self.waiting.tasks).all.retain(|task| task.wait != number);
    }
}
