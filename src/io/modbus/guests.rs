//! Who is connected, and who of them gives way when a place or a file descriptor is wanted.
//!
//! Called by `server`; each guest is a task of `connection`. Who has been answered once keeps its
//! place. Who has asked nothing yet loses it to a newcomer, the oldest first: so a crowd of silent
//! connections keeps nobody out, and costs those who are served nothing.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::task::{AbortHandle, JoinError, JoinSet, yield_now};

use super::closed::Closed;

/// How a client's task ended.
pub(super) type Ended = (SocketAddr, Closed);

/// Those who are connected, the oldest first.
#[derive(Default)]
pub(super) struct Guests {
    tasks: JoinSet<Ended>,
    seats: Vec<Seat>,
    /// Who was closed last, and may still hold its file descriptor.
    leaving: Option<AbortHandle>,
}

struct Seat {
    client: SocketAddr,
    task: AbortHandle,
    /// It has had a reply.
    served: Arc<AtomicBool>,
}

impl Guests {
    /// How many there are.
    pub fn count(&self) -> usize {
        self.seats.len()
    }

    /// Seats a client; `serve` makes its task, and is told where to note that it was answered.
    pub fn seat<F>(&mut self, client: SocketAddr, serve: impl FnOnce(Arc<AtomicBool>) -> F)
    where
        F: Future<Output = Closed> + Send + 'static,
    {
        let served = Arc::new(AtomicBool::new(false));
        let serving = serve(Arc::clone(&served));
        let task = self.tasks.spawn(async move { (client, serving.await) });
        self.seats.push(Seat { client, task, served });
    }

    /// Closes the oldest who has asked nothing yet.
    pub fn make_room(&mut self) -> Option<SocketAddr> {
        let silent = |seat: &Seat| !seat.served.load(Ordering::Relaxed) && !seat.task.is_finished();
        let at = self.seats.iter().position(silent)?;
        let seat = self.seats.remove(at);
        seat.task.abort();
        self.leaving = Some(seat.task);
        Some(seat.client)
    }

    /// Waits until who was closed has let go of its connection.
    pub async fn see_out(&mut self) {
        let Some(task) = self.leaving.take() else { return };
        while !task.is_finished() {
            yield_now().await;
        }
    }

    /// The next who goes of itself, and how; never, where nobody is there.
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

    /// Who has gone of itself meanwhile.
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
