//! The methods that take an alarm away from the operators, and bring it back (OPC 10000-9, 5.8.17
//! ShelvedStateMachineType; RemoveFromService and PlaceInService of 5.8.2).
//!
//! Called by `conditions`. The controller shelves (`rungd shelve`) and logs it: this module only
//! says in the standard's terms what is asked for, and what came of it. OneShotShelve is refused: a
//! shelf of rungd always has an end, or somebody has to bring the alarm back.

use opcua::server::node_manager::MethodCall;
use opcua::types::{MethodId, NodeId, StatusCode, Variant};
use rungd_client::operator::protocol::{
    AlarmList, RefusalKind, Request, SHELF_MS_MAX, ShelfList, is_reason,
};

use crate::alarms::alarm_of;
use crate::follow::{NotDone, PlantController};
use crate::journal::{ClientLine, ServerLines};
use crate::manager::text_id;

/// The methods, each in its form with a comment too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShelvingMethod {
    /// For a time.
    Timed,
    /// Until the alarm is over.
    OneShot,
    /// Back from the shelf.
    Unshelve,
    /// Until somebody brings it back.
    Remove,
    /// Back in service.
    Place,
}

/// The ids of the methods, of the state machine and of the alarm that has one.
const METHODS: [(MethodId, ShelvingMethod); 16] = [
    (MethodId::ShelvedStateMachineType_TimedShelve, ShelvingMethod::Timed),
    (MethodId::ShelvedStateMachineType_TimedShelve2, ShelvingMethod::Timed),
    (MethodId::AlarmConditionType_ShelvingState_TimedShelve, ShelvingMethod::Timed),
    (MethodId::AlarmConditionType_ShelvingState_TimedShelve2, ShelvingMethod::Timed),
    (MethodId::ShelvedStateMachineType_OneShotShelve, ShelvingMethod::OneShot),
    (MethodId::ShelvedStateMachineType_OneShotShelve2, ShelvingMethod::OneShot),
    (MethodId::AlarmConditionType_ShelvingState_OneShotShelve, ShelvingMethod::OneShot),
    (MethodId::AlarmConditionType_ShelvingState_OneShotShelve2, ShelvingMethod::OneShot),
    (MethodId::ShelvedStateMachineType_Unshelve, ShelvingMethod::Unshelve),
    (MethodId::ShelvedStateMachineType_Unshelve2, ShelvingMethod::Unshelve),
    (MethodId::AlarmConditionType_ShelvingState_Unshelve, ShelvingMethod::Unshelve),
    (MethodId::AlarmConditionType_ShelvingState_Unshelve2, ShelvingMethod::Unshelve),
    (MethodId::AlarmConditionType_RemoveFromService, ShelvingMethod::Remove),
    (MethodId::AlarmConditionType_RemoveFromService2, ShelvingMethod::Remove),
    (MethodId::AlarmConditionType_PlaceInService, ShelvingMethod::Place),
    (MethodId::AlarmConditionType_PlaceInService2, ShelvingMethod::Place),
];

/// What a call wants of an alarm.
#[derive(Clone, Debug, PartialEq)]
pub struct WantedShelving {
    method: ShelvingMethod,
    /// The tag of the alarm.
    tag: String,
    /// The time of a shelf, ms.
    for_ms: Option<u64>,
    /// The client's comment; empty: none.
    comment: String,
}

impl ShelvingMethod {
    /// The method of an id.
    pub fn of(id: &NodeId) -> Option<ShelvingMethod> {
        let found = METHODS.iter().find(|(known, _)| *id == NodeId::from(*known));
        found.map(|(_, method)| *method)
    }

    /// In a line for the journal: a user …
    pub fn words(self) -> &'static str {
        match self {
            ShelvingMethod::Timed | ShelvingMethod::OneShot => "shelves",
            ShelvingMethod::Unshelve => "brings back from its shelf",
            ShelvingMethod::Remove => "takes out of service",
            ShelvingMethod::Place => "returns to service",
        }
    }
}

impl WantedShelving {
    /// What a call wants. The object is the condition, or its ShelvingState.
    ///
    /// # Errors
    /// The status of the answer.
    pub fn of(
        method: ShelvingMethod,
        object: &NodeId,
        arguments: &[Variant],
    ) -> Result<WantedShelving, StatusCode> {
        let object = text_id(object).ok_or(StatusCode::BadNodeIdUnknown)?;
        let condition = object.strip_suffix("/ShelvingState").unwrap_or(object);
        let tag = alarm_of(condition).ok_or(StatusCode::BadNodeIdUnknown)?.to_owned();
        let (for_ms, rest) = match (method, arguments) {
            (ShelvingMethod::Timed, [time, rest @ ..]) => (Some(shelf_ms(time)?), rest),
            (ShelvingMethod::Timed, []) => return Err(StatusCode::BadArgumentsMissing),
            (_, rest) => (None, rest),
        };
        let comment = match rest {
            [] | [Variant::Empty] => String::new(),
            [Variant::LocalizedText(text)] => text.text.as_ref().trim().to_owned(),
            [_] => return Err(StatusCode::BadTypeMismatch),
            [_, _, ..] => return Err(StatusCode::BadTooManyArguments),
        };
        if !comment.is_empty() && !is_reason(&comment) {
            return Err(StatusCode::BadInvalidArgument);
        }
        Ok(WantedShelving { method, tag, for_ms, comment })
    }
}

