//! What clients ask of the nodes of the controller: writes, and values of the past. Present values
//! are in the address space, where `publish` puts them.

use std::fmt;
use std::sync::{Arc, RwLock as StdRwLock};
use std::time::Instant;

use async_trait::async_trait;
use opcua::server::CreateMonitoredItem;
use opcua::server::address_space::AddressSpace;
use opcua::server::diagnostics::NamespaceMetadata;
use opcua::server::node_manager::memory::{
    InMemoryNodeManager, InMemoryNodeManagerImpl, InMemoryNodeManagerImplBuilder,
};
use opcua::server::node_manager::{
    HistoryNode, MethodCall, RequestContext, ServerContext, WriteNode,
};
use opcua::sync::RwLock;
use opcua::types::{
    AttributeId, Identifier, NodeId, NumericRange, ReadProcessedDetails, ReadRawModifiedDetails,
    StatusCode, TimestampsToReturn, Variant,
};
use rungd_client::operator::protocol::{ChangedOperands, GivenWrite, Request};
use rungd_fleet::opcua::OpcUaSettings;

use crate::follow::{NotDone, PlantController};
use crate::fresh_items::FreshItems;
use crate::history::HistoryReader;
use crate::journal::{ClientLine, ServerLines};
use crate::reasons::{ReasonedWrite, WRITE_WITH_REASON, add_method};
use crate::shown::ShownTree;
use crate::space::add_frame;
use crate::status::add_status;
use crate::tags::PlantVariable;
use crate::values::{given, given_array};

/// The nodes of the controller.
pub type PlantNodes = InMemoryNodeManager<PlantManager>;

/// The namespace of the nodes: the same for every controller of a name.
fn namespace_uri(settings: &OpcUaSettings) -> String {
    format!("urn:rungd:{}", settings.name)
}

/// Makes the manager of the controller's nodes.
pub struct PlantManagerBuilder {
    /// The settings.
    pub settings: OpcUaSettings,
    /// The controller.
    pub followed: PlantController,
    /// The lines that clients can cause.
    pub lines: ServerLines,
}

impl InMemoryNodeManagerImplBuilder for PlantManagerBuilder {
    type Impl = PlantManager;

    fn build(self, context: ServerContext, space: &mut AddressSpace) -> PlantManager {
        let uri = namespace_uri(&self.settings);
        let namespace = context.type_tree.write().namespaces_mut().add_namespace(&uri);
        space.add_namespace(&uri, namespace);
        add_frame(space, namespace, &self.settings.name);
        add_status(space, namespace);
        add_method(space, namespace);
        let PlantManagerBuilder { settings, followed, lines } = self;
        let history = HistoryReader::new(&settings, followed.clone(), lines.clone());
        let shown = StdRwLock::default();
        let fresh = FreshItems::default();
        PlantManager { namespace, uri, followed, lines, history, shown, fresh }
    }
}

/// Answers requests for the nodes of the controller.
pub struct PlantManager {
    namespace: u16,
    uri: String,
    followed: PlantController,
    lines: ServerLines,
    history: HistoryReader,
    shown: StdRwLock<Arc<ShownTree>>,
    /// The monitored items of the last seconds.
    pub fresh: FreshItems,
}

impl fmt::Debug for PlantManager {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PlantManager").field("uri", &self.uri).finish_non_exhaustive()
    }
}

impl PlantManager {
    /// The number of the namespace.
    pub fn namespace(&self) -> u16 {
        self.namespace
    }

    /// A new program is shown.
    pub fn show(&self, tree: Arc<ShownTree>) {
        if let Ok(mut shown) = self.shown.write() {
            *shown = tree;
        }
    }

    fn shown(&self) -> Arc<ShownTree> {
        self.shown.read().map(|shown| Arc::clone(&shown)).unwrap_or_default()
    }

    /// The writes of the controller for a value of a node, or of a part of an array.
    ///
    /// # Errors
    /// The status of the answer.
    fn writes(
        &self,
        id: &str,
        range: &NumericRange,
        value: &Variant,
    ) -> Result<Vec<GivenWrite>, StatusCode> {
        let shown = self.shown();
        let node = shown.node(id).ok_or(StatusCode::BadNodeIdUnknown)?;
        let variable = node.variable.as_ref().ok_or(StatusCode::BadNotWritable)?;
        if !variable.may_write {
            return Err(StatusCode::BadNotWritable);
        }
        if !variable.is_array {
            if *range != NumericRange::None {
                return Err(StatusCode::BadIndexRangeNoData);
            }
            let value = given(variable.tag_type, value).ok_or(StatusCode::BadTypeMismatch)?;
            return Ok(vec![GivenWrite { operand: id.to_owned(), value }]);
        }
        array_writes(id, variable, value, range)
    }

