//! What people at a page do with alarms: acknowledge them, shelve them, take them out of service,
//! bring them back.
//!
//! Called by `changes`. The controller judges each (a critical alarm is not shelved), and logs it
//! with the user. Who may take an alarm out of service, `routes` says; to bring it back needs the
//! same role, which this module checks.

use std::sync::Arc;
use std::time::Instant;

use serde_json::Value;

use super::journal::say;
use super::reply::{WebFailure, WebResult, bad, json_answer};
use super::rights::{SessionRights, settings};
use super::routes::PageChange;
use super::sender::{Visitor, sent};
use super::site::WebSite;
use super::views::{OPERAND_BYTES_MAX, viewed};
use rungd_client::operator::protocol::Request;

/// Acknowledges an alarm.
pub(super) async fn acknowledge(
    site: &Arc<WebSite>,
    visitor: &Visitor,
    user: &str,
    said: &Value,
) -> WebResult {
    let alarm = named(said)?;
    let (alarms, for_user) = (vec![alarm.clone()], Some(user.to_owned()));
    let done = sent(site, visitor, Request::Ack { alarms, for_user }).await?;
    say(&format!("{user} acknowledged {alarm}"));
    Ok(json_answer(&done))
}

/// Shelves an alarm for a time.
pub(super) async fn shelve(
    site: &Arc<WebSite>,
    visitor: &Visitor,
    user: &str,
    said: &Value,
) -> WebResult {
    let alarm = named(said)?;
    let for_ms = said["for_ms"].as_u64().ok_or_else(|| bad("`for_ms` is a number"))?;
    let (alarms, for_user) = (vec![alarm.clone()], Some(user.to_owned()));
    let request = Request::Shelve { alarms, for_ms: Some(for_ms), why: reason(said), for_user };
    let done = sent(site, visitor, request).await?;
    say(&format!("{user} shelved {alarm}"));
    Ok(json_answer(&done))
}

/// Takes an alarm out of service.
pub(super) async fn out_of_service(
    site: &Arc<WebSite>,
    visitor: &Visitor,
    user: &str,
    said: &Value,
) -> WebResult {
    let (alarm, why) = (named(said)?, reason(said));
    let (alarms, for_user) = (vec![alarm.clone()], Some(user.to_owned()));
    let request = Request::Shelve { alarms, for_ms: None, why, for_user };
    let done = sent(site, visitor, request).await?;
    say(&format!("{user} took {alarm} out of service"));
    Ok(json_answer(&done))
}

/// Brings an alarm back.
pub(super) async fn unshelve(
    site: &Arc<WebSite>,
    visitor: &Visitor,
    user: &str,
    said: &Value,
) -> WebResult {
    let alarm = named(said)?;
    let is_timed = is_timed(site, &alarm).await?;
    if !is_timed {
        let view = viewed(site).await?;
        let rights = SessionRights::of(&visitor.session, settings(&view.program), Instant::now());
        rights.judge(&visitor.session, PageChange::OutOfService.needs())?;
    }
    let (alarms, for_user) = (vec![alarm.clone()], Some(user.to_owned()));
    let request = Request::Unshelve { alarms, for_user };
    let done = sent(site, visitor, request).await?;
    say(&format!("{user} brought {alarm} back"));
    Ok(json_answer(&done))
}

/// Whether a suppressed alarm comes back by itself.
///
/// # Errors
/// The list of alarms, as a page shows it, has no such alarm.
async fn is_timed(site: &WebSite, alarm: &str) -> Result<bool, WebFailure> {
    let seen = site.follow.now().await;
    let listed = seen.status.as_ref().and_then(|status| status["alarms"].as_array());
    let found = listed.and_then(|alarms| alarms.iter().find(|listed| listed["tag"] == alarm));
    let shelf = found.map(|found| &found["shelved"]).filter(|shelf| shelf.is_object());
    let shelf = shelf.ok_or_else(|| bad(format!("`{alarm}` is not shelved")))?;
    Ok(shelf["until_ns"].is_i64())
}

/// The alarm that a change names.
fn named(said: &Value) -> Result<String, WebFailure> {
    let alarm = said["alarm"].as_str().unwrap_or_default().trim().to_owned();
    match alarm.is_empty() || alarm.len() > OPERAND_BYTES_MAX {
        true => Err(bad("name an alarm")),
        false => Ok(alarm),
    }
}

/// The reason that is given; the controller refuses an empty one.
fn reason(said: &Value) -> String {
    said["why"].as_str().unwrap_or_default().to_owned()
}
