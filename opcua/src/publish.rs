//! Puts what the controller reports into the address space, and tells the subscriptions: every
//! change with the time of its scan, a lost device as an uncertain value, a controller that does
//! not answer as a bad one. After a gap of the scan log each value is told once more, with the
//! overflow bit: values before it may be missing.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use opcua::nodes::NodeType;
use opcua::server::ServerHandle;
use opcua::types::{
    AttributeId, DataEncoding, DataValue, DateTime, LocalizedText, ModelChangeStructureDataType,
    NodeId, NumericRange, StatusCode, TimestampsToReturn, Variant,
};
use rungd_client::live::{LogPosition, LoggedChange, TagType};
use rungd_client::operator::protocol::{AlarmList, ControllerStatus};
use rungd_config::controller::OUTPUT_UNKNOWN;

use crate::alarms::{ConditionBook, StandingAlarms};
use crate::follow::PlantReport;
use crate::fresh_items::FreshNodes;
use crate::manager::PlantNodes;
use crate::shown::ShownTree;
use crate::space::{self, node_id, property_id};
use crate::status::status_values;
use crate::tags::{PlantNode, PlantVariable};
use crate::values::{array, scalar, stamped, time};

/// The service levels of the standard: a server whose controller answers, and one whose does not.
const SERVICE_LEVELS: (u8, u8) = (255, 1);

/// The verbs of a model change (OPC 10000-3, 9.32.7): a node came, or it went.
const NODE_ADDED: u8 = 1;
const NODE_DELETED: u8 = 2;

/// What the server shows.
pub struct Publisher {
    handle: ServerHandle,
    nodes: Arc<PlantNodes>,
    namespace: u16,
    tree: Arc<ShownTree>,
    /// The contents of the chosen cells.
    contents: Vec<i32>,
    /// The time of each node's value.
    stamps: Vec<DateTime>,
    /// Whether the controller answers.
    answers: bool,
    /// The values of its last status.
    status: Vec<(NodeId, Variant)>,
    /// The status of each value that was set.
    statuses: HashMap<NodeId, StatusCode>,
    /// Where the log continues after a gap that is not told yet.
    gap: Option<LogPosition>,
    alarms: ConditionBook,
}

/// How values are told to the subscriptions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Telling {
    /// Those that changed.
    Changes,
    /// All, with the overflow bit.
    AfterGap,
}

/// A new value of a node.
type NodeValue = (NodeId, DataValue);

impl Publisher {
    /// Before the first report.
    pub fn new(
        handle: ServerHandle,
        nodes: Arc<PlantNodes>,
        standing: StandingAlarms,
    ) -> Publisher {
        let namespace = nodes.inner().namespace();
        let alarms = ConditionBook::new(namespace, standing);
        Publisher {
            handle,
            nodes,
            namespace,
            tree: Arc::default(),
            contents: Vec::new(),
            stamps: Vec::new(),
            answers: false,
            status: Vec::new(),
            statuses: HashMap::new(),
            gap: None,
            alarms,
        }
    }

    /// Shows a report.
    pub fn take(&mut self, report: PlantReport) {
        self.show_report(report);
        self.tell_fresh_items();
    }

    fn show_report(&mut self, report: PlantReport) {
        match report {
            PlantReport::Program(tree, contents, at) => self.begin(tree, contents, at),
            PlantReport::Changes(changes) => self.change(&changes),
            PlantReport::Gap(at) => self.gap = Some(at),
            PlantReport::Present(at) => {
                if !self.answers {
                    self.turn(true, time(at.unix_ns));
                }
            }
            PlantReport::Status(status, alarms) => self.status(&status, &alarms),
            PlantReport::Silent => {
                if self.answers {
                    self.turn(false, DateTime::now());
                }
            }
        }
    }

    /// Shows a program: adds and removes nodes.
    fn begin(&mut self, tree: Arc<ShownTree>, contents: Vec<i32>, at: LogPosition) {
        let changes = self.replace_nodes(&tree);
        let space = self.nodes.address_space().read();
        self.statuses.retain(|id, _| space.find(id).is_some());
        drop(space);
        self.nodes.inner().show(Arc::clone(&tree));
        self.stamps = vec![time(at.unix_ns); tree.tree.nodes.len()];
        (self.tree, self.contents) = (tree, contents);
        self.show(&self.all(), Telling::Changes);
        if !changes.is_empty() {
            self.alarms.model_changed(changes, &self.handle);
        }
    }

