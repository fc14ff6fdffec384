//! Routes a request to its answer: the static pages, signing in and out, and the questions and
//! changes of a session.

use std::sync::Arc;
use std::time::{Duration, Instant};

use http_body_util::{BodyExt as _, Limited};
use hyper::body::Incoming;
use hyper::header::{CONTENT_TYPE, COOKIE as COOKIE_HEADER, HeaderMap, LOCATION, SET_COOKIE};
use hyper::{Method, Request, StatusCode};
use serde_json::{Value, json};
use tokio::time::timeout;

use super::api;
use super::body::AnswerBody;
use super::changes;
use super::guard::{CSRF, secure};
use super::journal::say;
use super::patience::BrowserPatience;
use super::query::Query;
use super::recipe::RECIPE_BYTES_MAX;
use super::reply::{WebAnswer, WebFailure, WebResult, bad, json_answer, typed};
use super::rights::{SessionRights, settings};
use super::routes::{PageChange, PageQuestion};
use super::sender::Visitor;
use super::sessions::{COOKIE, SignedIn, WebSession, cookie_of};
use super::site::WebSite;
use super::stream;
use super::views::viewed;
use rungd_config::controller::user::WebRole;

/// The most bytes of a change, and the time limit for receiving it.
const BODY_BYTES_MAX: usize = 8 * 1024;
const BODY_MAX: Duration = Duration::from_secs(10);

/// The files of the page: path, type, content.
static PAGES: [(&str, &str, &str); 8] = [
    ("/", "text/html; charset=utf-8", include_str!("page/index.html")),
    ("/app.js", "text/javascript; charset=utf-8", include_str!("page/app.js")),
    ("/alarms.js", "text/javascript; charset=utf-8", include_str!("page/alarms.js")),
    ("/panel.js", "text/javascript; charset=utf-8", include_str!("page/panel.js")),
    ("/recipe.js", "text/javascript; charset=utf-8", include_str!("page/recipe.js")),
    ("/trend.js", "text/javascript; charset=utf-8", include_str!("page/trend.js")),
    ("/style.css", "text/css; charset=utf-8", include_str!("page/style.css")),
    ("/favicon.ico", "image/svg+xml", include_str!("page/icon.svg")),
];

/// The answer to a link that is not valid.
static USED_LINK: &str = include_str!("page/link.html");

/// Answers a request.
pub(super) async fn answer(
    site: &Arc<WebSite>,
    request: Request<Incoming>,
    patience: BrowserPatience,
) -> WebAnswer {
    let admitted = site.guard.admit(request.method(), request.uri(), request.headers());
    let answered = match admitted {
        Ok(()) => admitted_answer(site, request, patience).await,
        Err(why) => Err(WebFailure(StatusCode::FORBIDDEN, why)),
    };
    let mut answer = answered.unwrap_or_else(|WebFailure(status, why)| {
        let mut answer = json_answer(&json!({ "error": why }));
        *answer.status_mut() = status;
        answer
    });
    secure(answer.headers_mut());
    answer
}

