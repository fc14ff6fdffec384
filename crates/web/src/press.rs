//! Buttons that hold a bit ON while they are pressed.
//!
//! Called by `changes`. A press begins a hold in the controller, and the page renews it; the
//! controller ends it by itself when the renewals stay away, so nothing is kept here: a `rungd web`
//! that is killed or stands still ends every hold. A press has no place among the questions, so
//! that a long question never ends a hold.

use std::sync::Arc;

use serde_json::Value;

use super::reply::{WebResult, bad, json_answer};
use super::sender::{Visitor, listed_operand, reason, sent_at_once};
use super::site::WebSite;
use rungd_client::operator::protocol::Request;

/// Begins, renews or ends a hold: `{"operand":…}` begins one, `{"hold":…}` renews it, and with
/// `"end":true` ends it.
pub(super) async fn press(
    site: &Arc<WebSite>,
    visitor: &Visitor,
    user: &str,
    said: &Value,
) -> WebResult {
    let for_user = Some(user.to_owned());
    let request = match (said["hold"].as_u64(), said["end"].as_bool()) {
        (Some(hold), Some(true)) => Request::EndHold { hold, for_user },
        (Some(hold), None | Some(false)) => Request::KeepHold { hold, for_user },
        (None, _) if !said["hold"].is_null() => return Err(bad("`hold` is a number")),
        (None, _) => {
            let operand = listed_operand(site, &visitor.session, said).await?;
            Request::Hold { operand, for_user, from_page: true, reason: reason(said) }
        }
    };
    let place = Arc::clone(&site.presses).acquire_owned().await;
    let done = sent_at_once(site, visitor, request).await;
    drop(place);
    Ok(json_answer(&done?))
}
