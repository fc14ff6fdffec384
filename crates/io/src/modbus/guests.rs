//! The connected clients, and the choice of the client that is closed when a place or a file
//! descriptor is needed.
//!
//! Called by `server`; each client is a task of `connection`. A client that has been answered once
//! keeps its place. If a new client needs a place, it takes the place of the oldest client that has
//! not been answered yet. Therefore, many silent connections neither keep new clients out nor
//! disturb the clients that are served.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::task::{AbortHandle, JoinError, JoinSet, yield_now};

use super::closed::Closed;

/// How a client's task ended.
pub(super) type Ended = (SocketAddr, Closed);

/// The connected clients, the oldest first.
#[derive(Default)]
pub(super) struct Guests {
    tasks: JoinSet<Ended>,
    seats: Vec<Seat>,
    /// The client that was closed last; it may still hold its file descriptor.
    leaving: Option<AbortHandle>,
}

struct Seat {
    client: SocketAddr,
    task: AbortHandle,
    /// Whether it has received a reply.
    served: Arc<AtomicBool>,
}

impl Guests {
    /// The number of clients.
    pub fn count(&self) -> usize {
        self.seats.len()
    }

    /// Adds a client. `serve` makes its task, and receives the flag to set after the first answer.
    pub fn seat<F>(&mut self, client: SocketAddr, serve: impl FnOnce(Arc<AtomicBool>) -> F)
    where
        F: Future<Output = Closed> + Send + 'static,
    {
        let served = Arc::new(AtomicBool::new(false));
        let serving = serve(Arc::clone(&served));
        let task = self.tasks.spawn(async move { (client, serving.await) });
        self.seats.push(Seat { client, task, served });
    }

    /// Closes the oldest client that has not been answered yet.
    pub fn make_room(&mut self) -> Option<SocketAddr> {
        let silent = |seat: &Seat| !seat.served.load(Ordering::Relaxed) && !seat.task.is_finished();
        let at = self.seats.iter().position(silent)?;
        let seat = self.seats.remove(at);
        seat.task.abort();
        self.leaving = Some(seat.task);
        Some(seat.client)
    }

    /// Waits until the closed client's task has dropped its connection.
    pub async fn see_out(&mut self) {
        let Some(task) = self.leaving.take() else { return };
        while !task.is_finished() {
            yield_now().await;
        }
    }

    /// Waits for the next client whose connection ends by itself, and returns how it ended. Never
    /// returns while there are no clients.
    pub async fn next_gone(&mut self) -> Result<Ended, JoinError> {
        loop {
            match self.tasks.join_next().await {
                Some(Err(error)) if error.is_cancelled() => {}
                Some(ended) => {
                    self.leave();
                    return ended;
                }
                None => std::future::pending().await,
            }
        }
    }

    /// The next client whose connection has already ended by itself.
    pub fn gone(&mut self) -> Option<Result<Ended, JoinError>> {
        loop {
            match self.tasks.try_join_next()? {
                Err(error) if error.is_cancelled() => {}
                ended => {
                    self.leave();
                    return Some(ended);
                }
            }
        }
    }

    fn leave(&mut self) {
        self.seats.retain(|seat| !seat.task.is_finished());
    }
}