async fn admitted_answer(
    site: &Arc<WebSite>,
    request: Request<Incoming>,
    patience: BrowserPatience,
) -> WebResult {
    let path = request.uri().path().to_owned();
    let is_get = *request.method() == Method::GET;
    if let Some((_, kind, content)) = PAGES.iter().find(|(at, ..)| *at == path) {
        return match is_get {
            true => Ok(typed(kind, AnswerBody::of(*content))),
            false => Err(wrong_method()),
        };
    }
    let query = Query::of(request.uri().query().unwrap_or_default());
    match (path.as_str(), is_get) {
        ("/in", true) => return Ok(enter(site, &query, request.headers())),
        ("/api/login", false) => return sign_in(site, request, &patience).await,
        ("/api/login", true) => return Err(wrong_method()),
        _ => {}
    }
    let cookie = cookie(request.headers()).unwrap_or_default().to_owned();
    let session = site.session(&cookie).ok_or_else(|| signed_out(site))?;
    if is_get {
        query.judge().map_err(bad)?;
        let question = PageQuestion::at(&path).ok_or_else(|| missing("page"))?;
        judge(site, &session, question.needs()).await?;
        if question == PageQuestion::Stream {
            return stream::events(site, &query, &cookie);
        }
        return api::question(site, question, &query, &session).await;
    }
    let token = request.headers().get(CSRF).and_then(|token| token.to_str().ok());
    if !session.has_token(token.unwrap_or_default()) {
        let why = "the token of the session is missing: load the page again";
        return Err(WebFailure(StatusCode::FORBIDDEN, why.to_owned()));
    }
    if *request.method() != Method::POST {
        return Err(wrong_method());
    }
    let change = PageChange::at(&path).ok_or_else(|| missing("change"))?;
    if change == PageChange::Logout {
        site.sessions().end(&cookie);
        return Ok(json_answer(&json!({})));
    }
    let bytes_max = match change {
        PageChange::Recipe | PageChange::ReadRecipe => RECIPE_BYTES_MAX,
        PageChange::Write
        | PageChange::Press
        | PageChange::Ack
        | PageChange::Shelve
        | PageChange::OutOfService
        | PageChange::Unshelve
        | PageChange::Stay
        | PageChange::Logout => BODY_BYTES_MAX,
    };
    let said = body(request, bytes_max).await?;
    // A hold that goes on, or ends, is that of its user alone: the controller knows it. It does not
    // wait for a look.
    if change != PageChange::Press || said["hold"].is_null() {
        judge(site, &session, change.needs()).await?;
    }
    site.act(&cookie);
    let visitor = Visitor { session, cookie, patience: patience.said(&said)? };
    changes::change(site, change, &visitor, &said).await
}

fn missing(what: &str) -> WebFailure {
    WebFailure(StatusCode::NOT_FOUND, format!("there is no such {what}"))
}

/// Refuses what the user of a session may not do at present. Every session may look.
async fn judge(site: &WebSite, session: &WebSession, needed: WebRole) -> Result<(), WebFailure> {
    if needed == WebRole::View {
        return Ok(());
    }
    // Without a user the answer does not depend on the controller.
    let Some(_) = session.user else {
        return SessionRights::of(session, None, Instant::now()).judge(session, needed);
    };
    let view = viewed(site).await?;
    SessionRights::of(session, settings(&view.program), Instant::now()).judge(session, needed)
}

fn cookie(headers: &HeaderMap) -> Option<&str> {
    let mut all = headers.get_all(COOKIE_HEADER).iter().filter_map(|value| value.to_str().ok());
    all.find_map(cookie_of)
}

fn signed_out(site: &WebSite) -> WebFailure {
    let why = match site.has_users() {
        true => "sign in",
        false => "open the link that `rungd web` has printed: it is valid once",
    };
    WebFailure(StatusCode::UNAUTHORIZED, why.to_owned())
}

fn wrong_method() -> WebFailure {
    WebFailure(StatusCode::METHOD_NOT_ALLOWED, "this path does not accept this method".to_owned())
}

/// Signs a visitor in by the one-time link. A person may open a link twice: then the answer is a
/// page for this person, or the pages themselves if the browser's session goes on.
fn enter(site: &WebSite, query: &Query, headers: &HeaderMap) -> WebAnswer {
    let is_in = || cookie(headers).is_some_and(|cookie| site.session(cookie).is_some());
    if site.has_users() || !site.sessions().use_link(query.get("key").unwrap_or_default()) {
        if is_in() {
            return to_pages();
        }
        let mut answer = typed("text/html; charset=utf-8", AnswerBody::of(USED_LINK));
        *answer.status_mut() = StatusCode::FORBIDDEN;
        return answer;
    }
    let cookie = site.sessions().begin(None, Instant::now());
    say("the link was used; the next one:");
    site.tell_link();
    let mut answer = to_pages();
    set_cookie(site, &mut answer, &cookie);
    answer
}

