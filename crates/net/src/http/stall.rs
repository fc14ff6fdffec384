//! A connection that ends if its peer reads nothing for a while: a frozen browser, or a browser
//! whose network is gone.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Instant, Sleep, sleep};

/// The longest time for which a peer may read nothing while an answer waits for it.
const STALL_MAX: Duration = Duration::from_secs(30);

/// A connection whose writes fail if they wait for too long.
pub(super) struct NoStall<S> {
    stream: S,
    /// The timer, which runs while a write waits.
    limit: Pin<Box<Sleep>>,
    waits: bool,
}

impl<S> NoStall<S> {
    pub fn new(stream: S) -> NoStall<S> {
        NoStall { stream, limit: Box::pin(sleep(STALL_MAX)), waits: false }
    }

    /// The result of a write; a write that waits for too long is an error.
    fn judged<T>(
        &mut self,
        written: Poll<io::Result<T>>,
        context: &mut Context<'_>,
    ) -> Poll<io::Result<T>> {
        if written.is_ready() {
            self.waits = false;
            return written;
        }
        if !std::mem::replace(&mut self.waits, true) {
            self.limit.as_mut().reset(Instant::now() + STALL_MAX);
        }
        match self.limit.as_mut().poll(context) {
            Poll::Ready(()) => Poll::Ready(Err(io::ErrorKind::TimedOut.into())),
            Poll::Pending => Poll::Pending,
        }
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for NoStall<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for NoStall<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.judged(written, context)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let flushed = Pin::new(&mut self.stream).poll_flush(context);
        self.judged(flushed, context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let ended = Pin::new(&mut self.stream).poll_shutdown(context);
        self.judged(ended, context)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::io::AsyncWriteExt as _;

    #[tokio::test(start_paused = true)]
    async fn only_a_peer_that_reads_nothing_is_disconnected() {
        let (near, far) = tokio::io::duplex(8);
        let mut near = NoStall::new(near);
        near.write_all(b"01234567").await.expect("there is room");
        let began = Instant::now();
        let stalled = near.write_all(b"8").await.unwrap_err();
        assert_eq!(stalled.kind(), io::ErrorKind::TimedOut);
        assert!(began.elapsed() >= STALL_MAX && began.elapsed() < 2 * STALL_MAX);
        drop(far);
    }
}
