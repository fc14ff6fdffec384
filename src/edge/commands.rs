//! What a command asks for: a rebirth, or writes to listed tags. Everything else is refused.
//!
//! Bytes of a stranger come in here. Nothing is written by itself: `node` hands writes on, a few a
//! second, and the controller judges each as it judges an operator's.

use super::tags::{TagMetric, given};
use crate::operator::protocol::GivenValue;
use crate::sparkplug::{DataType, Metric, Payload, vocabulary};

/// The most metrics of a command that are looked at.
const METRICS_MAX: usize = 100;

/// What a metric of a command asks for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum AskedCommand {
    /// All births again.
    Rebirth,
    /// A write.
    Write(String, GivenValue),
    /// It is refused: why, for the log.
    Refused(String),
}

/// What a command asks for, metric by metric.
pub(super) fn asked(payload: &Payload, tags: &[TagMetric]) -> Vec<AskedCommand> {
    let mut asked: Vec<AskedCommand> =
        payload.metrics.iter().take(METRICS_MAX).filter_map(|metric| one(metric, tags)).collect();
    if payload.metrics.len() > METRICS_MAX {
        let why =
            format!("a command of {} metrics: more than {METRICS_MAX}", payload.metrics.len());
        asked.push(AskedCommand::Refused(why));
    }
    asked
}

/// `None`: nothing is asked.
fn one(metric: &Metric, tags: &[TagMetric]) -> Option<AskedCommand> {
    let content = metric.content.as_ref();
    if metric.name.as_deref() == Some(vocabulary::REBIRTH) {
        let read = content.map(|content| DataType::Boolean.read(content));
        return match read {
            Some(Ok(crate::sparkplug::MetricValue::Bool(true))) => Some(AskedCommand::Rebirth),
            Some(_) | None => None,
        };
    }
    let is_it = |of: &&TagMetric| match (&metric.name, metric.alias) {
        (Some(name), _) if !name.is_empty() => of.metric.name == *name,
        (_, alias) => alias.is_some() && of.metric.alias == alias,
    };
    let Some(tag) = tags.iter().find(is_it) else {
        let named = metric.name.as_deref().map(shown);
        let named = named.or_else(|| metric.alias.map(|alias| format!("alias {alias}")));
        let named = named.unwrap_or_else(|| "a metric without name and alias".to_owned());
        return Some(AskedCommand::Refused(format!("{named}: no such tag is published")));
    };
    let name = &tag.metric.name;
    let refused = |why: &str| Some(AskedCommand::Refused(format!("{name}: {why}")));
    if !tag.may_write {
        return refused("`[commands] tags` does not list it");
    }
    let Some(content) = content else { return refused("the command has no value") };
    // A command may say its own type; by alias it mostly does not.
    let datatype = match metric.datatype.map(DataType::of) {
        None => tag.metric.datatype,
        Some(Some(datatype)) => datatype,
        Some(None) => return refused("the command's type is unknown"),
    };
    match datatype.read(content) {
        Ok(value) => match given(tag.metric.datatype, &value) {
            Ok(value) => Some(AskedCommand::Write(name.clone(), value)),
            Err(why) => refused(&why),
        },
        Err(_) => refused("the command's value is not of its type"),
    }
}

/// A stranger's name, short enough for a line of the log.
fn shown(name: &str) -> String {
    let short: String = name.chars().take(60).collect();
    format!("`{short}`")
}

/// So many writes in a second, and a few at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct CommandPace {
    left: u32,
    since_ms: u64,
}

/// The most writes in a second.
const WRITES_MAX: u32 = 10;

impl CommandPace {
    /// At the start.
    pub fn new() -> CommandPace {
        CommandPace { left: WRITES_MAX, since_ms: 0 }
    }

    /// Whether one more write may go.
    pub fn take(&mut self, now_ms: u64) -> bool {
        if now_ms.abs_diff(self.since_ms) >= 1000 {
            *self = CommandPace { left: WRITES_MAX, since_ms: now_ms };
        }
        let may = self.left > 0;
        self.left = self.left.saturating_sub(1);
        may
    }
}
