//! The past of a node, from the scan log: every change as it was recorded, and minimum, maximum
//! and average of intervals.
//!
//! The log is read on a thread for blocking work, one request at a time, with limits on the number
//! of values and on the time.

use std::sync::Arc;
use std::time::{Duration, Instant};

use opcua::server::ContinuationPoint;
use opcua::server::node_manager::HistoryNode;
use opcua::types::{
    DataValue, DateTime, HistoryData, NodeId, ObjectId, ReadProcessedDetails,
    ReadRawModifiedDetails, StatusCode, TimestampsToReturn, Variant,
};
use rungd_client::live::{
    ChangeHistory, ChooseCells, HistorySpan, LogEvent, LogPosition, LoggedProgram, TagType,
    recorded_folder,
};
use rungd_config::controller::OUTPUT_UNKNOWN;
use rungd_fleet::opcua::OpcUaSettings;
use tokio::sync::Mutex;

use crate::follow::PlantController;
use crate::journal::{ClientLine, ServerLines};
use crate::shown::ShownTree;
use crate::tags::{PlantVariable, chooser, tree};
use crate::values::{array, scalar, stamped, time, unix_ns};

/// The most values that one answer has for a node; the rest follows at a continuation point.
const VALUES_MAX: usize = 10_000;
/// The most values that are read of the log for a node.
const READ_MAX: usize = 200_000;
/// The longest time for a read of the log.
const READ_TIME: Duration = Duration::from_secs(20);
/// The most intervals of a processed read.
const INTERVALS_MAX: i64 = 10_000;

/// A value of the past.
#[derive(Clone, Debug, PartialEq)]
struct PastValue {
    unix_ns: i64,
    value: Variant,
    status: StatusCode,
}

/// The rest of an answer.
#[derive(Debug)]
struct PastRest(Vec<PastValue>);

/// Reads the past.
pub struct HistoryReader {
    settings: OpcUaSettings,
    choose: ChooseCells,
    followed: PlantController,
    lines: ServerLines,
    /// One read of the log at a time.
    turn: Mutex<()>,
}

/// A part of the past of a node.
#[derive(Clone, Debug)]
struct PastSpan {
    id: String,
    from_ns: i64,
    until_ns: i64,
}

impl HistoryReader {
    /// A reader of the controller's log.
    pub fn new(
        settings: &OpcUaSettings,
        followed: PlantController,
        lines: ServerLines,
    ) -> HistoryReader {
        let (settings, choose) = (settings.clone(), chooser(settings));
        HistoryReader { settings, choose, followed, lines, turn: Mutex::default() }
    }

