//! A connection of HTTP/1 within limits: the bytes and the time of a request's head, and a peer
//! that reads nothing.
//!
//! Called by `web` and by `metrics` for each connection that they take in. What is answered, and
//! how many connections there may be, is theirs.

mod stall;

use std::convert::Infallible;

use hyper::body::{Body, Incoming};
use hyper::server::conn::http1;
use hyper::service::Service;
use hyper::{Request, Response};
use hyper_util::rt::{TokioIo, TokioTimer};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};

use stall::NoStall;

/// The time limit of a request's head; a connection without requests ends then too.
const HEAD_MAX: Duration = Duration::from_secs(5);
/// The most bytes of a request's head, and its most headers.
const HEAD_BYTES_MAX: usize = 16 * 1024;
const HEADERS_MAX: usize = 64;

/// Answers the requests of a connection until it ends.
pub(crate) async fn converse<C, S, B>(connection: C, service: S)
where
    C: AsyncRead + AsyncWrite + Unpin,
    S: Service<Request<Incoming>, Response = Response<B>, Error = Infallible>,
    B: Body<Error = Infallible> + 'static,
{
    let mut protocol = http1::Builder::new();
    protocol.timer(TokioTimer::new()).header_read_timeout(HEAD_MAX);
    protocol.max_buf_size(HEAD_BYTES_MAX).max_headers(HEADERS_MAX).half_close(true);
    // What goes wrong on a connection is its peer's.
    let _ = protocol.serve_connection(TokioIo::new(NoStall::new(connection)), service).await;
}