    /// Carries out a plain write. Returns the status of the answer.
    async fn write_plain(
        &self,
        write: &WriteNode,
        context: &RequestContext,
        space: &RwLock<AddressSpace>,
    ) -> StatusCode {
        let asked = write.value();
        let Some(id) = text_id(&asked.node_id) else { return StatusCode::BadNodeIdUnknown };
        let writes = match (asked.attribute_id, &asked.value.value) {
            (AttributeId::Value, Some(value)) => self.writes(id, &asked.index_range, value),
            (AttributeId::Value, None) => Err(StatusCode::BadTypeMismatch),
            (_, _) => Err(StatusCode::BadNotWritable),
        };
        let writes = match writes {
            Ok(writes) => writes,
            Err(status) => return status,
        };
        // The node says that it is not writable, but not why: the line does.
        if let Err(refusal) = self.followed.judge_without_reason(&writes) {
            return self.report_outcome(&write_words(&writes, context), Err(refusal));
        }
        let judged = {
            let mut space = space.write();
            let types = context.type_tree.read();
            space.validate_node_write(context, asked, &*types).map(|_| ())
        };
        match judged {
            Ok(()) => self.write_in_controller(writes, None, context).await,
            Err(status) => status,
        }
    }

    /// Carries out a write with a reason.
    async fn write_with_reason(&self, call: &mut MethodCall, context: &RequestContext) {
        let wanted = match ReasonedWrite::of(call.arguments()) {
            Ok(wanted) => wanted,
            Err(results) => {
                let why = "the tag is text, and the reason one line of at most 200 characters";
                let refused = Err((StatusCode::BadInvalidArgument, why.to_owned()));
                self.report_outcome(&format!("{} writes with a reason", user(context)), refused);
                return call.set_argument_error(results);
            }
        };
        let status = match self.writes(&wanted.id, &wanted.range, &wanted.value) {
            Ok(writes) => self.write_in_controller(writes, Some(wanted.reason), context).await,
            Err(status) => status,
        };
        call.set_status(status);
    }

    /// Has the controller carry out writes, all in one scan. Returns the status of the answer.
    async fn write_in_controller(
        &self,
        writes: Vec<GivenWrite>,
        reason: Option<String>,
        context: &RequestContext,
    ) -> StatusCode {
        let mut what = write_words(&writes, context);
        if let Some(reason) = &reason {
            what += &format!(" ({reason})");
        }
        let judged = self.followed.judge(&context.token, &writes);
        let for_user = Some(user(context).to_owned());
        let request = Request::WriteSet { writes, for_user, from_page: false, reason };
        let done = match judged {
            Ok(()) => self.followed.ask::<ChangedOperands>(request).await.map(|_| ()),
            Err(refusal) => Err(refusal),
        };
        self.report_outcome(&what, done)
    }

    /// Prints what came of a write. Returns the status of the answer.
    fn report_outcome(&self, what: &str, done: Result<(), NotDone>) -> StatusCode {
        match done {
            Ok(()) => {
                self.lines.say(ClientLine::Write, what);
                StatusCode::Good
            }
            Err((status, why)) => {
                self.lines.say(ClientLine::RefusedWrite, &format!("{what}, and is refused: {why}"));
                status
            }
        }
    }
}

/// What writes do, for a line: of an array its first and its last element.
fn write_words(writes: &[GivenWrite], context: &RequestContext) -> String {
    let user = user(context);
    match writes {
        [] => format!("{user} writes nothing"),
        [one] => format!("{user} writes {}", one.operand),
        [first, .., last] => format!("{user} writes {} to {}", first.operand, last.operand),
    }
}

/// The writes of the elements of an array, whole or a part of it.
///
/// # Errors
/// The status of the answer.
pub fn array_writes(
    id: &str,
    variable: &PlantVariable,
    value: &Variant,
    range: &NumericRange,
) -> Result<Vec<GivenWrite>, StatusCode> {
    let count = variable.cells.len();
    let (first, last) = match range {
        NumericRange::None => (0, count.saturating_sub(1)),
        NumericRange::Index(at) => (*at as usize, *at as usize),
        NumericRange::Range(first, last) => (*first as usize, *last as usize),
        NumericRange::MultipleRanges(_) => return Err(StatusCode::BadIndexRangeInvalid),
    };
    let values = given_array(variable.tag_type, value)
        .or_else(|| given(variable.tag_type, value).map(|value| vec![value]))
        .ok_or(StatusCode::BadTypeMismatch)?;
    if last >= count || first > last || values.len() != last - first + 1 {
        return Err(StatusCode::BadIndexRangeNoData);
    }
    let write = |(at, value)| GivenWrite { operand: format!("{id}[{at}]"), value };
    Ok((first..=last).zip(values).map(write).collect())
}

