//! The listener: answers `GET /metrics`, and nothing else.
//!
//! It takes no body and no parameters, so nothing that a client sends reaches the controller. At
//! most one look is under way, whoever asks, and it is shown for a second.

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
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::Mutex;
use tokio::time::{sleep, timeout};

use super::family::MetricFamily;
use super::journal::say;
use super::scrape::Scraper;
use super::seats::{Answers, Seat, Seats};
use super::text::{Exposition, text};
use crate::http;

/// The most connections at a time.
const CONNECTIONS_MAX: usize = 32;
/// How long a connection may wait for a place, and how long it may keep it.
const SEAT_WAIT: Duration = Duration::from_secs(5);
const CONNECTION_MAX: Duration = Duration::from_secs(600);
/// The pause after the system has no connection to give.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);
/// For so long a look is shown again.
const FRESH: Duration = Duration::from_secs(1);

type Page = Response<Full<Bytes>>;

/// The looks, and the last one.
struct Looks {
    scraper: Scraper,
    last: Option<(Instant, Arc<Vec<MetricFamily>>)>,
    /// Whether the controller answered; `None` before the first look.
    answers: Option<bool>,
}

/// Serves until SIGINT or SIGTERM.
///
/// # Errors
/// The address cannot be taken.
pub(super) fn serve(listen: SocketAddr, socket: Option<PathBuf>) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.context("the system starts no event loop")?.block_on(run(listen, socket))
}

async fn run(listen: SocketAddr, socket: Option<PathBuf>) -> Result<()> {
    let listener = TcpListener::bind(listen).await.with_context(|| listen.to_string())?;
    let at = listener.local_addr().with_context(|| listen.to_string())?;
    let scraper = Scraper::new(socket);
    let from = scraper.socket();
    say(&format!("listens at http://{at}/metrics, for the controller at {}", from.display()));
    let looks = Arc::new(Mutex::new(Looks { scraper, last: None, answers: None }));
    let _ = sd_notify::notify(&[sd_notify::NotifyState::Ready]);
    let mut ends = [signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?];
    let [terminate, interrupt] = &mut ends;
    tokio::select! {
        _ = terminate.recv() => {}
        _ = interrupt.recv() => {}
        () = accept(&listener, &looks) => {}
    }
    Ok(())
}

/// Takes connections in.
async fn accept(listener: &TcpListener, looks: &Arc<Mutex<Looks>>) {
    let mut seats = Seats::new(CONNECTIONS_MAX);
    loop {
        let Ok((connection, _)) = listener.accept().await else {
            sleep(ACCEPT_PAUSE).await;
            continue;
        };
        let Ok(seat) = timeout(SEAT_WAIT, free_seat(&mut seats)).await else { continue };
        let looks = Arc::clone(looks);
        tokio::spawn(async move {
            let conversation = conversation(connection, seat.answers(), looks);
            let _ = timeout(CONNECTION_MAX, seat.hold(conversation)).await;
        });
    }
}

async fn free_seat(seats: &mut Seats) -> Seat {
    loop {
        match seats.take() {
            Some(seat) => return seat,
            None => sleep(ACCEPT_PAUSE).await,
        }
    }
}

async fn conversation(connection: TcpStream, answers: Answers, looks: Arc<Mutex<Looks>>) {
    let service = service_fn(|request: Request<Incoming>| {
        let (answers, looks) = (answers.clone(), Arc::clone(&looks));
        async move { Ok::<_, Infallible>(answers.wait(page(&request, looks)).await) }
    });
    http::converse(connection, service).await;
}

/// Answers a request. (A `HEAD` has the head alone: hyper leaves the rest out.)
async fn page(request: &Request<Incoming>, looks: Arc<Mutex<Looks>>) -> Page {
    let is_asked = request.method() == Method::GET || request.method() == Method::HEAD;
    match request.uri().path() {
        "/metrics" if is_asked => {
            let form = Exposition::accepted(&accept_of(request.headers()));
            let families = look(looks).await;
            answer(StatusCode::OK, form.content_type(), text(&families, form))
        }
        "/metrics" => {
            let why = "the metrics are only read: GET\n".to_owned();
            let mut page = answer(StatusCode::METHOD_NOT_ALLOWED, PLAIN, why);
            page.headers_mut().insert(ALLOW, HeaderValue::from_static("GET, HEAD"));
            page
        }
        _ => answer(StatusCode::NOT_FOUND, PLAIN, "the metrics are at /metrics\n".to_owned()),
    }
}

const PLAIN: &str = "text/plain; charset=utf-8";

fn answer(status: StatusCode, kind: &'static str, text: String) -> Page {
    let mut answer = Response::new(Full::new(Bytes::from(text)));
    *answer.status_mut() = status;
    answer.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(kind));
    answer
}

/// What a client accepts; it may say so in several lines.
fn accept_of(headers: &HeaderMap) -> String {
    let lines = headers.get_all(ACCEPT).iter().filter_map(|line| line.to_str().ok());
    lines.collect::<Vec<_>>().join(",")
}

/// The families of the present, or of the last second. A client that goes away while it waits ends
/// no look: the thread that looks has the lock.
async fn look(looks: Arc<Mutex<Looks>>) -> Arc<Vec<MetricFamily>> {
    let mut looks = looks.lock_owned().await;
    if let Some((at, families)) = &looks.last
        && at.elapsed() < FRESH
    {
        return Arc::clone(families);
    }
    let looked = tokio::task::spawn_blocking(move || looks.look()).await;
    looked.unwrap_or_else(|_| Arc::new(Vec::new()))
}

impl Looks {
    fn look(&mut self) -> Arc<Vec<MetricFamily>> {
        let (families, failure) = self.scraper.families();
        if self.answers.replace(failure.is_none()) != Some(failure.is_none()) {
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
