//! The methods of conditions: Acknowledge, ConditionRefresh and ConditionRefresh2 (part 9), and
//! those of shelves, which `shelving` carries out.
//!
//! Clients call them by the ids of the standard's types, which the library's own nodes have, so
//! this manager stands before those and takes the calls alone.

use std::fmt;

use async_trait::async_trait;
use opcua::nodes::{DefaultTypeTree, Event};
use opcua::server::diagnostics::NamespaceMetadata;
use opcua::server::node_manager::{
    BrowseNode, BrowsePathItem, MethodCall, NodeManager, RequestContext, ServerContext,
};
use opcua::types::{MethodId, NodeId, ObjectId, ObjectTypeId, StatusCode, Variant};
use rungd_base::locked::locked;
use rungd_client::operator::protocol::{AckList, Request};

use crate::alarms::{AlarmEvent, PlainEvent, StandingAlarms, alarm_of};
use crate::follow::PlantController;
use crate::journal::{ClientLine, ServerLines};
use crate::manager::{text_id, user};
use crate::shelving::{ShelfMethods, ShelvingMethod};

/// The methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ConditionMethod {
    Acknowledge,
    Refresh,
    Shelving(ShelvingMethod),
}

impl ConditionMethod {
    fn of(id: &NodeId) -> Option<ConditionMethod> {
        let is = |known: MethodId| *id == NodeId::from(known);
        if is(MethodId::AcknowledgeableConditionType_Acknowledge) {
            Some(ConditionMethod::Acknowledge)
        } else if is(MethodId::ConditionType_ConditionRefresh)
            || is(MethodId::ConditionType_ConditionRefresh2)
        {
            Some(ConditionMethod::Refresh)
        } else {
            ShelvingMethod::of(id).map(ConditionMethod::Shelving)
        }
    }
}

/// Carries out the methods of conditions.
pub struct ConditionMethods {
    /// The controller.
    pub followed: PlantController,
    /// The lines that clients can cause.
    pub lines: ServerLines,
    /// Whether clients may acknowledge.
    pub may_acknowledge: bool,
    /// Those of shelves.
    pub shelves: ShelfMethods,
    /// The last event of each alarm.
    pub standing: StandingAlarms,
}

impl fmt::Debug for ConditionMethods {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ConditionMethods")
    }
}

impl ConditionMethods {
    /// Acknowledges an alarm. The call names its condition and its last event.
    async fn acknowledge(&self, context: &RequestContext, call: &MethodCall) -> StatusCode {
        if !self.may_acknowledge {
            return StatusCode::BadUserAccessDenied;
        }
        let Some(tag) = text_id(call.object_id()).and_then(alarm_of) else {
            return StatusCode::BadNodeIdUnknown;
        };
        let [Variant::ByteString(event), ..] = call.arguments() else {
            return StatusCode::BadInvalidArgument;
        };
        let Some(known) = locked(&self.standing).get(tag).cloned() else {
            return StatusCode::BadConditionBranchAlreadyAcked;
        };
        if known.id() != event {
            return StatusCode::BadEventIdUnknown;
        }
        if known.is_acknowledged() {
            return StatusCode::BadConditionBranchAlreadyAcked;
        }
        let who = user(context);
        let request =
            Request::Ack { alarms: vec![known.tag().to_owned()], for_user: Some(who.to_owned()) };
        let what = format!("{who} acknowledges {tag}");
        let done = match self.followed.judge(&context.token, &[]) {
            Ok(()) => self.followed.ask::<AckList>(request).await.map(|_| ()),
            Err(refusal) => Err(refusal),
        };
        match done {
            Ok(()) => {
                self.lines.say(ClientLine::Acknowledge, &what);
                StatusCode::Good
            }
            Err((status, why)) => {
                let line = format!("{what}, and is refused: {why}");
                self.lines.say(ClientLine::Acknowledge, &line);
                status
            }
        }
    }

    /// Carries out a method of shelves, if the user may change alarms.
    async fn shelve(
        &self,
        method: ShelvingMethod,
        context: &RequestContext,
        call: &MethodCall,
    ) -> StatusCode {
        let who = user(context);
        let Err((status, why)) = self.followed.judge(&context.token, &[]) else {
            return self.shelves.call(method, call, who).await;
        };
        let line = format!("{who} {} an alarm, and is refused: {why}", method.words());
        self.lines.say(ClientLine::Shelve, &line);
        status
    }

    /// Tells what stands once more.
    fn refresh(&self, context: &RequestContext) -> StatusCode {
        let begin = PlainEvent::now(ObjectTypeId::RefreshStartEventType, "the refresh begins");
        let end = PlainEvent::now(ObjectTypeId::RefreshEndEventType, "the refresh ends");
        let standing: Vec<AlarmEvent> = locked(&self.standing).values().cloned().collect();
        let server = NodeId::from(ObjectId::Server);
        let alarms = standing.iter().map(|event| event as &dyn Event);
        let events = [&begin as &dyn Event].into_iter().chain(alarms).chain([&end as &dyn Event]);
        context.subscriptions.notify_events(events.map(|event| (event, &server)));
        StatusCode::Good
    }
}

#[async_trait]
impl NodeManager for ConditionMethods {
    fn owns_node(&self, id: &NodeId) -> bool {
        ConditionMethod::of(id).is_some()
    }

    fn name(&self) -> &str {
        "conditions"
    }

    fn namespaces_for_user(&self, _: &RequestContext) -> Vec<NamespaceMetadata> {
        Vec::new()
    }

    async fn init(&self, _: &mut DefaultTypeTree, _: ServerContext) {}

    // The nodes themselves are the library's: it browses them.
    async fn browse(&self, _: &RequestContext, _: &mut [BrowseNode]) -> Result<(), StatusCode> {
        Ok(())
    }

    async fn translate_browse_paths_to_node_ids(
        &self,
        _: &RequestContext,
        _: &mut [&mut BrowsePathItem],
    ) -> Result<(), StatusCode> {
        Ok(())
    }

    async fn call(
        &self,
        context: &RequestContext,
        calls: &mut [&mut MethodCall],
    ) -> Result<(), StatusCode> {
        for call in calls.iter_mut() {
            let status = match ConditionMethod::of(call.method_id()) {
                Some(ConditionMethod::Acknowledge) => self.acknowledge(context, call).await,
                Some(ConditionMethod::Refresh) => self.refresh(context),
                Some(ConditionMethod::Shelving(method)) => self.shelve(method, context, call).await,
                None => StatusCode::BadMethodInvalid,
            };
            call.set_status(status);
        }
        Ok(())
    }
}
