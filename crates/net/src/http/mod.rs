//! An HTTP/1 connection with limits: the bytes and the time of a request's head, and the time for
//! which a peer may read nothing; the hosts by which it may be asked. The signals that end a
//! server.
//!
//! Called by `web` and by `metrics`. They open the listeners, make the answers and limit the number
//! of connections.

mod hosts;
mod stall;

use std::convert::Infallible;
use std::io;

use hyper::body::{Body, Incoming};
use hyper::server::conn::http1;
use hyper::service::Service;
use hyper::{Request, Response};
use hyper_util::rt::{TokioIo, TokioTimer};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::signal::unix::{SignalKind, signal};

pub use hosts::{ExpectedHosts, with_port};
use stall::NoStall;

/// The maximum number of bytes of a request's head, and the maximum number of its headers.
const HEAD_BYTES_MAX: usize = 16 * 1024;
const HEADERS_MAX: usize = 64;

/// Runs a server until SIGINT or SIGTERM.
///
/// # Errors
/// The system does not deliver the signals.
pub async fn until_signal(server: impl Future<Output = ()>) -> io::Result<()> {
    let mut ends = [signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?];
    let [terminate, interrupt] = &mut ends;
    tokio::select! {
        _ = terminate.recv() => {}
        _ = interrupt.recv() => {}
        () = server => {}
    }
    Ok(())
}

/// Answers the requests of a connection until it ends. `idle_max` is the time limit of a request's
/// head, and of a connection without requests.
pub async fn converse<C, S, B>(connection: C, service: S, idle_max: Duration)
where
    C: AsyncRead + AsyncWrite + Unpin,
    S: Service<Request<Incoming>, Response = Response<B>, Error = Infallible>,
    B: Body<Error = Infallible> + 'static,
{
    let mut protocol = http1::Builder::new();
    protocol.timer(TokioTimer::new()).header_read_timeout(idle_max);
    protocol.max_buf_size(HEAD_BYTES_MAX).max_headers(HEADERS_MAX).half_close(true);
    // An error on a connection concerns only its peer.
    let _ = protocol.serve_connection(TokioIo::new(NoStall::new(connection)), service).await;
}
