//! What a node publishes about its controller beside the tags: version, mode, ladder, forces,
//! alarms, and the state of the node's history.
//!
//! `log_thread` makes these facts from a status and the alarm book; `node` publishes the changes.

use serde_json::{Value, json};

use rungd_client::operator::protocol::{AlarmList, AlarmStatus, ControllerStatus};
use rungd_net::sparkplug::{
    BornMetric, DataType, Metric, MetricProperties, MetricValue, vocabulary,
};

/// The facts, with their types, in the order of their aliases.
const FACTS: [(&str, DataType); 16] = [
    (vocabulary::CONTROLLER, DataType::Boolean),
    (vocabulary::VERSION, DataType::String),
    (vocabulary::MODE, DataType::String),
    (vocabulary::MODE_REASON, DataType::String),
    (vocabulary::LADDER, DataType::String),
    (vocabulary::LADDER_SHA256, DataType::String),
    (vocabulary::FORCES, DataType::Int64),
    (vocabulary::OVERRUNS, DataType::Int64),
    (vocabulary::ALARMS, DataType::Int64),
    (vocabulary::ALARMS_UNACKNOWLEDGED, DataType::Int64),
    (vocabulary::ALARMS_SHELVED, DataType::Int64),
    (vocabulary::ALARM_LIST, DataType::String),
    (vocabulary::SCAN, DataType::Int64),
    (vocabulary::HISTORY_LOST, DataType::Int64),
    (vocabulary::HISTORY_REPLAYING, DataType::Boolean),
    (vocabulary::REBIRTH, DataType::Boolean),
];

/// The maximum number of alarms in the list.
const ALARMS_MAX: usize = 100;

/// The aliases of facts are below this number; those of tags start with it.
pub(super) const ALIASES: u64 = 100;

/// A fact: its name and its value.
pub(super) type NodeFact = (&'static str, MetricValue);

/// The known facts, and the facts as last published.
#[derive(Debug, Default)]
pub(super) struct FactTable {
    known: [Option<MetricValue>; FACTS.len()],
    told: [Option<MetricValue>; FACTS.len()],
}

impl FactTable {
    /// Sets a fact.
    pub fn set(&mut self, name: &str, value: MetricValue) {
        let place = FACTS.iter().position(|(known, _)| *known == name);
        if let Some(known) = place.and_then(|at| self.known.get_mut(at)) {
            *known = Some(value);
        }
    }

    /// All facts for a birth. They count as published afterwards.
    pub fn born(&mut self, now_ms: u64) -> Vec<Metric> {
        self.told = self.known.clone();
        let born = FACTS.iter().zip(&self.known).enumerate();
        born.map(|(at, (_, value))| metric(at).born(value.as_ref(), now_ms)).collect()
    }

    /// The facts that have changed since they were last published. A change of the last scan alone
    /// is not published. `all_scans`: the last scan is included in any case.
    pub fn news(&mut self, now_ms: u64, all_scans: bool) -> Vec<Metric> {
        let is_scan = |at: usize| FACTS[at].0 == vocabulary::SCAN;
        let differs = |at: &usize| self.known[*at] != self.told[*at];
        let has_news = all_scans || (0..FACTS.len()).any(|at| differs(&at) && !is_scan(at));
        if !has_news {
            return Vec::new();
        }
        let told = (0..FACTS.len()).filter(|at| differs(at) || all_scans && is_scan(*at));
        let news = told.map(|at| metric(at).data(self.known[at].as_ref(), now_ms));
        let news = news.collect();
        self.told = self.known.clone();
        news
    }
}

/// The metric of the fact at a place of [`FACTS`].
fn metric(at: usize) -> BornMetric {
    let (name, datatype) = FACTS[at];
    let is_command = name == vocabulary::REBIRTH;
    let properties = MetricProperties::default();
    // A command is sent by name, so that a host without the birth can send it.
    let alias = (!is_command).then_some(at as u64);
    BornMetric { name: name.to_owned(), alias, datatype, properties }
}

/// The facts of a status and of the alarm book.
pub(super) fn of_controller(status: &ControllerStatus, alarms: &AlarmList) -> Vec<NodeFact> {
    let count = |count: usize| MetricValue::Signed(i64::try_from(count).unwrap_or(i64::MAX));
    let text = |text: &str| MetricValue::Text(text.to_owned());
    let counted = |fits: &dyn Fn(&AlarmStatus) -> bool| {
        count(alarms.alarms.iter().filter(|alarm| fits(alarm)).count())
    };
    let overruns = i64::try_from(status.scan.overruns).unwrap_or(i64::MAX);
    vec![
        (vocabulary::CONTROLLER, MetricValue::Bool(true)),
        (vocabulary::VERSION, text(&status.version)),
        (vocabulary::MODE, text(&status.mode)),
        (vocabulary::MODE_REASON, text(status.reason.as_deref().unwrap_or_default())),
        (vocabulary::LADDER, text(&status.ladder.name)),
        (vocabulary::LADDER_SHA256, text(&status.ladder.sha256)),
        (vocabulary::FORCES, count(status.forces.len())),
        (vocabulary::OVERRUNS, MetricValue::Signed(overruns)),
        (vocabulary::ALARMS, counted(&AlarmStatus::is_standing)),
        (vocabulary::ALARMS_UNACKNOWLEDGED, counted(&AlarmStatus::waits)),
        (vocabulary::ALARMS_SHELVED, counted(&|alarm| alarm.shelved.is_some())),
        (vocabulary::ALARM_LIST, MetricValue::Text(listed(alarms))),
    ]
}

/// The alarm book, without the fields that change while nothing happens.
fn listed(alarms: &AlarmList) -> String {
    let alarm = |alarm| {
        let mut listed = serde_json::to_value(alarm).unwrap_or_default();
        if let Some(fields) = listed.as_object_mut() {
            fields.remove("lasted_ms");
            fields.remove("day");
        }
        listed
    };
    let all: Vec<Value> = alarms.alarms.iter().take(ALARMS_MAX).map(alarm).collect();
    json!(all).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_changed_fact_is_published_once() {
        let mut facts = FactTable::default();
        facts.set(vocabulary::MODE, MetricValue::Text("RUN".to_owned()));
        assert_eq!(facts.born(5).len(), FACTS.len());
        assert_eq!(facts.news(6, false), []);
        facts.set(vocabulary::SCAN, MetricValue::Signed(3));
        assert_eq!(facts.news(6, false), [], "the last scan alone is no news");
        facts.set(vocabulary::MODE, MetricValue::Text("STOP".to_owned()));
        assert_eq!(facts.news(6, false).len(), 2);
        assert_eq!(facts.news(6, false), []);
        assert_eq!(facts.news(6, true).len(), 1);
        facts.set("no fact", MetricValue::Bool(true));
    }
}
