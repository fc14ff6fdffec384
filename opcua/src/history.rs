//! The past of a node, from the scan log: every change as it was recorded, in `pages`, and minimum,
//! maximum and average of intervals (`aggregate`).
//!
//! The log is read on a thread for blocking work, one request at a time, with limits on the number
//! of values and on the time.

use std::sync::Arc;
use std::time::{Duration, Instant};

use opcua::server::ContinuationPoint;
use opcua::server::node_manager::HistoryNode;
use opcua::types::{
    DataValue, DateTime, HistoryData, ReadProcessedDetails, ReadRawModifiedDetails, StatusCode,
    TimestampsToReturn, Variant,
};
use rungd_client::live::{
    ChangeHistory, ChooseCells, HistorySpan, LogEvent, LogPosition, LoggedProgram, TagType,
    recorded_folder,
};
use rungd_config::controller::OUTPUT_UNKNOWN;
use rungd_fleet::opcua::OpcUaSettings;
use tokio::sync::Mutex;

use crate::aggregate::{Aggregate, PastInterval};
use crate::follow::PlantController;
use crate::journal::{ClientLine, ServerLines};
use crate::pages::{PastPage, PastRest, PastValue, WaitingElements};
use crate::shown::ShownTree;
use crate::tags::{PlantVariable, chooser, tree};
use crate::values::{array, scalar, stamped, time, unix_ns};

/// The most values that one answer has for a node, of arrays the most elements; the rest follows at
/// a continuation point.
const VALUES_MAX: usize = 10_000;
/// The most values that are read of the log for a node, of arrays the most elements.
const READ_MAX: usize = 200_000;
/// The longest time for a read of the log.
const READ_TIME: Duration = Duration::from_secs(20);
/// Reads the past.
pub struct HistoryReader {
    settings: OpcUaSettings,
    choose: ChooseCells,
    followed: PlantController,
    lines: ServerLines,
    /// One read of the log at a time.
    turn: Mutex<()>,
    waiting: WaitingElements,
}

/// A part of the past of a node.
#[derive(Clone, Debug)]
struct PastSpan {
    id: String,
    from_ns: i64,
    until_ns: i64,
}

/// The times of a read of recorded values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawSpan {
    from_ns: i64,
    until_ns: i64,
    /// The latest value comes first.
    is_backwards: bool,
}

impl RawSpan {
    /// The times that a client asks for. One of them may be missing, and a read backwards has the
    /// later time first.
    ///
    /// # Errors
    /// The status of the answer.
    pub fn of(details: &ReadRawModifiedDetails, now: DateTime) -> Result<RawSpan, StatusCode> {
        let (start, end) = (details.start_time, details.end_time);
        let (from, until, is_backwards) = match (start.is_null(), end.is_null()) {
            (true, true) => return Err(StatusCode::BadInvalidArgument),
            (true, false) => (DateTime::null(), end, true),
            (false, true) => (start, now, false),
            (false, false) if end < start => (end, start, true),
            (false, false) => (start, end, false),
        };
        let from_ns = if from.is_null() { i64::MIN / 4 } else { unix_ns(&from) };
        Ok(RawSpan { from_ns, until_ns: unix_ns(&until), is_backwards })
    }
}

impl HistoryReader {
    /// A reader of the controller's log.
    pub fn new(
        settings: &OpcUaSettings,
        followed: PlantController,
        lines: ServerLines,
    ) -> HistoryReader {
        let (settings, choose) = (settings.clone(), chooser(settings));
        HistoryReader {
            settings,
            choose,
            followed,
            lines,
            turn: Mutex::default(),
            waiting: WaitingElements::default(),
        }
    }

