//! What every question and change of a page begins with: the present view of the controller, the
//! operand that is named, a thread for the answer.
//!
//! Used by `api`, `panels`, `recipe` and the changes. Nothing here asks the controller.

use std::sync::Arc;

use hyper::StatusCode;
use serde_json::Value;

use super::follow::LookResult;
use super::query::Query;
use super::reply::{WebFailure, WebResult, bad, computed};
use super::site::WebSite;
use rungd_client::live::LiveView;

/// The longest name of an operand.
pub(super) const OPERAND_BYTES_MAX: usize = 256;

/// The present view of the controller.
pub(super) async fn viewed(site: &WebSite) -> Result<LiveView, WebFailure> {
    of(site.follow.now().await)
}

/// The view of a look at the controller, or why there is none.
pub(super) fn of(seen: Arc<LookResult>) -> Result<LiveView, WebFailure> {
    seen.view.clone().map_err(|why| WebFailure(StatusCode::BAD_GATEWAY, why))
}

/// The operand that a question names.
pub(super) fn operand(query: &Query) -> Result<&str, WebFailure> {
    let operand = query.get("operand").map(str::trim).filter(|operand| !operand.is_empty());
    let operand = operand.ok_or_else(|| bad("name an operand"))?;
    match operand.len() > OPERAND_BYTES_MAX {
        true => Err(bad("the operand is too long")),
        false => Ok(operand),
    }
}

/// Answers a question that takes time, on a thread for blocking work; few at a time.
pub(super) async fn asked(
    site: &WebSite,
    question: impl FnOnce() -> Result<Value, WebFailure> + Send + 'static,
) -> WebResult {
    let place = Arc::clone(&site.questions).acquire_owned().await;
    let answered = computed(question).await;
    drop(place);
    answered
}