/// The answer that leads a browser to the pages.
fn to_pages() -> WebAnswer {
    let mut answer = json_answer(&json!({}));
    *answer.status_mut() = StatusCode::SEE_OTHER;
    answer.headers_mut().insert(LOCATION, "/".parse().expect("a path"));
    answer
}

/// Signs a user in by a password.
async fn sign_in(
    site: &Arc<WebSite>,
    request: Request<Incoming>,
    patience: &BrowserPatience,
) -> WebResult {
    if !site.has_users() {
        return Err(signed_out(site));
    }
    let before = cookie(request.headers()).map(str::to_owned);
    let said = body(request, BODY_BYTES_MAX).await?;
    let text = |key: &str| said[key].as_str().unwrap_or_default().to_owned();
    let (name, password) = (text("user"), text("password"));
    may_try(site, &name)?;
    // Only one password is verified at a time: argon2 needs much memory and time. The place is kept
    // until a wrong password is noted, so the number of tries is right for the next one.
    let _place = Arc::clone(&site.passwords).acquire_owned().await;
    // Those that were before this one in the queue may have used up the tries, and the time.
    may_try(site, &name)?;
    patience.judge().map_err(|_| {
        let why = "its turn came too late, because too many sign in at the same time: try again";
        WebFailure(StatusCode::SERVICE_UNAVAILABLE, why.to_owned())
    })?;
    let users = site.users().map_err(|failure| {
        say(&failure.to_string());
        let why = "the file of users cannot be read: see the log of `rungd web`";
        WebFailure(StatusCode::INTERNAL_SERVER_ERROR, why.to_owned())
    })?;
    let (tried, hasher) = (name.clone(), Arc::clone(&site.hasher));
    let verified = move || users.verified(&hasher, &tried, &password);
    let verified = tokio::task::spawn_blocking(verified).await;
    let Ok(Some(hash)) = verified else {
        site.sessions().note_wrong(&name, Instant::now());
        say(&format!("a wrong password for `{}`", name.chars().take(32).collect::<String>()));
        let why = "no user has this name and this password";
        return Err(WebFailure(StatusCode::UNAUTHORIZED, why.to_owned()));
    };
    say(&format!("{name} has signed in"));
    // At a panel, the next person takes the place of the last one.
    if let Some(before) = before {
        site.sessions().end(&before);
    }
    let cookie = site.sessions().begin(Some(SignedIn { name, hash }), Instant::now());
    let mut answer = json_answer(&json!({}));
    set_cookie(site, &mut answer, &cookie);
    Ok(answer)
}

/// Refuses a try if there were too many.
fn may_try(site: &WebSite, user: &str) -> Result<(), WebFailure> {
    let judged = site.sessions().may_try(user, Instant::now());
    judged.map_err(|why| WebFailure(StatusCode::TOO_MANY_REQUESTS, why.to_owned()))
}

fn set_cookie(site: &WebSite, answer: &mut WebAnswer, cookie: &str) {
    let secure = if site.is_tls { "; Secure" } else { "" };
    let cookie = format!("{COOKIE}={cookie}; Path=/; HttpOnly; SameSite=Strict{secure}");
    answer.headers_mut().insert(SET_COOKIE, cookie.parse().expect("a cookie is ASCII"));
}

/// Reads the JSON body of a change.
async fn body(request: Request<Incoming>, bytes_max: usize) -> Result<Value, WebFailure> {
    let kind = request.headers().get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok());
    if !kind.unwrap_or_default().starts_with("application/json") {
        return Err(bad("the body of a change must be JSON"));
    }
    let limited = Limited::new(request.into_body(), bytes_max).collect();
    let late = |_| bad("the request was not received in time");
    let read = timeout(BODY_MAX, limited).await.map_err(late)?;
    let bytes = read.map_err(|_| bad("the request broke off, or is too long"))?.to_bytes();
    serde_json::from_slice(&bytes).map_err(|_| bad("the body of a change must be JSON"))
}
