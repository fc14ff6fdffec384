//! A limited number of connections at a time. If all slots are taken, a new connection takes the
//! slot of the oldest connection that awaits no answer, so that connections without a request do
//! not delay a scrape.

use std::collections::VecDeque;
use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use tokio::sync::oneshot::{self, Receiver, Sender};

/// The taken slots, the oldest first.
pub(super) struct ConnectionSlots {
    max: usize,
    taken: VecDeque<(Sender<()>, Arc<AtomicU32>)>,
}

/// A slot. Dropping this value frees it.
pub(super) struct ConnectionSlot {
    left: Receiver<()>,
    answers: AwaitedAnswers,
}

/// The number of requests of a connection that wait for their answers.
#[derive(Clone)]
pub(super) struct AwaitedAnswers(Arc<AtomicU32>);

impl ConnectionSlots {
    /// Makes `max` free slots.
    pub fn new(max: usize) -> ConnectionSlots {
        ConnectionSlots { max, taken: VecDeque::new() }
    }

    /// Takes a slot; `None`: all connections wait for answers.
    pub fn take(&mut self) -> Option<ConnectionSlot> {
        self.taken.retain(|(leave, _)| !leave.is_closed());
        if self.taken.len() >= self.max {
            let is_idle = |(_, of): &(_, Arc<AtomicU32>)| of.load(Ordering::Relaxed) == 0;
            let oldest = self.taken.iter().position(is_idle)?;
            self.taken.remove(oldest);
        }
        let (leave, left) = oneshot::channel();
        let answers = AwaitedAnswers(Arc::default());
        self.taken.push_back((leave, Arc::clone(&answers.0)));
        Some(ConnectionSlot { left, answers })
    }
}

impl ConnectionSlot {
    /// The counter of the connection's waiting requests.
    pub fn answers(&self) -> AwaitedAnswers {
        self.answers.clone()
    }

    /// Ends with the conversation, or when a new connection takes the slot.
    pub async fn hold(mut self, conversation: impl Future<Output = ()>) {
        tokio::select! {
            () = conversation => {}
            _ = &mut self.left => {}
        }
    }
}

impl AwaitedAnswers {
    /// Waits for an answer. During the wait, the connection keeps its slot.
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
        let mut slots = ConnectionSlots::new(2);
        let [mut asks, idle] = [0, 0].map(|_| slots.take().expect("a slot"));
        let answers = asks.answers();
        let mut asking = Box::pin(answers.wait(pending::<()>()));
        assert!(futures_are_pending(&mut asking).await);
        let third = slots.take().expect("that of the second");
        idle.hold(pending()).await;
        assert!(asks.left.try_recv().is_err_and(|why| why == oneshot::error::TryRecvError::Empty));
        let third_answers = third.answers();
        let mut third_asks = Box::pin(third_answers.wait(pending::<()>()));
        assert!(futures_are_pending(&mut third_asks).await);
        assert!(slots.take().is_none(), "both wait for answers");
        drop(asks);
        assert!(slots.take().is_some());
    }

    /// Polls a future once. Returns whether it is pending.
    async fn futures_are_pending(future: &mut (impl Future<Output = ()> + Unpin)) -> bool {
        std::future::poll_fn(|cx| {
            std::task::Poll::Ready(std::pin::Pin::new(&mut *future).poll(cx).is_pending())
        })
        .await
    }
}
