//! What a command requests: a rebirth, or writes to listed tags. Everything else is refused.
//!
//! The commands come from strangers. This module writes nothing: `node` passes on a few writes per
//! second, and the controller checks each write like a write of an operator.

use super::journal::LineSubject;
use super::tags::{TagMetric, given};
use rungd_client::operator::protocol::GivenValue;
use rungd_net::sparkplug::{DataType, Metric, MetricValue, Payload, ValueFault, vocabulary};

/// The maximum number of metrics of a command that are read.
const METRICS_MAX: usize = 100;

/// The request of a metric of a command.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum CommandRequest {
    /// A new birth of the node.
    Rebirth,
    /// A write of this value to the tag with this name.
    Write(String, GivenValue),
    /// A refused request, with the reason for the journal.
    Refused(LineSubject, String),
}

/// The requests of a command, metric by metric.
pub(super) fn asked(payload: &Payload, tags: &[TagMetric]) -> Vec<CommandRequest> {
    let mut asked: Vec<CommandRequest> =
        payload.metrics.iter().take(METRICS_MAX).filter_map(|metric| one(metric, tags)).collect();
    if payload.metrics.len() > METRICS_MAX {
        let why =
            format!("a command of {} metrics: more than {METRICS_MAX}", payload.metrics.len());
        asked.push(CommandRequest::Refused(LineSubject::UnreadCommand, why));
    }
    asked
}

/// The request of one metric; `None`: it requests nothing.
fn one(metric: &Metric, tags: &[TagMetric]) -> Option<CommandRequest> {
    if metric.name.as_deref() == Some(vocabulary::REBIRTH) {
        let read = metric.content.as_ref().map(|content| DataType::Boolean.read(content));
        return (read == Some(Ok(MetricValue::Bool(true)))).then_some(CommandRequest::Rebirth);
    }
    Some(match write(metric, tags) {
        Ok((name, value)) => CommandRequest::Write(name, value),
        Err((kind, why)) => CommandRequest::Refused(kind, why),
    })
}

/// The tag that a metric writes, and the value.
///
/// # Errors
/// The reason for the refusal, for the journal.
fn write(
    metric: &Metric,
    tags: &[TagMetric],
) -> Result<(String, GivenValue), (LineSubject, String)> {
    let tag = meant(metric, tags).map_err(|why| (LineSubject::UnknownTag, why))?;
    let name = &tag.metric.name;
    if !tag.may_write {
        let why = format!("{name}: `[commands] tags` does not list it");
        return Err((LineSubject::UnlistedTag, why));
    }
    let refused = |why: &str| Err((LineSubject::WrongValue, format!("{name}: {why}")));
    if metric.is_historical == Some(true) {
        return refused("a historical value cannot be a command");
    }
    let Some(content) = &metric.content else { return refused("the command has no value") };
    if metric.is_null == Some(true) {
        return refused("the command has a value, but is_null is true");
    }
    let datatype = match metric.datatype.map(DataType::of) {
        None => tag.metric.datatype,
        Some(Some(datatype)) => datatype,
        Some(None) => return refused("the command's type is unknown"),
    };
    match datatype.read(content) {
        Ok(value) => match given(tag.metric.datatype, &value) {
            Ok(value) => Ok((name.clone(), value)),
            Err(why) => refused(&why),
        },
        Err(ValueFault::WrongField) => {
            refused(&format!("the command's value is not in the field of {}", datatype.name()))
        }
        Err(ValueFault::OutOfRange) => {
            refused(&format!("the command's value is beyond {}", datatype.name()))
        }
    }
}

/// The tag that a metric refers to by its name, its alias, or both.
///
/// # Errors
/// The metric has neither, no published tag has it, or the two belong to different tags.
fn meant<'a>(metric: &Metric, tags: &'a [TagMetric]) -> Result<&'a TagMetric, String> {
    let name = metric.name.as_deref().filter(|name| !name.is_empty());
    let named = name.map(|name| tags.iter().find(|tag| tag.metric.name == name));
    let numbered =
        metric.alias.map(|alias| tags.iter().find(|tag| tag.metric.alias == Some(alias)));
    let shown_name = name.map(shown);
    let shown_alias = metric.alias.map(|alias| format!("alias {alias}"));
    match (named, numbered) {
        (Some(Some(tag)), None) | (None, Some(Some(tag))) => Ok(tag),
        (Some(Some(tag)), Some(Some(other))) if tag.metric.alias == other.metric.alias => Ok(tag),
        (Some(Some(_)), Some(_)) => Err(format!(
            "{} and {} are not the same tag",
            shown_name.unwrap_or_default(),
            shown_alias.unwrap_or_default()
        )),
        (Some(None), _) | (None, Some(None)) => {
            let shown = shown_name.or(shown_alias).unwrap_or_default();
            Err(format!("{shown}: no such tag is published"))
        }
        (None, None) => Err("a metric has neither name nor alias".to_owned()),
    }
}

/// A name from a stranger, shortened for a line of the log.
fn shown(name: &str) -> String {
    let short: String = name.chars().take(60).collect();
    format!("`{short}`")
}

/// The limit on the number of writes per second.
#[derive(Clone, Copy, Debug)]
pub(super) struct CommandPace {
    left: u32,
    since_ms: u64,
}

/// The maximum number of writes per second.
const WRITES_MAX: u32 = 10;

impl CommandPace {
    /// The limit at the start, with all writes left.
    pub fn new() -> CommandPace {
        CommandPace { left: WRITES_MAX, since_ms: 0 }
    }

    /// Whether one more write is allowed. An allowed write is counted.
    pub fn take(&mut self, now_ms: u64) -> bool {
        if now_ms.abs_diff(self.since_ms) >= 1000 {
            *self = CommandPace { left: WRITES_MAX, since_ms: now_ms };
        }
        let may = self.left > 0;
        self.left = self.left.saturating_sub(1);
        may
    }
}
