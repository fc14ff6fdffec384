//! The alarms of the controller as events of OPC UA's Alarms and Conditions (part 9): each change
//! of an alarm's state is an event of its condition.
//!
//! The controller's alarm book is the only one: this module compares its lists.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use opcua::nodes::Event;
use opcua::server::{EventField, ServerHandle};
use opcua::types::{
    AttributeId, ByteString, DateTime, ExtensionObject, LocalizedText,
    ModelChangeStructureDataType, NodeId, NumericRange, ObjectId, ObjectTypeId, QualifiedName,
    UAString, Variant,
};
use rungd_base::locked::locked;
use rungd_client::operator::protocol::{
    AlarmList, AlarmShelf, AlarmState, AlarmStatus, SHELF_MS_MAX,
};
use rungd_language::resolve::priority::Priority;

use crate::space::{ALARMS, ROOT, node_id};
use crate::values::{time, unix_ns};

/// The numbers of events in this process.
static EVENTS: AtomicU64 = AtomicU64::new(1);

/// The id of the condition of an alarm.
pub fn condition_id(namespace: u16, tag: &str) -> NodeId {
    node_id(namespace, &format!("{ALARMS}/{tag}"))
}

/// The alarm that a condition's id stands for.
pub fn alarm_of(id: &str) -> Option<&str> {
    id.strip_prefix(ALARMS)?.strip_prefix('/')
}

/// The last event of each alarm that stands or waits for an acknowledgement, by tag. Shared with
/// the methods of conditions.
pub type StandingAlarms = Arc<Mutex<BTreeMap<String, AlarmEvent>>>;

/// The alarms as last told.
#[derive(Debug)]
pub struct ConditionBook {
    namespace: u16,
    told: BTreeMap<String, AlarmStatus>,
    standing: StandingAlarms,
}

impl ConditionBook {
    /// Before the first list.
    pub fn new(namespace: u16, standing: StandingAlarms) -> ConditionBook {
        ConditionBook { namespace, told: BTreeMap::new(), standing }
    }

    /// Tells the changes since the last list. An alarm that is no more listed is normal again.
    pub fn take(&mut self, list: &AlarmList, handle: &ServerHandle) {
        let listed = list.alarms.iter().map(|alarm| (alarm.tag.clone(), alarm.clone()));
        let now: BTreeMap<String, AlarmStatus> = listed.collect();
        let over = self.told.values().filter(|alarm| !now.contains_key(&alarm.tag));
        let normal = |alarm: &AlarmStatus| AlarmStatus {
            state: AlarmState::Normal,
            shelved: None,
            ..alarm.clone()
        };
        let over: Vec<AlarmStatus> = over.map(normal).collect();
        let is_news = |alarm: &&AlarmStatus| {
            let told = self.told.get(&alarm.tag);
            told.is_none_or(|told| {
                (told.state, told.since, &told.shelved)
                    != (alarm.state, alarm.since, &alarm.shelved)
            })
        };
        let news = over.iter().chain(now.values().filter(is_news));
        let event = |alarm: &AlarmStatus| {
            let mut event = AlarmEvent::of_alarm(self.namespace, alarm);
            // The book has no time of the end of a shelf, nor of an alarm that it lists no more.
            let was_shelved = self.told.get(&alarm.tag).is_some_and(|told| told.shelved.is_some());
            let is_listed = now.contains_key(&alarm.tag);
            if !is_listed || (was_shelved && alarm.shelved.is_none()) {
                event.time = DateTime::now();
            }
            event
        };
        let events: Vec<AlarmEvent> = news.map(event).collect();
        let mut standing = locked(&self.standing);
        standing.retain(|tag, _| now.contains_key(tag));
        for event in events.iter().filter(|event| now.contains_key(event.tag())) {
            standing.insert(event.tag().to_owned(), event.clone());
        }
        drop(standing);
        let root = node_id(self.namespace, ROOT);
        let events = events.iter().map(|event| (event as &dyn Event, &root));
        handle.subscriptions().notify_events(events);
        self.told = now;
    }

    /// Tells which nodes came and went.
    pub fn model_changed(&self, changes: Vec<ModelChangeStructureDataType>, handle: &ServerHandle) {
        let kind = ObjectTypeId::GeneralModelChangeEventType;
        let mut event = PlainEvent::now(kind, "the program has changed");
        event.fields.changes = changes;
        let server = NodeId::from(ObjectId::Server);
        handle.subscriptions().notify_events([(&event as &dyn Event, &server)].into_iter());
    }
}

/// A new identity of an event.
fn new_event_id() -> ByteString {
    let number = EVENTS.fetch_add(1, Ordering::Relaxed);
    let mut bytes = u64::from(std::process::id()).to_be_bytes().to_vec();
    bytes.extend(number.to_be_bytes());
    ByteString::from(bytes)
}