    /// Answers a read of recorded values.
    pub async fn raw(
        &self,
        id: &str,
        details: &ReadRawModifiedDetails,
        node: &mut HistoryNode,
        timestamps: TimestampsToReturn,
    ) {
        let rest = node.continuation_point().and_then(|point| point.get::<PastRest>());
        let values = match rest {
            Some(rest) => Ok(rest.0.clone()),
            None => self.recorded(id, details).await,
        };
        let mut values = match values {
            Ok(values) => values,
            Err(status) => return node.set_status(status),
        };
        let asked = details.num_values_per_node as usize;
        let most = if asked == 0 { VALUES_MAX } else { asked.min(VALUES_MAX) };
        if values.len() > most {
            let rest = values.split_off(most);
            node.set_next_continuation_point(Some(ContinuationPoint::new(Box::new(PastRest(
                rest,
            )))));
        }
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
        let (start, end) = (details.start_time, details.end_time);
        let now = DateTime::now();
        // One of the times may be missing, and a read backwards has the later time first.
        let (from, until, is_backwards) = match (start.is_null(), end.is_null()) {
            (true, true) => return Err(StatusCode::BadInvalidArgument),
            (true, false) => (DateTime::null(), end, true),
            (false, true) => (start, now, false),
            (false, false) if end < start => (end, start, true),
            (false, false) => (start, end, false),
        };
        let from_ns = if from.is_null() { i64::MIN / 4 } else { unix_ns(&from) };
        let span = PastSpan { id: id.to_owned(), from_ns, until_ns: unix_ns(&until) };
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
        let step_ns = (details.processing_interval * 1e6) as i64;
        let step_ns = if step_ns > 0 { step_ns } else { until_ns.saturating_sub(from_ns) };
        let count = until_ns.saturating_sub(from_ns).checked_div(step_ns).unwrap_or(0);
        if until_ns <= from_ns || count > INTERVALS_MAX {
            return node.set_status(StatusCode::BadInvalidArgument);
        }
        let span = PastSpan { id: id.to_owned(), from_ns, until_ns };
        match self.read(span, true).await {
            Err(status) => node.set_status(status),
            Ok(values) => {
                let starts = (0..).map(|n| from_ns + n * step_ns);
                let starts = starts.take_while(|start| *start < until_ns);
                let data = starts.map(|start| {
                    let end = (start + step_ns).min(until_ns);
                    aggregate.value(&values, start, end)
                });
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
        let mut program = PastProgram { variable: None, contents: Vec::new() };
        while let Some(events) = history.next_section() {
            for event in events {
                let Some(value) = self.value_after(event, &mut program) else { continue };
                if value.unix_ns < self.span.from_ns {
                    before = Some(value);
                } else if value.unix_ns <= self.span.until_ns {
                    push(&mut found, value);
                } else {
                    return self.bounded(before, found);
                }
            }
            if found.len() >= READ_MAX || began.elapsed() > READ_TIME {
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

/// What is made of the values of an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Aggregate {
    Minimum,
    Maximum,
    /// The mean over time: a value holds until the next.
    Average,
}

impl Aggregate {
    fn of(id: &NodeId) -> Option<Aggregate> {
        let is = |known: ObjectId| *id == known;
        if is(ObjectId::AggregateFunction_Minimum) {
            Some(Aggregate::Minimum)
        } else if is(ObjectId::AggregateFunction_Maximum) {
            Some(Aggregate::Maximum)
        } else if is(ObjectId::AggregateFunction_Average)
            || is(ObjectId::AggregateFunction_TimeAverage)
        {
            Some(Aggregate::Average)
        } else {
            None
        }
    }

    /// The value of an interval; without a number in it, "no data".
    fn value(self, values: &[PastValue], start_ns: i64, end_ns: i64) -> DataValue {
        let mut pieces: Vec<(f64, i64)> = Vec::new();
        for (at, value) in values.iter().enumerate() {
            let until = values.get(at + 1).map_or(end_ns, |next| next.unix_ns);
            let lasted = until.min(end_ns).saturating_sub(value.unix_ns.max(start_ns));
            let is_inside = value.unix_ns < end_ns && until > start_ns;
            if let (true, true, Some(number)) =
                (is_inside, value.status.is_good(), number(&value.value))
            {
                pieces.push((number, lasted));
            }
        }
        let numbers = pieces.iter().map(|(number, _)| *number);
        let result = match self {
            Aggregate::Minimum => numbers.reduce(f64::min),
            Aggregate::Maximum => numbers.reduce(f64::max),
            Aggregate::Average => {
                let time: f64 = pieces.iter().map(|(_, ns)| *ns as f64).sum();
                let sum: f64 = pieces.iter().map(|(number, ns)| number * *ns as f64).sum();
                (time > 0.0).then(|| sum / time)
            }
        };
        match result {
            Some(number) => stamped(Variant::from(number), StatusCode::Good, time(start_ns)),
            None => stamped(Variant::Empty, StatusCode::BadNoData, time(start_ns)),
        }
    }
}

/// A value as a number; `None`: an array.
// A tag's value is of few of the standard's types.
#[allow(clippy::wildcard_enum_match_arm)]
fn number(value: &Variant) -> Option<f64> {
    match value {
        Variant::Boolean(on) => Some(f64::from(u8::from(*on))),
        Variant::UInt16(value) => Some(f64::from(*value)),
        Variant::Int16(value) => Some(f64::from(*value)),
        Variant::Int32(value) => Some(f64::from(*value)),
        Variant::Float(value) => Some(f64::from(*value)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn past(unix_ns: i64, number: f32) -> PastValue {
        PastValue { unix_ns, value: Variant::Float(number), status: StatusCode::Good }
    }

    #[test]
    fn a_value_holds_until_the_next_in_an_average() {
        let values = [past(-5, 2.0), past(10, 4.0), past(30, 100.0)];
        let of = |aggregate: Aggregate, start, end| {
            aggregate.value(&values, start, end).value.expect("a value")
        };
        // 10 ns of 2 and 10 ns of 4.
        assert_eq!(of(Aggregate::Average, 0, 20), Variant::from(3.0));
        assert_eq!(of(Aggregate::Minimum, 0, 20), Variant::from(2.0));
        assert_eq!(of(Aggregate::Maximum, 0, 20), Variant::from(4.0));
        assert_eq!(of(Aggregate::Maximum, 0, 31), Variant::from(100.0));
        let before = Aggregate::Average.value(&values, -100, -50);
        assert_eq!(before.status, Some(StatusCode::BadNoData));
    }
}
