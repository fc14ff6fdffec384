//! The rights of users of pages: what the role of each may write, and with which reason.
//!
//! Called by `write` for each operand of a change, with the terms that `answer` reads. `rungd web`
//! judges by the same settings before; here counts the controller file of the program that
//! executes.

use rungd_client::operator::operand::Variable;
use rungd_client::operator::protocol::{
    REASON_CHARS_MAX, RefusalKind, RequestRefusal, RequestResult, is_reason,
};
use rungd_config::controller::web::WebSettings;

/// How a change is asked for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WriteTerms<'a> {
    /// Whether a page asks: then the rights of its user count.
    pub from_page: bool,
    /// The person for whom a program asks.
    pub person: Option<&'a str>,
    /// Why, as it is given.
    pub reason: Option<&'a str>,
}

/// Judges a write of a page.
///
/// # Errors
/// Nobody may write the operand there, or not this person, or not without a reason.
pub(super) fn judge_right(
    pages: &WebSettings,
    operand: &Variable,
    terms: WriteTerms<'_>,
) -> RequestResult<()> {
    let name = &operand.operand;
    let Some(needed) = pages.needed(operand.what) else {
        let message = format!("`{name}` cannot be written here: `[web] write` does not list it");
        return Err(RequestRefusal::new(RefusalKind::NotPermitted, message));
    };
    let person = terms.person.unwrap_or_default();
    let role = pages.users.role_of(person);
    if role < needed {
        let (role, needed) = (role.word(), needed.word());
        let message = format!("`{name}` is for the role `{needed}`, and {person} has `{role}`");
        return Err(RequestRefusal::new(RefusalKind::NotPermitted, message));
    }
    if pages.wants_reason(operand.what) && terms.reason.is_none() {
        let message = format!("`{name}` is written with a reason alone: say why");
        return Err(RequestRefusal::new(RefusalKind::BadRequest, message));
    }
    Ok(())
}

/// Judges the reason of a change, if it has one.
///
/// # Errors
/// It is no reason.
pub(super) fn judge_reason(terms: WriteTerms<'_>) -> RequestResult<()> {
    if terms.reason.is_none_or(|reason| is_reason(reason.trim())) {
        return Ok(());
    }
    let message = format!("a reason is one line of at most {REASON_CHARS_MAX} characters");
    Err(RequestRefusal::new(RefusalKind::BadRequest, message))
}