/// The severity of the standard, 1 to 1000.
fn severity(priority: Priority) -> u16 {
    match priority {
        Priority::Critical => 900,
        Priority::High => 700,
        Priority::Medium => 500,
        Priority::Low => 200,
    }
}

/// An event: what all have, and the fields of its kind.
#[derive(Clone, Debug)]
pub struct ToldEvent<F> {
    id: ByteString,
    event_type: NodeId,
    time: DateTime,
    fields: F,
}

impl<F> ToldEvent<F> {
    fn new(kind: ObjectTypeId, time: DateTime, fields: F) -> ToldEvent<F> {
        ToldEvent { id: new_event_id(), event_type: kind.into(), time, fields }
    }
}

/// The fields of a kind of event.
trait EventFields {
    /// The node that the event is of, for clients that name it.
    fn node(&self) -> Option<&NodeId>;

    /// The content of a field; empty if this kind does not have it.
    fn field(&self, path: &str) -> Variant;
}

/// A state of an alarm, as an event.
pub type AlarmEvent = ToldEvent<AlarmFields>;

/// An event without a condition: nodes came or went, a refresh begins or ends.
pub type PlainEvent = ToldEvent<PlainFields>;

/// The fields of an alarm.
#[derive(Clone, Debug)]
pub struct AlarmFields {
    condition: NodeId,
    source: NodeId,
    tag: String,
    text: String,
    state: AlarmState,
    priority: Priority,
    /// The user who acknowledged it, or else who shelved it.
    who: String,
    shelved: Option<AlarmShelf>,
}

impl AlarmEvent {
    /// The state of an alarm.
    pub fn of_alarm(namespace: u16, alarm: &AlarmStatus) -> AlarmEvent {
        let acknowledged = alarm.acknowledged.as_ref();
        let times = [
            alarm.since.map(|time| time.unix_ns),
            alarm.ended.map(|time| time.unix_ns),
            acknowledged.map(|ack| ack.unix_ns),
            alarm.shelved.as_ref().map(|shelf| shelf.since_ns),
        ];
        let latest = times.into_iter().flatten().max();
        let fields = AlarmFields {
            condition: condition_id(namespace, &alarm.tag),
            source: node_id(namespace, &alarm.tag),
            tag: alarm.tag.clone(),
            text: alarm.text.clone(),
            state: alarm.state,
            priority: alarm.priority,
            who: acknowledged
                .map(|ack| &ack.who)
                .or(alarm.shelved.as_ref().map(|shelf| &shelf.who))
                .cloned()
                .unwrap_or_default(),
            shelved: alarm.shelved.clone(),
        };
        let time = latest.map_or_else(DateTime::now, time);
        ToldEvent::new(ObjectTypeId::AlarmConditionType, time, fields)
    }

    /// Whether nothing is left to acknowledge.
    pub fn is_acknowledged(&self) -> bool {
        self.fields.is_acknowledged()
    }

    /// The alarm.
    pub fn tag(&self) -> &str {
        &self.fields.tag
    }

    /// Its identity, which an acknowledgement names.
    pub fn id(&self) -> &ByteString {
        &self.id
    }
}

impl AlarmFields {
    /// Whether nothing is left to acknowledge.
    fn is_acknowledged(&self) -> bool {
        !self.state.waits() || self.shelved.is_some()
    }

    /// Whether it comes back by itself (true), or is out of service (false); `None`: it is in
    /// service.
    fn timed_shelf(&self) -> Option<bool> {
        self.shelved.as_ref().map(AlarmShelf::is_timed)
    }

    /// The time until it comes back by itself, ms; 0: it does not.
    fn unshelve_ms(&self) -> f64 {
        let until_ns = self.shelved.as_ref().and_then(|shelf| shelf.until_ns);
        let left_ns = until_ns.map_or(0, |until| until.saturating_sub(unix_ns(&DateTime::now())));
        (left_ns.max(0) / 1_000_000) as f64
    }
}

impl EventFields for AlarmFields {
    fn node(&self) -> Option<&NodeId> {
        Some(&self.condition)
    }

