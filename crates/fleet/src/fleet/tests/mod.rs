//! The view of a fleet: tests with messages as edge nodes and hostile brokers send them.

mod doubts;
mod folder;
mod hostile;
mod nodes;

use super::{FleetChange, FleetLimits, FleetNews, FleetReport, FleetView, ReceivedMessage};
use rungd_net::sparkplug::{
    BornMetric, DataType, MetricProperties, MetricValue, Payload, metric_of, vocabulary,
};

/// A fleet under test, with the time.
pub(super) struct Fleet {
    pub view: FleetView,
    pub now_ms: u64,
}

/// Metrics with their aliases, types and values.
pub(super) type ToldMetrics<'t> = &'t [(&'t str, u64, DataType, MetricValue)];

impl Fleet {
    pub fn new() -> Fleet {
        Fleet { view: FleetView::new(FleetLimits::default(), None), now_ms: 1_000_000 }
    }

    pub fn hear(&mut self, topic: &str, payload: &[u8]) -> Vec<FleetNews> {
        let message = ReceivedMessage { topic, payload, is_retained: false };
        let changes = self.view.hear(message, self.now_ms);
        changes.into_iter().map(|FleetChange { news, .. }| news).collect()
    }

    /// A message of `plant/press`.
    pub fn press(&mut self, kind: &str, payload: &Payload) -> Vec<FleetNews> {
        self.hear(&format!("spBv1.0/plant/{kind}/press"), &payload.bytes())
    }

    /// The birth of `plant/press`.
    pub fn born(&mut self, bd_seq: i64, metrics: ToldMetrics) -> Vec<FleetNews> {
        let payload = birth(bd_seq, metrics, self.now_ms);
        self.press("NBIRTH", &payload)
    }

    /// A value of `plant/press` by its alias.
    pub fn value(&mut self, seq: u64, alias: u64, value: TypedValue) -> Vec<FleetNews> {
        let payload = data(seq, alias, value, self.now_ms);
        self.press("NDATA", &payload)
    }

    pub fn report(&self) -> FleetReport {
        self.view.report(self.now_ms)
    }

    /// The state of the only node.
    pub fn state(&self) -> &'static str {
        self.report().nodes[0].state
    }
}

/// A value of a metric, with its type.
pub(super) struct TypedValue {
    pub datatype: DataType,
    pub value: MetricValue,
}

pub(super) fn birth(bd_seq: i64, metrics: ToldMetrics, now_ms: u64) -> Payload {
    let plain = |name: &str, alias: Option<u64>, datatype: DataType| BornMetric {
        name: name.to_owned(),
        alias,
        datatype,
        properties: MetricProperties::default(),
    };
    let number = plain(vocabulary::BD_SEQ, None, DataType::Int64);
    let mut all = vec![number.born(Some(&MetricValue::Signed(bd_seq)), now_ms)];
    all.extend(metrics.iter().map(|(name, alias, datatype, value)| {
        plain(name, Some(*alias), *datatype).born(Some(value), now_ms)
    }));
    Payload { timestamp: Some(now_ms), metrics: all, seq: Some(0) }
}

pub(super) fn data(
    seq: u64,
    alias: u64,
    TypedValue { datatype, value }: TypedValue,
    now_ms: u64,
) -> Payload {
    let mut metric = metric_of(datatype, Some(&value), now_ms);
    metric.alias = Some(alias);
    Payload { timestamp: Some(now_ms), metrics: vec![metric], seq: Some(seq) }
}

pub(super) fn death(bd_seq: i64, now_ms: u64) -> Payload {
    Payload { seq: None, ..birth(bd_seq, &[], now_ms) }
}

/// The metrics of a press that runs.
pub(super) fn running() -> Vec<(&'static str, u64, DataType, MetricValue)> {
    let text = |text: &str| MetricValue::Text(text.to_owned());
    vec![
        (vocabulary::MODE, 1, DataType::String, text("RUN")),
        (vocabulary::LADDER_SHA256, 2, DataType::String, text("abc")),
        (vocabulary::FORCES, 3, DataType::Int64, MetricValue::Signed(2)),
        (vocabulary::SCAN, 4, DataType::Int64, MetricValue::Signed(100)),
        ("jam", 5, DataType::Boolean, MetricValue::Bool(false)),
        ("level", 6, DataType::Int16, MetricValue::Signed(-7)),
    ]
}