    /// Answers a read of recorded values.
    pub async fn raw(
        &self,
        id: &str,
        details: &ReadRawModifiedDetails,
        node: &mut HistoryNode,
        timestamps: TimestampsToReturn,
    ) {
        let asked = details.num_values_per_node as usize;
        let most = if asked == 0 { VALUES_MAX } else { asked.min(VALUES_MAX) };
        let rest = node.continuation_point().and_then(|point| point.get::<PastRest>()).cloned();
        let page = match rest {
            Some(rest) => rest.page(most),
            None => match self.recorded(id, details).await {
                Err(status) => return node.set_status(status),
                Ok(values) => match self.waiting.first_page(values, most) {
                    Some(page) => page,
                    None => return node.set_status(StatusCode::BadNoContinuationPoints),
                },
            },
        };
        let PastPage { values, rest } = page;
        node.set_next_continuation_point(rest.map(|rest| ContinuationPoint::new(Box::new(rest))));
        node.set_status(match values.is_empty() {
            true => StatusCode::GoodNoData,
            false => StatusCode::Good,
        });
        let data = values.into_iter().map(|value| data_value(value, timestamps)).collect();
        node.set_result(HistoryData { data_values: Some(data) });
    }

    /// The recorded values of a span, in the order that the client asks for.
    async fn recorded(
        &self,
        id: &str,
        details: &ReadRawModifiedDetails,
    ) -> Result<Vec<PastValue>, StatusCode> {
        let asked = RawSpan::of(details, DateTime::now())?;
        let RawSpan { from_ns, until_ns, is_backwards } = asked;
        let span = PastSpan { id: id.to_owned(), from_ns, until_ns };
        let mut values = self.read(span, details.return_bounds).await?;
        if is_backwards {
            values.reverse();
        }
        Ok(values)
    }

    /// Answers a read of minimum, maximum or average.
    pub async fn processed(
        &self,
        id: &str,
        details: &ReadProcessedDetails,
        at: usize,
        node: &mut HistoryNode,
    ) {
        let kinds = details.aggregate_type.as_deref().unwrap_or_default();
        let Some(aggregate) = kinds.get(at).and_then(Aggregate::of) else {
            return node.set_status(StatusCode::BadAggregateNotSupported);
        };
        let (from_ns, until_ns) = (unix_ns(&details.start_time), unix_ns(&details.end_time));
        let span = PastInterval { start_ns: from_ns, end_ns: until_ns };
        let Some(intervals) = span.divided(details.processing_interval) else {
            return node.set_status(StatusCode::BadInvalidArgument);
        };
        let span = PastSpan { id: id.to_owned(), from_ns, until_ns };
        match self.read(span, true).await {
            Err(status) => node.set_status(status),
            Ok(values) => {
                let data = intervals.into_iter().map(|one| aggregate.value(&values, one));
                node.set_result(HistoryData { data_values: Some(data.collect()) });
                node.set_status(StatusCode::Good);
            }
        }
    }

    async fn read(&self, span: PastSpan, bounds: bool) -> Result<Vec<PastValue>, StatusCode> {
        let _turn = self.turn.lock().await;
        let (followed, choose) = (self.followed.clone(), Arc::clone(&self.choose));
        let settings = self.settings.clone();
        let read = tokio::task::spawn_blocking(move || {
            PastRead { settings, span, bounds }.values(&followed, choose)
        });
        match read.await {
            Ok(Ok(values)) => Ok(values),
            Ok(Err(why)) => {
                self.lines.say(ClientLine::Past, &format!("the past cannot be read: {why}"));
                Err(StatusCode::BadNoCommunication)
            }
            Err(_) => Err(StatusCode::BadInternalError),
        }
    }
}

/// A read of the log.
struct PastRead {
    settings: OpcUaSettings,
    span: PastSpan,
    /// Whether the value at the beginning is wanted too.
    bounds: bool,
}

/// The program whose cells the changes are of, the node's contents in it, and its variable.
struct PastProgram {
    variable: Option<PlantVariable>,
    contents: Vec<i32>,
}

impl PastRead {
    fn values(
        &self,
        followed: &PlantController,
        choose: ChooseCells,
    ) -> Result<Vec<PastValue>, String> {
        let controller = followed.controller().map_err(|failure| failure.in_one_line())?;
        let status = controller.status().map_err(|failure| failure.in_one_line())?;
        let now_ns = unix_ns(&DateTime::now());
        // Everything before the present position lies in the margin.
        let until = LogPosition {
            process_start_ns: i64::MAX,
            scan: u64::MAX,
            unix_ns: now_ns.max(self.span.until_ns),
        };
        let margin_ns = until.unix_ns.saturating_sub(self.span.from_ns);
        let span = HistorySpan { from: until, margin_ns, until };
        let folder = recorded_folder(&status);
        let (history, _) = ChangeHistory::open(&controller.socket, folder.as_ref(), span, choose)
            .map_err(|failure| failure.to_string())?;
        Ok(self.played(history))
    }

