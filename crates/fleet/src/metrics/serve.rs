//! The listener: answers `GET /metrics`, and nothing else.
//!
//! It accepts no body and no parameters, so no data of a client reaches the controller. At most one
//! look is under way, for all clients together, and its result is used for a second.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};
use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{ACCEPT, ALLOW, CONTENT_TYPE, HeaderMap, HeaderValue};
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Mutex;

use super::family::MetricFamily;
use super::journal::say;
use super::scrape::Scraper;
use super::text::{Exposition, text};
use rungd_io::listening::cannot_listen;
use rungd_io::seats::{SeatSettings, Seats, TakenSeat};
use rungd_net::http::{self, ExpectedHosts, with_port};

/// The limits of connections.
const SEATS: SeatSettings = SeatSettings {
    count_max: 32,
    reserved: 0,
    idle_max: Duration::from_secs(5),
    wait_max: Duration::from_secs(5),
    rest: Duration::from_millis(100),
};
/// The time for which the result of a look is used again.
const FRESH: Duration = Duration::from_secs(1);

type MetricsPage = Response<Full<Bytes>>;

/// Makes the looks, and keeps the last one.
struct ScrapeCache {
    scraper: Scraper,
    last: Option<(Instant, Arc<Vec<MetricFamily>>)>,
}

/// What all connections share.
#[derive(Clone)]
struct MetricsSite {
    hosts: Arc<ExpectedHosts>,
    looks: Arc<Mutex<ScrapeCache>>,
}

/// Serves until SIGINT or SIGTERM.
///
/// # Errors
/// The address cannot be used.
pub(super) fn serve(listen: SocketAddr, hosts: &[String], socket: Option<PathBuf>) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.context("the system cannot start an event loop")?.block_on(run(listen, hosts, socket))
}

async fn run(listen: SocketAddr, hosts: &[String], socket: Option<PathBuf>) -> Result<()> {
    let listener = TcpListener::bind(listen).await.map_err(|error| {
        let about = cannot_listen(listen, &error, "name another address after `--listen`");
        anyhow::Error::new(error).context(about)
    })?;
    let at = listener.local_addr().with_context(|| listen.to_string())?;
    let scraper = Scraper::new(socket);
    let from = match scraper.poller.controller() {
        Ok(controller) => format!("the controller at {}", controller.socket.display()),
        Err(failure) => format!("a controller that is still sought: {}", failure.in_one_line()),
    };
    say(&format!("listens at http://{at}/metrics, for {from}"));
    let looks = Arc::new(Mutex::new(ScrapeCache { scraper, last: None }));
    let site = MetricsSite { hosts: Arc::new(expected(hosts, at.port())), looks };
    let _ = sd_notify::notify(&[sd_notify::NotifyState::Ready]);
    let accept = async || Ok(listener.accept().await?.0);
    let converse = |connection, seat| conversation(connection, seat, site.clone());
    http::until_signal(Seats::new(SEATS).serve(accept, converse)).await?;
    Ok(())
}

/// This machine's own names and the given ones, and every IP address.
fn expected(hosts: &[String], port: u16) -> ExpectedHosts {
    let own = own_name();
    let short = own.split('.').next().unwrap_or_default().to_owned();
    let mut names = vec!["localhost".to_owned(), short, own];
    names.retain(|name| !name.is_empty());
    names.extend_from_slice(hosts);
    ExpectedHosts::new(with_port(&names, Some(port)), "rungd metrics --host NAME").with_any_ip()
}

/// The name of this machine. The shipped unit hides the kernel's.
fn own_name() -> String {
    let places = ["/proc/sys/kernel/hostname", "/etc/hostname"];
    let text = places.iter().find_map(|place| std::fs::read_to_string(place).ok());
    text.unwrap_or_default().trim().to_owned()
}

/// Answers the requests of a connection. While one is answered, the connection keeps its seat.
async fn conversation(connection: TcpStream, seat: Arc<TakenSeat>, site: MetricsSite) {
    let service = service_fn(|request: Request<Incoming>| {
        let (seat, site) = (Arc::clone(&seat), site.clone());
        async move {
            let _busy = seat.busy();
            Ok::<_, Infallible>(page(&request, site).await)
        }
    });
    http::converse(connection, service, seat.idle_max()).await;
}

/// Answers a request. (For a `HEAD`, hyper omits the body.)
async fn page(request: &Request<Incoming>, site: MetricsSite) -> MetricsPage {
    if let Err(why) = site.hosts.host(request.uri(), request.headers()) {
        return answer(StatusCode::FORBIDDEN, PLAIN, why + "\n");
    }
    let is_asked = request.method() == Method::GET || request.method() == Method::HEAD;
    match request.uri().path() {
        "/metrics" if is_asked => {
            let form = Exposition::accepted(&accept_of(request.headers()));
            let families = look(site.looks).await;
            answer(StatusCode::OK, form.content_type(), text(&families, form))
        }
        "/metrics" => {
            let why = "the metrics are read-only: use GET\n".to_owned();
            let mut page = answer(StatusCode::METHOD_NOT_ALLOWED, PLAIN, why);
            page.headers_mut().insert(ALLOW, HeaderValue::from_static("GET, HEAD"));
            page
        }
        _ => answer(StatusCode::NOT_FOUND, PLAIN, "the metrics are at /metrics\n".to_owned()),
    }
}

const PLAIN: &str = "text/plain; charset=utf-8";

fn answer(status: StatusCode, kind: &'static str, text: String) -> MetricsPage {
    let mut answer = Response::new(Full::new(Bytes::from(text)));
    *answer.status_mut() = status;
    answer.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(kind));
    answer
}

/// The value of a client's `Accept`, which may be split into several lines.
fn accept_of(headers: &HeaderMap) -> String {
    let lines = headers.get_all(ACCEPT).iter().filter_map(|line| line.to_str().ok());
    lines.collect::<Vec<_>>().join(",")
}

/// The families of a new look, or of a look in the last second. A look continues if its client
/// disconnects: the thread that looks has the lock.
async fn look(looks: Arc<Mutex<ScrapeCache>>) -> Arc<Vec<MetricFamily>> {
    let mut looks = looks.lock_owned().await;
    if let Some((at, families)) = &looks.last
        && at.elapsed() < FRESH
    {
        return Arc::clone(families);
    }
    let looked = tokio::task::spawn_blocking(move || looks.look()).await;
    looked.unwrap_or_else(|_| Arc::new(Vec::new()))
}

impl ScrapeCache {
    fn look(&mut self) -> Arc<Vec<MetricFamily>> {
        let (families, failure) = self.scraper.families();
        if self.scraper.poller.has_turned(failure.is_none()) {
            match &failure {
                Some(why) => say(&format!("the controller does not answer: {why}")),
                None => say("the controller answers"),
            }
        }
        let families = Arc::new(families);
        self.last = Some((Instant::now(), Arc::clone(&families)));
        families
    }
}
