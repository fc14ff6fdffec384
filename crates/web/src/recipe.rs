//! Recipes: the values of a record array as a table, and its changes as one.
//!
//! Called by `api` for the values, and by `changes` for a file that is read and for the change. The
//! file is that of `rungd read --file` and `rungd write --file` (`client::operator::value_set`).
//! The controller answers with the values of one scan, and judges a change whole; here the operands
//! are compared with the panels that the program has, and with the roles that they need.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use hyper::StatusCode;
use serde_json::{Value, json};

use super::journal::say;
use super::panels::{is_part_of, shows, takes, word};
use super::query::Query;
use super::reply::{WebFailure, WebResult, bad, json_answer};
use super::rights::{SessionRights, settings};
use super::sender::{ChangeFailure, Visitor, reason, sent};
use super::site::WebSite;
use super::views::{asked, operand, viewed};
use rungd_client::live::LiveProgram;
use rungd_client::operator::client;
use rungd_client::operator::protocol::{GivenWrite, Request, ShownValue, WritableValues};
use rungd_client::operator::value_set::{FileWrite, file_text, read_file};
use rungd_config::controller::panel::WidgetKind;
use rungd_config::controller::user::WebRole;
use rungd_language::source::finding::Finding;

/// The most bytes of a change or a file of a recipe.
pub(super) const RECIPE_BYTES_MAX: usize = 256 * 1024;

/// The values of a recipe, all of one scan, and the file that writes them back.
pub(super) async fn recipe(site: &Arc<WebSite>, query: &Query) -> WebResult {
    let view = viewed(site).await?;
    let recipe = shown(&view.program, operand(query)?)?;
    let no_controller = || WebFailure(StatusCode::BAD_GATEWAY, "no controller answers".to_owned());
    let socket = site.follow.socket().ok_or_else(no_controller)?;
    let request = Request::ReadSet { operands: vec![recipe] };
    asked(site, move || {
        let read = client::ask::<WritableValues>(&socket, &request);
        let read = read.map_err(|why| WebFailure(StatusCode::BAD_GATEWAY, why.to_string()))?;
        Ok(values(&view.program, &read))
    })
    .await
}

/// Values for the table of a page, and their file.
fn values(program: &LiveProgram, read: &WritableValues) -> Value {
    let value = |shown: &ShownValue| {
        let word = word(program, &shown.operand);
        json!({
            "operand": shown.operand,
            "value": shown.value,
            "unit": shown.unit,
            "text": shown.text,
            "takes": word.map(|word| takes(program, word)),
            "real": word.is_some_and(|word| word.is_real()),
        })
    };
    let values: Vec<Value> = read.values.iter().map(value).collect();
    let file = file_text(&read.values, &read.records);
    json!({ "values": values, "file": file, "left_out": read.structures + read.read_only })
}

/// The name of a recipe that a panel shows.
fn shown(program: &LiveProgram, name: &str) -> Result<String, WebFailure> {
    match shows(program, WidgetKind::Recipe, name) {
        true => Ok(name.to_owned()),
        false => Err(bad("no panel shows this recipe")),
    }
}

/// The values of a file, for the table of a page: nothing is written.
pub(super) async fn read(site: &Arc<WebSite>, said: &Value) -> WebResult {
    let view = viewed(site).await?;
    let recipe = shown(&view.program, said["operand"].as_str().unwrap_or_default())?;
    let text = said["file"].as_str().ok_or_else(|| bad("a file is a text"))?;
    let (writes, findings) = read_file(text);
    if let Some(finding) = findings.first() {
        return Err(bad(in_line(finding, text)));
    }
    let is_of = |write: &&FileWrite| is_part_of(&write.write.operand, &recipe);
    let own: Vec<&GivenWrite> = writes.iter().filter(is_of).map(|write| &write.write).collect();
    if own.is_empty() {
        return Err(bad(format!("the file has no value of `{recipe}`")));
    }
    Ok(json_answer(&json!({ "writes": own, "others": writes.len() - own.len() })))
}

/// A finding about a file, with its line.
fn in_line(finding: &Finding, text: &str) -> String {
    let before = text.get(..finding.span.start as usize).unwrap_or(text);
    format!("line {}: {}", before.matches('\n').count() + 1, finding.message)
}

/// Judges the operands of a change: each is a part of the recipe, and the user has its role.
fn judge_parts(
    program: &LiveProgram,
    visitor: &Visitor,
    recipe: &str,
    writes: &[GivenWrite],
) -> Result<(), WebFailure> {
    let listed = settings(program).map_or(&[][..], |web| &web.write);
    let roles = listed.iter().map(|operand| (operand.name.as_str(), operand.role));
    let roles: HashMap<&str, WebRole> = roles.collect();
    let rights = SessionRights::of(&visitor.session, settings(program), Instant::now());
    for GivenWrite { operand, .. } in writes {
        if !is_part_of(operand, recipe) {
            return Err(bad(format!("`{operand}` is no part of the recipe `{recipe}`")));
        }
        // The controller refuses what is not listed, each with its place.
        if let Some(role) = roles.get(operand.as_str()) {
            rights.judge(&visitor.session, *role)?;
        }
    }
    Ok(())
}

/// Writes the changed values of a recipe as one change.
pub(super) async fn write(
    site: &Arc<WebSite>,
    visitor: &Visitor,
    user: &str,
    said: &Value,
) -> WebResult {
    let view = viewed(site).await?;
    let recipe = shown(&view.program, said["operand"].as_str().unwrap_or_default())?;
    let writes: Result<Vec<GivenWrite>, _> = serde_json::from_value(said["writes"].clone());
    let writes = writes.map_err(|_| bad("`writes` is a list of operands and values"))?;
    judge_parts(&view.program, visitor, &recipe, &writes)?;
    let count = writes.len();
    let (for_user, from_page) = (Some(user.to_owned()), true);
    let request = Request::WriteSet { writes, for_user, from_page, reason: reason(said) };
    match sent(site, visitor, request).await {
        Ok(done) => {
            say(&format!("{user} wrote {count} values of {recipe}"));
            Ok(json_answer(&done))
        }
        // Each refused value has its own reason, which the page shows at its cell.
        Err(ChangeFailure::Refused(refusal)) if !refusal.mistakes.is_empty() => {
            let said = json!({ "error": refusal.message, "mistakes": refusal.mistakes });
            let mut answer = json_answer(&said);
            *answer.status_mut() = StatusCode::CONFLICT;
            Ok(answer)
        }
        Err(failure) => Err(failure.into()),
    }
}
