//! The process: opens the listener, follows the controller, and answers each connection in its own
//! task, until a signal ends the process.
//!
//! The number of connections, the bytes of a request, and the time of each part of a request are
//! limited. Only one thread follows the controller, for all viewers.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context as _, Result};
use hyper::service::service_fn;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio_rustls::TlsAcceptor;

use super::follow::FollowThread;
use super::guard::RequestGuard;
use super::journal::say;
use super::listen::{Browser, WebListener, secured, tls};
use super::options::{ListenAt, WebOptions};
use super::patience::{BrowserPatience, PeerEnd};
use super::route::answer;
use super::site::{WebSite, WebSiteParts};
use rungd_io::seats::{ANY_GUEST, SeatSettings, Seats, TakenSeat};
use rungd_net::http;

/// The limits of connections. If all are in use, any further connection waits for a place.
const SEATS: SeatSettings = SeatSettings {
    count_max: 256,
    reserved: 0,
    idle_max: Duration::from_secs(5),
    wait_max: Duration::from_secs(5),
    rest: Duration::from_millis(100),
};

/// Serves the pages until SIGINT or SIGTERM.
///
/// # Errors
/// The options are refused ([`WebOptions::judge`]); the listener, the certificate or the users'
/// file cannot be opened.
pub fn serve(options: &WebOptions) -> Result<()> {
    options.judge()?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.context("the system cannot start an event loop")?.block_on(run(options))
}

async fn run(options: &WebOptions) -> Result<()> {
    let acceptor = options.tls.as_ref().map(|(chain, key)| tls(chain, key)).transpose()?;
    let listener = WebListener::open(&options.listen).await?;
    let port = listener.address().map(|address| address.port());
    let follow = FollowThread::start(options.socket.clone());
    let follow = follow.context("the system cannot start a thread")?;
    let site = Arc::new(WebSite::new(WebSiteParts {
        follow,
        guard: RequestGuard::new(options.host_values(port), options.is_tls()),
        is_tls: options.is_tls(),
        address: address(options, &listener),
        users: options.users.clone(),
        mimics: options.mimics.clone(),
    }));
    if site.has_users() {
        site.users()?;
        say(&format!("listens at {}", site.address));
    } else {
        site.tell_link();
    }
    let _ = sd_notify::notify(&[sd_notify::NotifyState::Ready]);
    let accept = || listener.accept();
    let converse = |browser, seat| {
        let (site, acceptor) = (Arc::clone(&site), acceptor.clone());
        async move { converse_secured(browser, &site, &seat, acceptor).await }
    };
    http::until_signal(Seats::new(SEATS).serve(accept, converse)).await?;
    if let ListenAt::Unix(path) = &options.listen {
        let _ = std::fs::remove_file(path);
    }
    Ok(())
}

/// The part of a link before its path.
fn address(options: &WebOptions, listener: &WebListener) -> String {
    let scheme = if options.is_tls() { "https" } else { "http" };
    match (options.hosts.first(), listener.address(), &options.listen) {
        (Some(host), ..) => format!("{scheme}://{host}"),
        (None, Some(address), _) => format!("{scheme}://{address}"),
        (None, None, ListenAt::Unix(path)) => format!("{scheme}://localhost ({})", path.display()),
        (None, None, ListenAt::Port(address)) => format!("{scheme}://{address}"),
    }
}

/// Answers the requests of a connection, after it has begun TLS if there is an acceptor.
async fn converse_secured(
    Browser { connection, peer }: Browser,
    site: &Arc<WebSite>,
    seat: &Arc<TakenSeat>,
    acceptor: Option<TlsAcceptor>,
) {
    let connection = match &acceptor {
        Some(acceptor) => secured(acceptor, connection).await,
        None => Ok(connection),
    };
    if let Ok(connection) = connection {
        converse(Browser { connection, peer }, site, seat).await;
    }
}

/// Answers the requests of a connection. While one is answered, or events are sent, the connection
/// keeps its seat.
async fn converse(browser: Browser, site: &Arc<WebSite>, seat: &Arc<TakenSeat>) {
    let Browser { connection, peer } = browser;
    let service = service_fn(|request| {
        let (site, patience) = (Arc::clone(site), BrowserPatience::from_now(peer.clone()));
        let busy = seat.busy();
        async move {
            let mut answer = answer(&site, request, patience).await;
            answer.body_mut().hold(busy);
            Ok::<_, Infallible>(answer)
        }
    });
    http::converse(connection, service, seat.idle_max()).await;
}

/// The answer to a connection that sends these bytes, without a controller. For the fuzzer.
pub fn conversation(bytes: &[u8]) -> Vec<u8> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.expect("an event loop").block_on(async {
        let site = Arc::new(WebSite::new(WebSiteParts {
            follow: FollowThread::of_nothing(),
            guard: RequestGuard::new(vec!["localhost".to_owned()], false),
            is_tls: false,
            address: String::new(),
            users: None,
            mimics: None,
        }));
        let seat = Seats::new(SEATS).take(ANY_GUEST).expect("a seat");
        let (near, mut far) = tokio::io::duplex(bytes.len().max(1) + (1 << 20));
        let asked = async {
            far.write_all(bytes).await.expect("there is room");
            far.shutdown().await.expect("it ends");
        };
        let browser = Browser { connection: Box::new(near), peer: PeerEnd::default() };
        tokio::join!(asked, converse(browser, &site, &seat));
        let mut answer = Vec::new();
        let _ = far.read_to_end(&mut answer).await;
        answer
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn http_requests_are_answered_and_other_bytes_are_not() {
        let get = |path: &str| {
            let request = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n");
            String::from_utf8(conversation(request.as_bytes())).expect("a text")
        };
        assert!(get("/").starts_with("HTTP/1.1 200"));
        assert!(get("/in?key=x").starts_with("HTTP/1.1 403"));
        assert!(get("/api/ladder").starts_with("HTTP/1.1 401"));
        assert!(conversation(b"\0\0\0\0").starts_with(b"HTTP/1.1 400"));
        assert!(conversation(b"").is_empty());
    }
}