    /// Removes the nodes that the new tree lacks or has in another form, and adds its own. Returns
    /// what changed.
    fn replace_nodes(&self, tree: &ShownTree) -> Vec<ModelChangeStructureDataType> {
        let is_kept = |node: &PlantNode| {
            let (old, new) = (self.tree.node(&node.id), tree.node(&node.id));
            old.zip(new).is_some_and(|(old, new)| looks_alike(old, new))
        };
        let mut space = self.nodes.address_space().write();
        let gone: Vec<&PlantNode> =
            self.tree.tree.nodes.iter().filter(|node| !is_kept(node)).collect();
        let new: Vec<&PlantNode> = tree.tree.nodes.iter().filter(|node| !is_kept(node)).collect();
        for node in gone.iter().rev() {
            space::remove(&mut space, self.namespace, &node.id);
        }
        for node in &new {
            space::add(&mut space, self.namespace, node);
        }
        let change = |node: &PlantNode, verb| ModelChangeStructureDataType {
            affected: node_id(self.namespace, &node.id),
            affected_type: space::type_of_node(node),
            verb,
        };
        let gone = gone.into_iter().map(|node| change(node, NODE_DELETED));
        gone.chain(new.into_iter().map(|node| change(node, NODE_ADDED))).collect()
    }

    /// Shows changes, scan by scan: a value of an array may change with several cells of a scan.
    fn change(&mut self, changes: &[LoggedChange]) {
        for scan in changes.chunk_by(|a, b| a.scan == b.scan && a.unix_ns == b.unix_ns) {
            let stamp = scan.first().map_or_else(DateTime::now, |change| time(change.unix_ns));
            let mut moved: Vec<usize> = Vec::new();
            for change in scan {
                if let Some(content) = self.contents.get_mut(change.cell as usize) {
                    *content = change.value;
                }
                moved.extend(self.tree.of_cell(change.cell));
                if let Some(device) = self.tree.device_of_ok(change.cell) {
                    moved.extend(self.tree.moved_by(device));
                }
            }
            moved.sort_unstable();
            moved.dedup();
            for at in &moved {
                self.stamps[*at] = stamp;
            }
            match self.gap.take_if(|_| self.answers) {
                None => self.show(&moved, Telling::Changes),
                Some(_) => self.show_all(stamp, Telling::AfterGap),
            }
        }
        if let Some(at) = self.gap.take_if(|_| self.answers) {
            self.show_all(time(at.unix_ns), Telling::AfterGap);
        }
    }

    /// All values, by the places of their nodes.
    fn all(&self) -> Vec<usize> {
        self.tree.variables().map(|(at, _)| at).collect()
    }

    /// Shows all values with this time.
    fn show_all(&mut self, stamp: DateTime, telling: Telling) {
        self.stamps.fill(stamp);
        self.show(&self.all(), telling);
    }

    /// The controller answers again, or does no more.
    fn turn(&mut self, answers: bool, stamp: DateTime) {
        self.answers = answers;
        let (good, bad) = SERVICE_LEVELS;
        self.handle.set_service_level(if answers { good } else { bad });
        let gap = self.gap.take_if(|_| answers);
        self.show_all(stamp, gap.map_or(Telling::Changes, |_| Telling::AfterGap));
        if !answers {
            let bad = |(id, value): &(NodeId, Variant)| {
                (id.clone(), stamped(value.clone(), StatusCode::BadNoCommunication, stamp))
            };
            self.set(self.status.iter().map(bad).collect(), Telling::Changes);
        }
    }

    fn status(&mut self, status: &ControllerStatus, alarms: &AlarmList) {
        let now = DateTime::now();
        self.status = status_values(self.namespace, status, alarms);
        let good = |(id, value): &(NodeId, Variant)| {
            (id.clone(), stamped(value.clone(), StatusCode::Good, now))
        };
        self.set(self.status.iter().map(good).collect(), Telling::Changes);
        self.alarms.take(alarms, &self.handle);
    }

    /// Shows the values of nodes.
    fn show(&mut self, places: &[usize], telling: Telling) {
        let mut values: Vec<NodeValue> = Vec::with_capacity(places.len());
        for at in places {
            let Some(node) = self.tree.tree.nodes.get(*at) else { continue };
            let Some(variable) = &node.variable else { continue };
            let value = self.value(variable, self.stamps[*at]);
            values.push((node_id(self.namespace, &node.id), value));
            values.extend(self.as_text(node, variable, self.stamps[*at]));
        }
        self.set(values, telling);
    }

    /// The text of a value with texts.
    fn as_text(
        &self,
        node: &PlantNode,
        variable: &PlantVariable,
        stamp: DateTime,
    ) -> Option<NodeValue> {
        if variable.texts.is_empty() || variable.tag_type == TagType::Bit {
            return None;
        }
        let text = space::text_of(variable, self.content(variable.cells[0]));
        let text = Variant::from(LocalizedText::new("", text));
        let id = property_id(self.namespace, &node.id, "ValueAsText");
        Some((id, stamped(text, self.quality(variable), stamp)))
    }

