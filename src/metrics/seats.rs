//! Places for connections. One more than there are takes the place of the oldest connection that
//! waits for nothing: whoever opens connections and asks nothing keeps no scrape waiting.

use std::collections::VecDeque;
use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use tokio::sync::oneshot::{self, Receiver, Sender};

/// The places that are taken, the oldest first.
pub(super) struct Seats {
    max: usize,
    taken: VecDeque<(Sender<()>, Arc<AtomicU32>)>,
}

/// A place. It is free again when this value is dropped.
pub(super) struct Seat {
    left: Receiver<()>,
    answers: Answers,
}

/// The requests of a connection that wait for their answers.
#[derive(Clone)]
pub(super) struct Answers(Arc<AtomicU32>);

impl Seats {
    /// So many places.
    pub fn new(max: usize) -> Seats {
        Seats { max, taken: VecDeque::new() }
    }

    /// Takes a place; `None`: all connections wait for answers.
    pub fn take(&mut self) -> Option<Seat> {
        self.taken.retain(|(leave, _)| !leave.is_closed());
        if self.taken.len() >= self.max {
            let is_idle = |(_, of): &(_, Arc<AtomicU32>)| of.load(Ordering::Relaxed) == 0;
            let oldest = self.taken.iter().position(is_idle)?;
            self.taken.remove(oldest);
        }
        let (leave, left) = oneshot::channel();
        let answers = Answers(Arc::default());
        self.taken.push_back((leave, Arc::clone(&answers.0)));
        Some(Seat { left, answers })
    }
}

impl Seat {
    /// Counts the requests of its connection.
    pub fn answers(&self) -> Answers {
        self.answers.clone()
    }

    /// Is over with the conversation, or when its place is taken.
    pub async fn hold(mut self, conversation: impl Future<Output = ()>) {
        tokio::select! {
            () = conversation => {}
            _ = &mut self.left => {}
        }
    }
}

impl Answers {
    /// Waits for an answer, which its connection is not left without.
    pub async fn wait<T>(&self, answer: impl Future<Output = T>) -> T {
        self.0.fetch_add(1, Ordering::Relaxed);
        let answer = answer.await;
        self.0.fetch_sub(1, Ordering::Relaxed);
        answer
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::future::pending;

    #[tokio::test]
    async fn the_oldest_that_waits_for_nothing_goes() {
        let mut seats = Seats::new(2);
        let [mut asks, idle] = [0, 0].map(|_| seats.take().expect("a place"));
        let answers = asks.answers();
        let mut asking = Box::pin(answers.wait(pending::<()>()));
        assert!(futures_are_pending(&mut asking).await);
        let third = seats.take().expect("that of the second");
        idle.hold(pending()).await;
        assert!(asks.left.try_recv().is_err_and(|why| why == oneshot::error::TryRecvError::Empty));
        let third_answers = third.answers();
        let mut third_asks = Box::pin(third_answers.wait(pending::<()>()));
        assert!(futures_are_pending(&mut third_asks).await);
        assert!(seats.take().is_none(), "both wait for answers");
        drop(asks);
        assert!(seats.take().is_some());
    }

    /// Polls a future once.
    async fn futures_are_pending(future: &mut (impl Future<Output = ()> + Unpin)) -> bool {
        std::future::poll_fn(|cx| {
            std::task::Poll::Ready(std::pin::Pin::new(&mut *future).poll(cx).is_pending())
        })
        .await
    }
}