/// The text of a node's id.
pub fn text_id(id: &NodeId) -> Option<&str> {
    match &id.identifier {
        Identifier::String(text) => Some(text.as_ref()),
        Identifier::Numeric(_) | Identifier::Guid(_) | Identifier::ByteString(_) => None,
    }
}

/// The user in the controller's log.
pub fn user(context: &RequestContext) -> &str {
    match context.token.is_anonymous() {
        true => "opcua",
        false => &context.token.0,
    }
}

#[async_trait]
impl InMemoryNodeManagerImpl for PlantManager {
    async fn init(&self, _: &mut AddressSpace, _: ServerContext) {}

    fn name(&self) -> &str {
        "controller"
    }

    fn namespaces(&self) -> Vec<NamespaceMetadata> {
        vec![NamespaceMetadata {
            namespace_uri: self.uri.clone(),
            namespace_index: self.namespace,
            ..NamespaceMetadata::default()
        }]
    }

    async fn create_value_monitored_items(
        &self,
        context: &RequestContext,
        space: &RwLock<AddressSpace>,
        items: &mut [&mut &mut CreateMonitoredItem],
    ) {
        let wanted: Vec<_> = items.iter().map(|item| item.item_to_monitor()).collect();
        // Before the values are read: what changes behind that is told again.
        self.fresh.note(wanted.iter().map(|item| item.node_id.clone()), Instant::now());
        let stamps = TimestampsToReturn::Both;
        let values = self.read_values(context, space, &wanted, 0.0, stamps).await;
        for (value, item) in values.into_iter().zip(items.iter_mut()) {
            if value.status() != StatusCode::BadAttributeIdInvalid {
                item.set_initial_value(value);
            }
            item.set_status(StatusCode::Good);
        }
    }

    async fn write(
        &self,
        context: &RequestContext,
        space: &RwLock<AddressSpace>,
        nodes: &mut [&mut WriteNode],
    ) -> Result<(), StatusCode> {
        for write in nodes.iter_mut() {
            let status = self.write_plain(write, context, space).await;
            write.set_status(status);
        }
        Ok(())
    }

    async fn call(
        &self,
        context: &RequestContext,
        _: &RwLock<AddressSpace>,
        calls: &mut [&mut &mut MethodCall],
    ) -> Result<(), StatusCode> {
        for call in calls.iter_mut() {
            match text_id(call.method_id()) {
                Some(WRITE_WITH_REASON) => self.write_with_reason(call, context).await,
                Some(_) | None => call.set_status(StatusCode::BadMethodInvalid),
            }
        }
        Ok(())
    }

    async fn history_read_raw_modified(
        &self,
        _: &RequestContext,
        details: &ReadRawModifiedDetails,
        nodes: &mut [&mut &mut HistoryNode],
        timestamps: TimestampsToReturn,
    ) -> Result<(), StatusCode> {
        if details.is_read_modified {
            return Err(StatusCode::BadHistoryOperationUnsupported);
        }
        for node in nodes.iter_mut() {
            let known = text_id(node.node_id()).map(str::to_owned);
            match known.filter(|id| self.shown().node(id).is_some()) {
                Some(id) => self.history.raw(&id, details, node, timestamps).await,
                None => node.set_status(StatusCode::BadNodeIdUnknown),
            }
        }
        Ok(())
    }

    async fn history_read_processed(
        &self,
        _: &RequestContext,
        details: &ReadProcessedDetails,
        nodes: &mut [&mut &mut HistoryNode],
        _: TimestampsToReturn,
    ) -> Result<(), StatusCode> {
        for (at, node) in nodes.iter_mut().enumerate() {
            let known = text_id(node.node_id()).map(str::to_owned);
            match known.filter(|id| self.shown().node(id).is_some()) {
                Some(id) => self.history.processed(&id, details, at, node).await,
                None => node.set_status(StatusCode::BadNodeIdUnknown),
            }
        }
        Ok(())
    }
}
