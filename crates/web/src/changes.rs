//! The changes that a signed-in user may make: writes, and what people do with alarms.
//!
//! Called by `route`. `sender` sends each to the controller with the user's name, which judges it:
//! nothing here is a right of its own. `press` has the buttons that are held.

use std::sync::Arc;

use serde_json::{Value, json};

use super::alarms;
use super::journal::say;
use super::press::press;
use super::recipe;
use super::reply::{WebResult, bad, json_answer};
use super::routes::PageChange;
use super::sender::{Visitor, listed_operand, reason, sent};
use super::site::WebSite;
use rungd_base::wall_clock;
use rungd_client::operator::protocol::{GivenValue, Request};

/// Makes a change.
pub(super) async fn change(
    site: &Arc<WebSite>,
    change: PageChange,
    visitor: &Visitor,
    said: &Value,
) -> WebResult {
    // A visitor without a user has no right that comes so far, except to stay.
    let nobody = String::new();
    let user = visitor.session.user.as_ref().map_or(&nobody, |user| &user.name);
    match change {
        PageChange::Write => write(site, visitor, user, said).await,
        PageChange::Press => press(site, visitor, user, said).await,
        PageChange::Recipe => recipe::write(site, visitor, user, said).await,
        PageChange::ReadRecipe => recipe::read(site, said).await,
        PageChange::Ack => alarms::acknowledge(site, visitor, user, said).await,
        PageChange::Shelve => alarms::shelve(site, visitor, user, said).await,
        PageChange::OutOfService => alarms::out_of_service(site, visitor, user, said).await,
        PageChange::Unshelve => alarms::unshelve(site, visitor, user, said).await,
        // Noted by `route`, which also ends sessions.
        PageChange::Stay | PageChange::Logout => Ok(json_answer(&json!({}))),
    }
}

async fn write(site: &Arc<WebSite>, visitor: &Visitor, user: &str, said: &Value) -> WebResult {
    let operand = listed_operand(site, &visitor.session, said).await?;
    let given: Result<GivenValue, _> = serde_json::from_value(said["value"].clone());
    let value = given.map_err(|_| bad("a value is a number, true or false, or a text"))?;
    let for_user = Some(user.to_owned());
    // The controller checks the list again, that of the program which it runs at that time.
    let from_page = true;
    let reason = reason(said);
    let write = Request::Write { operand: operand.clone(), value, for_user, from_page, reason };
    let mut done = sent(site, visitor, write).await?;
    // Scans after this moment show what the ladder has made of it.
    done["at_ms"] = json!(wall_clock::now_ms());
    say(&format!("{user} wrote {operand}: {}", done["now"]["value"]));
    Ok(json_answer(&done))
}