/// The ms of a Duration.
fn shelf_ms(time: &Variant) -> Result<u64, StatusCode> {
    let Variant::Double(ms) = time else { return Err(StatusCode::BadTypeMismatch) };
    // The limit is a whole number far below 2^53. A NaN is in no range.
    if (1.0..=SHELF_MS_MAX as f64).contains(ms) {
        Ok(*ms as u64)
    } else {
        Err(StatusCode::BadShelvingTimeOutOfRange)
    }
}

/// Carries out the methods.
pub struct ShelfMethods {
    /// The controller.
    pub followed: PlantController,
    /// The lines that clients can cause.
    pub lines: ServerLines,
    /// Whether clients may shelve alarms.
    pub may_shelve: bool,
}

impl ShelfMethods {
    /// Carries out a method for a user, and writes the line about it.
    pub async fn call(&self, method: ShelvingMethod, call: &MethodCall, who: &str) -> StatusCode {
        if !self.may_shelve {
            return StatusCode::BadUserAccessDenied;
        }
        let words = method.words();
        let wanted = match WantedShelving::of(method, call.object_id(), call.arguments()) {
            Ok(wanted) => wanted,
            Err(status) => {
                let line = format!("{who} {words} an alarm, and is refused: {status}");
                self.lines.say(ClientLine::Shelve, &line);
                return status;
            }
        };
        let what = format!("{who} {words} {}", wanted.tag);
        let comment = match wanted.comment.as_str() {
            "" => String::new(),
            comment => format!(" ({comment})"),
        };
        match self.shelve(wanted, who).await {
            Ok(None) => {
                self.lines.say(ClientLine::Shelve, &format!("{what}{comment}"));
                StatusCode::Good
            }
            Ok(Some(why)) => {
                let line = format!("{what}{comment}; a restart would forget it: {why}");
                self.lines.say(ClientLine::Shelve, &line);
                StatusCode::Good
            }
            Err((status, why)) => {
                let line = format!("{what}, and is refused: {why}");
                self.lines.say(ClientLine::Shelve, &line);
                status
            }
        }
    }

    /// Has the controller do it. Returns why a restart would forget it.
    async fn shelve(&self, wanted: WantedShelving, who: &str) -> Result<Option<String>, NotDone> {
        let WantedShelving { method, tag, for_ms, comment } = wanted;
        let (alarms, for_user) = (vec![tag.clone()], Some(who.to_owned()));
        let request = match method {
            ShelvingMethod::OneShot => {
                let why = "rungd has no shelf that ends with the alarm: give a time (TimedShelve)";
                return Err((StatusCode::BadNotImplemented, why.to_owned()));
            }
            ShelvingMethod::Timed | ShelvingMethod::Remove => {
                let why = match comment.is_empty() {
                    true => format!("by {who}, over OPC UA without a comment"),
                    false => comment,
                };
                Request::Shelve { alarms, for_ms, why, for_user }
            }
            ShelvingMethod::Unshelve | ShelvingMethod::Place => {
                // A shelf and out of service are two states of the standard.
                let is_timed = self.shelf_of(&tag).await?;
                if is_timed != Some(method == ShelvingMethod::Unshelve) {
                    return Err(not_away(method));
                }
                Request::Unshelve { alarms, for_user }
            }
        };
        let done: ShelfList = self.followed.ask(request).await.map_err(in_terms_of_shelves)?;
        Ok(done.not_kept)
    }

    /// Whether an alarm's shelf ends by itself; `None`: it has none.
    async fn shelf_of(&self, tag: &str) -> Result<Option<bool>, NotDone> {
        let list: AlarmList = self.followed.ask(Request::Alarms {}).await?;
        let found = list.alarms.into_iter().find(|alarm| alarm.tag == tag);
        Ok(found.and_then(|alarm| alarm.shelved).map(|shelf| shelf.is_timed()))
    }
}

fn not_away(method: ShelvingMethod) -> NotDone {
    match method {
        ShelvingMethod::Place => {
            (StatusCode::BadInvalidState, "it is not out of service".to_owned())
        }
        ShelvingMethod::Timed
        | ShelvingMethod::OneShot
        | ShelvingMethod::Unshelve
        | ShelvingMethod::Remove => {
            (StatusCode::BadConditionNotShelved, "it is not shelved".to_owned())
        }
    }
}

/// A refusal of the controller: of a critical alarm, which it does not shelve.
fn in_terms_of_shelves((status, why): NotDone) -> NotDone {
    let refused = crate::values::refused(RefusalKind::Refused);
    (if status == refused { StatusCode::BadRequestNotAllowed } else { status }, why)
}