    fn content(&self, cell: u32) -> i32 {
        self.contents.get(cell as usize).copied().unwrap_or_default()
    }

    fn value(&self, variable: &PlantVariable, stamp: DateTime) -> DataValue {
        let mut contents = variable.cells.iter().map(|cell| self.content(*cell));
        let value = match variable.is_array {
            true => array(variable.tag_type, contents),
            false => scalar(variable.tag_type, contents.next().unwrap_or_default()),
        };
        stamped(value, self.quality(variable), stamp)
    }

    /// The status of a value: whether it is what the plant does.
    fn quality(&self, variable: &PlantVariable) -> StatusCode {
        let is_lost = |device: &usize| {
            self.tree.tree.device_ok.get(*device).is_some_and(|ok| self.content(*ok) == 0)
        };
        let is_unknown =
            |cell: &u32| variable.tag_type == TagType::Bit && self.content(*cell) == OUTPUT_UNKNOWN;
        if !self.answers {
            StatusCode::BadNoCommunication
        } else if variable.devices.iter().any(is_lost) {
            StatusCode::UncertainNoCommunicationLastUsableValue
        } else if variable.cells.iter().any(is_unknown) {
            StatusCode::BadNoCommunication
        } else {
            StatusCode::Good
        }
    }

    /// Tells the present values again to the items that may have missed the last change.
    fn tell_fresh_items(&self) {
        let nodes = match self.nodes.inner().fresh.due(Instant::now()) {
            FreshNodes::Some(nodes) => nodes,
            FreshNodes::All => self.statuses.keys().cloned().collect(),
        };
        if nodes.is_empty() {
            return;
        }
        let space = self.nodes.address_space().read();
        let mut notifier = self.handle.subscriptions().data_notifier();
        for id in nodes {
            let Some(NodeType::Variable(variable)) = space.find(&id) else { continue };
            if let Some(mut items) = notifier.notify_for(&id, AttributeId::Value) {
                let value = variable.value(
                    TimestampsToReturn::Both,
                    &NumericRange::None,
                    &DataEncoding::Binary,
                    0.0,
                );
                items.data_value(notification(&value, Telling::Changes));
            }
        }
    }

    /// Sets the values of nodes and tells the subscriptions, in one piece: an item that a client
    /// creates meanwhile begins with the old values or with the new ones.
    ///
    /// The library compares only the values of an item without a filter, so a status that changes
    /// alone would never be told (by the standard it is). So what is bad is told without its value,
    /// and another status behind a missing value, which an item that had none yet is not told. So
    /// is a value after a gap. Without a source time the sampling interval lets them through.
    fn set(&mut self, values: Vec<NodeValue>, telling: Telling) {
        let mut space = self.nodes.address_space().write();
        let mut notifier = self.handle.subscriptions().data_notifier();
        for (id, value) in values {
            let status = value.status();
            let turned = match self.statuses.get_mut(&id) {
                Some(old) => std::mem::replace(old, status) != status,
                None => {
                    self.statuses.insert(id.clone(), status);
                    false
                }
            };
            if let Some(mut items) = notifier.notify_for(&id, AttributeId::Value) {
                if (turned || telling == Telling::AfterGap) && !status.is_bad() {
                    items.data_value(missing());
                }
                items.data_value(notification(&value, telling));
            }
            // A node that is missing was removed by a reload in between.
            if let Some(NodeType::Variable(variable)) = space.find_mut(&id) {
                variable.set_data_value(value);
            }
        }
    }
}

/// A value as the subscriptions are told it.
fn notification(value: &DataValue, telling: Telling) -> DataValue {
    let (mut value, status) = (value.clone(), value.status());
    if status.is_bad() {
        (value.value, value.source_timestamp) = (None, None);
    }
    if telling == Telling::AfterGap {
        value.status = Some(status.set_overflow(true));
    }
    value
}

/// No value, for the moment in which a status changes.
fn missing() -> DataValue {
    DataValue {
        status: Some(StatusCode::BadWaitingForInitialData),
        server_timestamp: Some(DateTime::now()),
        ..DataValue::default()
    }
}

/// Whether two nodes look the same to a client. Their cells may differ.
fn looks_alike(old: &PlantNode, new: &PlantNode) -> bool {
    let face = |node: &PlantNode| PlantNode {
        variable: node.variable.clone().map(|variable| PlantVariable {
            cells: vec![0; variable.cells.len()],
            devices: Vec::new(),
            ..variable
        }),
        ..node.clone()
    };
    face(old) == face(new)
}