    fn field(&self, path: &str) -> Variant {
        let word = |text: &str| Variant::from(LocalizedText::new("en", text));
        let both = |is: bool, yes: &str, no: &str| word(if is { yes } else { no });
        let (active, acked) = (self.state.is_active(), self.is_acknowledged());
        match path {
            "SourceNode" => Variant::from(self.source.clone()),
            "SourceName" | "ConditionName" => Variant::from(UAString::from(self.tag.as_str())),
            "Message" => word(&self.text),
            "Severity" | "LastSeverity" => Variant::from(severity(self.priority)),
            "BranchId" => Variant::from(NodeId::null()),
            "Retain" => Variant::from(active || !acked || self.shelved.is_some()),
            "EnabledState" => word("Enabled"),
            "EnabledState/Id" => Variant::from(true),
            "ActiveState" => both(active, "Active", "Inactive"),
            "ActiveState/Id" => Variant::from(active),
            "AckedState" => both(acked, "Acknowledged", "Unacknowledged"),
            "AckedState/Id" => Variant::from(acked),
            "Quality" => Variant::from(opcua::types::StatusCode::Good),
            "ClientUserId" => Variant::from(UAString::from(self.who.as_str())),
            "Comment" => word(self.shelved.as_ref().map_or("", |shelf| &shelf.why)),
            "SuppressedOrShelved" => Variant::from(self.shelved.is_some()),
            "MaxTimeShelved" => Variant::from(SHELF_MS_MAX as f64),
            "ShelvingState/CurrentState" => {
                both(self.timed_shelf() == Some(true), "Timed Shelved", "Unshelved")
            }
            "ShelvingState/CurrentState/Id" => {
                Variant::from(NodeId::from(match self.timed_shelf() {
                    Some(true) => ObjectId::ShelvedStateMachineType_TimedShelved,
                    Some(false) | None => ObjectId::ShelvedStateMachineType_Unshelved,
                }))
            }
            "ShelvingState/UnshelveTime" => Variant::from(self.unshelve_ms()),
            "OutOfServiceState" => {
                both(self.timed_shelf() == Some(false), "Out of Service", "In Service")
            }
            "OutOfServiceState/Id" => Variant::from(self.timed_shelf() == Some(false)),
            "ConditionClassId" => {
                Variant::from(NodeId::from(ObjectTypeId::ProcessConditionClassType))
            }
            "ConditionClassName" => word("ProcessConditionClassType"),
            "InputNode" => Variant::from(self.source.clone()),
            _ => Variant::Empty,
        }
    }
}

/// The fields of an event without a condition.
#[derive(Clone, Debug)]
pub struct PlainFields {
    message: &'static str,
    /// The nodes that came and went.
    changes: Vec<ModelChangeStructureDataType>,
}

impl PlainEvent {
    /// An event of this time.
    pub fn now(kind: ObjectTypeId, message: &'static str) -> PlainEvent {
        ToldEvent::new(kind, DateTime::now(), PlainFields { message, changes: Vec::new() })
    }
}

impl EventFields for PlainFields {
    fn node(&self) -> Option<&NodeId> {
        None
    }

    fn field(&self, path: &str) -> Variant {
        match path {
            "SourceNode" => Variant::from(NodeId::from(ObjectId::Server)),
            "SourceName" => Variant::from(UAString::from("Server")),
            "Message" => Variant::from(LocalizedText::new("en", self.message)),
            "Severity" => Variant::from(100_u16),
            "Changes" if !self.changes.is_empty() => {
                let changes = self.changes.iter().cloned().map(ExtensionObject::from_message);
                Variant::from(changes.collect::<Vec<_>>())
            }
            _ => Variant::Empty,
        }
    }
}

/// The names of a path, joined by `/`; `None`: it has names of other namespaces.
fn joined(path: &[QualifiedName]) -> Option<String> {
    let names: Option<Vec<&str>> =
        path.iter().map(|name| (name.namespace_index == 0).then(|| name.name.as_ref())).collect();
    names.map(|names| names.join("/"))
}

impl<F: EventFields> EventField for ToldEvent<F> {
    fn get_value(
        &self,
        attribute_id: AttributeId,
        _: &NumericRange,
        path: &[QualifiedName],
    ) -> Variant {
        let node = self.fields.node();
        match (attribute_id, path, joined(path).as_deref()) {
            // The condition itself: clients name it to acknowledge.
            (AttributeId::NodeId, [], _) => {
                node.map_or(Variant::Empty, |node| Variant::from(node.clone()))
            }
            (AttributeId::Value, _, Some("EventId")) => Variant::from(self.id.clone()),
            (AttributeId::Value, _, Some("EventType")) => Variant::from(self.event_type.clone()),
            (AttributeId::Value, _, Some("Time" | "ReceiveTime")) => Variant::from(self.time),
            (AttributeId::Value, _, Some(path)) => self.fields.field(path),
            _ => Variant::Empty,
        }
    }
}

impl<F: EventFields> Event for ToldEvent<F> {
    fn get_field(
        &self,
        _: &NodeId,
        attribute_id: AttributeId,
        index_range: &NumericRange,
        path: &[QualifiedName],
    ) -> Variant {
        self.get_value(attribute_id, index_range, path)
    }

    fn time(&self) -> &DateTime {
        &self.time
    }

    fn event_type_id(&self) -> &NodeId {
        &self.event_type
    }
}
