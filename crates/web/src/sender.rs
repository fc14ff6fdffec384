//! Sends the change of a page to the controller, if its browser still waits and its session goes
//! on.
//!
//! Used by `changes` and what it calls. It knows no change; the controller judges each.

use std::sync::Arc;
use std::time::Instant;

use hyper::StatusCode;
use serde_json::Value;

use super::journal::say;
use super::patience::BrowserPatience;
use super::reply::{WebFailure, bad};
use super::rights::{SessionRights, settings};
use super::sessions::WebSession;
use super::site::WebSite;
use super::views::viewed;
use rungd_client::operator::client::{self, CallFailure};
use rungd_client::operator::protocol::{RefusalKind, Request, RequestRefusal};
use rungd_config::controller::web::WebOperand;

/// The session that asks for a change, and how long its browser waits for it.
pub(super) struct Visitor {
    pub session: WebSession,
    pub cookie: String,
    pub patience: BrowserPatience,
}

/// The operand of a change, as `[web] write` lists it for the role of the user.
pub(super) async fn listed_operand(
    site: &Arc<WebSite>,
    session: &WebSession,
    said: &Value,
) -> Result<String, WebFailure> {
    let view = viewed(site).await?;
    let operand = said["operand"].as_str().unwrap_or_default().trim().to_owned();
    let subject = &view.program.subject;
    let cell = subject.cell(&operand).map_err(bad)?;
    let listed = settings(&view.program).map_or(&[][..], |web| &web.write);
    let is_listed = |operand: &&WebOperand| subject.cell(&operand.name) == Ok(cell);
    let Some(found) = listed.iter().find(is_listed) else {
        let why = format!("`{operand}` cannot be written here: `[web] write` does not list it");
        return Err(WebFailure(StatusCode::FORBIDDEN, why));
    };
    let rights = SessionRights::of(session, settings(&view.program), Instant::now());
    rights.judge(session, found.role)?;
    Ok(found.name.clone())
}

/// The reason that a page gives for a change.
pub(super) fn reason(said: &Value) -> Option<String> {
    said["reason"].as_str().map(str::to_owned)
}

/// Sends a change to the controller, if its browser still waits and its session goes on; few at a
/// time.
pub(super) async fn sent(
    site: &Arc<WebSite>,
    visitor: &Visitor,
    request: Request,
) -> Result<Value, ChangeFailure> {
    let place = Arc::clone(&site.questions).acquire_owned().await;
    let done = sent_at_once(site, visitor, request).await;
    drop(place);
    done
}

/// Why a change is not made.
pub(super) enum ChangeFailure {
    /// The controller refuses it, or its browser waits no longer.
    Refused(RequestRefusal),
    /// It has not reached the controller.
    NotSent(WebFailure),
}

impl From<ChangeFailure> for WebFailure {
    fn from(failure: ChangeFailure) -> WebFailure {
        let refusal = match failure {
            ChangeFailure::Refused(refusal) => refusal,
            ChangeFailure::NotSent(failure) => return failure,
        };
        let status = match refusal.kind {
            RefusalKind::NotPermitted => StatusCode::FORBIDDEN,
            RefusalKind::BadRequest
            | RefusalKind::BadOperand
            | RefusalKind::BadValue
            | RefusalKind::Refused
            | RefusalKind::BadFiles
            | RefusalKind::NoAnswer
            | RefusalKind::TooLate => StatusCode::CONFLICT,
        };
        WebFailure(status, refusal.message)
    }
}

/// As [`sent`], without a place among the questions.
pub(super) async fn sent_at_once(
    site: &Arc<WebSite>,
    visitor: &Visitor,
    request: Request,
) -> Result<Value, ChangeFailure> {
    let not_sent = |status, why: &str| ChangeFailure::NotSent(WebFailure(status, why.to_owned()));
    // The controller that the page shows, and no other.
    let Some(socket) = site.follow.socket() else {
        let why = "no controller has answered yet: nothing is changed";
        return Err(not_sent(StatusCode::BAD_GATEWAY, why));
    };
    // The wait for a place may have been long, and so may the one for a thread.
    if !site.is_session_open(&visitor.cookie) {
        let why = "the session has ended meanwhile: nothing is changed";
        return Err(not_sent(StatusCode::UNAUTHORIZED, why));
    }
    let patience = visitor.patience.clone();
    let send = move || {
        patience.judge().map_err(CallFailure::Refused)?;
        client::ask_by::<Value>(&socket, &request, patience.until())
    };
    match tokio::task::spawn_blocking(send).await {
        Ok(Ok(done)) => Ok(done),
        Ok(Err(CallFailure::Refused(refusal))) => {
            say(&format!("a change is refused: {}", refusal.message));
            Err(ChangeFailure::Refused(refusal))
        }
        Ok(Err(failure @ CallFailure::NotAllowed(..))) => {
            say(&format!("a change is not possible: {failure}"));
            let why = "this server may only look: to let users change something, its user must be \
                       in the group of the operator's socket (docs/web.md)";
            Err(not_sent(StatusCode::FORBIDDEN, why))
        }
        Ok(Err(failure)) => Err(not_sent(StatusCode::BAD_GATEWAY, &failure.to_string())),
        Err(bug) => Err(not_sent(StatusCode::INTERNAL_SERVER_ERROR, &bug.to_string())),
    }
}
