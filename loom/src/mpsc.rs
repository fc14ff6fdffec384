//! A bounded channel on loom's lock, in place of the standard library's, which loom lacks. A receiver
//! that finds nothing does not wait: the model calls it again.

use std::collections::VecDeque;
pub use std::sync::mpsc::{RecvTimeoutError, TrySendError};
use std::time::Duration;

use loom::sync::{Arc, Mutex};

type Queue<T> = Arc<Mutex<VecDeque<T>>>;

pub struct SyncSender<T> {
    queue: Queue<T>,
    room: usize,
}

pub struct Receiver<T>(Queue<T>);

pub fn sync_channel<T>(room: usize) -> (SyncSender<T>, Receiver<T>) {
    let queue = Queue::<T>::default();
    (SyncSender { queue: Arc::clone(&queue), room }, Receiver(queue))
}

impl<T> Clone for SyncSender<T> {
    fn clone(&self) -> SyncSender<T> {
        SyncSender { queue: Arc::clone(&self.queue), room: self.room }
    }
}

impl<T> SyncSender<T> {
    pub fn try_send(&self, item: T) -> Result<(), TrySendError<T>> {
        let mut queue = self.queue.lock().unwrap();
        if queue.len() == self.room {
            return Err(TrySendError::Full(item));
        }
        queue.push_back(item);
        Ok(())
    }
}

impl<T> Receiver<T> {
    pub fn recv_timeout(&self, _: Duration) -> Result<T, RecvTimeoutError> {
        self.0.lock().unwrap().pop_front().ok_or(RecvTimeoutError::Timeout)
    }
}