    fn played(&self, mut history: ChangeHistory) -> Vec<PastValue> {
        let began = Instant::now();
        let (mut found, mut before): (Vec<PastValue>, Option<PastValue>) = (Vec::new(), None);
        let mut elements = 0;
        let mut program = PastProgram { variable: None, contents: Vec::new() };
        while let Some(events) = history.next_section() {
            for event in events {
                let Some(value) = self.value_after(event, &mut program) else { continue };
                if value.unix_ns < self.span.from_ns {
                    before = Some(value);
                } else if value.unix_ns <= self.span.until_ns {
                    elements += value.elements();
                    push(&mut found, value);
                } else {
                    return self.bounded(before, found);
                }
                if elements >= READ_MAX {
                    return self.bounded(before, found);
                }
            }
            if began.elapsed() > READ_TIME {
                break;
            }
        }
        self.bounded(before, found)
    }

    /// The values with the one at the beginning, if it is wanted.
    fn bounded(&self, before: Option<PastValue>, mut found: Vec<PastValue>) -> Vec<PastValue> {
        if let Some(before) = before.filter(|_| self.bounds) {
            found.insert(0, before);
        }
        found
    }

    /// The node's value after an event; `None`: it stays.
    fn value_after(&self, event: LogEvent, program: &mut PastProgram) -> Option<PastValue> {
        let (moved, unix_ns) = match event {
            LogEvent::Begins { program: logged, values, at } => {
                program.variable = self.variable(&logged);
                program.contents = values;
                (true, at.unix_ns)
            }
            LogEvent::Changed(change) => {
                *program.contents.get_mut(change.cell as usize)? = change.value;
                let is_of = |variable: &PlantVariable| variable.cells.contains(&change.cell);
                (program.variable.as_ref().is_some_and(is_of), change.unix_ns)
            }
            LogEvent::Missing(gap) => {
                program.variable.as_ref()?;
                let (value, status) = (Variant::Empty, StatusCode::BadNoData);
                return Some(PastValue { unix_ns: gap.from_ns, value, status });
            }
            LogEvent::Jumped { .. } => return None,
        };
        let variable = program.variable.as_ref().filter(|_| moved)?;
        let content = |cell: &u32| program.contents.get(*cell as usize).copied();
        let contents: Vec<i32> = variable.cells.iter().filter_map(content).collect();
        let is_unknown = variable.tag_type == TagType::Bit && contents.contains(&OUTPUT_UNKNOWN);
        let status = if is_unknown { StatusCode::BadNoCommunication } else { StatusCode::Good };
        let value = match variable.is_array {
            true => array(variable.tag_type, contents.into_iter()),
            false => scalar(variable.tag_type, contents.first().copied()?),
        };
        Some(PastValue { unix_ns, value, status })
    }

    fn variable(&self, logged: &LoggedProgram) -> Option<PlantVariable> {
        let playable = &logged.playable;
        let tree = tree(&self.settings, &playable.program, &playable.symbols, &[]);
        ShownTree::new(tree).node(&self.span.id)?.variable.clone()
    }
}

/// Adds a value; of several of one time, the last one counts.
fn push(found: &mut Vec<PastValue>, value: PastValue) {
    match found.last_mut() {
        Some(last) if last.unix_ns == value.unix_ns => *last = value,
        Some(last) if last.value == value.value && last.status == value.status => {}
        Some(_) | None => found.push(value),
    }
}

fn data_value(past: PastValue, timestamps: TimestampsToReturn) -> DataValue {
    let source = time(past.unix_ns);
    let mut value = stamped(past.value, past.status, source);
    value.server_timestamp = Some(source);
    match timestamps {
        TimestampsToReturn::Source => value.server_timestamp = None,
        TimestampsToReturn::Server => value.source_timestamp = None,
        TimestampsToReturn::Both | TimestampsToReturn::Neither | TimestampsToReturn::Invalid => {}
    }
    value
}
