//! The metrics of a node: their definitions in its birth, and the newest value of each.
//!
//! [`super::node`] decides which messages count. This module keeps names, aliases and types: it
//! refuses values that do not fit the birth, and metrics beyond the limits.

use std::collections::HashMap;

use super::limits::NodeRoom;
use rungd_language::resolve::value_texts::text_in_list;
use rungd_net::sparkplug::{DataType, Metric, MetricContent, MetricValue, PropertyContent};

/// The bytes that a metric takes beside its texts.
const METRIC_BYTES: usize = 200;

/// The metrics of a node.
#[derive(Clone, Debug, Default)]
pub(super) struct MetricTable {
    metrics: Vec<KnownMetric>,
    names: HashMap<String, usize>,
    aliases: HashMap<u64, usize>,
    /// The bytes of the whole table, approximately.
    bytes: usize,
}

/// A metric with its newest value.
#[derive(Clone, Debug)]
pub(super) struct KnownMetric {
    pub name: String,
    /// `None`: a type that rungd does not know. Its values are not read.
    datatype: Option<DataType>,
    pub unit: Option<String>,
    /// What its values mean: `0 = idle; 1 = dosing`.
    pub texts: Option<String>,
    /// `None`: the node sent no value, or the value cannot be read.
    pub value: Option<MetricValue>,
}

impl KnownMetric {
    /// The number of its type.
    pub fn number(&self) -> Option<u32> {
        self.datatype.map(DataType::number)
    }

    /// What its value means, if the birth says it.
    pub fn text(&self) -> Option<&str> {
        let content = match self.value.as_ref()? {
            MetricValue::Signed(value) => *value,
            MetricValue::Unsigned(value) => i64::try_from(*value).ok()?,
            MetricValue::Bool(value) => i64::from(*value),
            MetricValue::Real(_) | MetricValue::Text(_) => return None,
        };
        text_in_list(self.texts.as_deref()?, content)
    }
}

/// The reason why a metric of a message was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MetricFault {
    /// The birth has no such alias, or no such name.
    Unknown(Option<u64>),
    /// The metric has neither a name nor an alias.
    Nameless,
    /// The birth has the name or the alias twice.
    Twice,
    /// The metric is beyond the limits.
    Limit,
    /// The value is not of the type of the birth.
    Value,
}

impl MetricTable {
    pub fn len(&self) -> usize {
        self.metrics.len()
    }

    pub fn bytes(&self) -> usize {
        self.bytes
    }

    pub fn get(&self, name: &str) -> Option<&KnownMetric> {
        self.names.get(name).and_then(|at| self.metrics.get(*at))
    }

    /// Adds a metric of a birth.
    pub fn born(&mut self, metric: &Metric, room: NodeRoom) -> Result<(), MetricFault> {
        let limits = room.limits;
        let name = metric.name.as_deref().ok_or(MetricFault::Nameless)?;
        let is_taken = metric.alias.is_some_and(|alias| self.aliases.contains_key(&alias));
        if is_taken || self.names.contains_key(name) {
            return Err(MetricFault::Twice);
        }
        let unit = property(metric, "engUnit", limits.name_bytes_max);
        let texts = property(metric, "texts", limits.text_bytes_max);
        let bytes = |text: &Option<String>| text.as_ref().map_or(0, String::len);
        let own = METRIC_BYTES + 2 * name.len() + bytes(&unit) + bytes(&texts);
        let is_full = self.metrics.len() >= limits.metrics_max
            || name.len() > limits.name_bytes_max
            || self.bytes.saturating_add(own) > room.bytes;
        if is_full {
            return Err(MetricFault::Limit);
        }
        let at = self.metrics.len();
        self.bytes += own;
        self.names.insert(name.to_owned(), at);
        metric.alias.map(|alias| self.aliases.insert(alias, at));
        let datatype = metric.datatype.and_then(DataType::of);
        let name = name.to_owned();
        self.metrics.push(KnownMetric { name, datatype, unit, texts, value: None });
        self.take(at, metric, room).map(drop)
    }

    /// The position of the metric that a message refers to.
    pub fn find(&self, metric: &Metric) -> Result<usize, MetricFault> {
        match (&metric.name, metric.alias) {
            // A name takes precedence over an alias: it is not ambiguous.
            (Some(name), alias) => self.names.get(name).copied().ok_or(MetricFault::Unknown(alias)),
            (None, Some(alias)) => {
                self.aliases.get(&alias).copied().ok_or(MetricFault::Unknown(Some(alias)))
            }
            (None, None) => Err(MetricFault::Nameless),
        }
    }

    pub fn at(&self, at: usize) -> &KnownMetric {
        &self.metrics[at]
    }

    /// Takes a value; returns whether it differs from the previous one.
    pub fn take(
        &mut self,
        at: usize,
        metric: &Metric,
        room: NodeRoom,
    ) -> Result<bool, MetricFault> {
        let known = &mut self.metrics[at];
        let value = value(known.datatype, metric)?;
        let (old, new) = (text_bytes(known.value.as_ref()), text_bytes(value.as_ref()));
        let bytes = self.bytes - old + new;
        if new > room.limits.text_bytes_max || bytes > room.bytes {
            // Otherwise the old value would be taken for the present one.
            (known.value, self.bytes) = (None, self.bytes - old);
            return Err(MetricFault::Limit);
        }
        self.bytes = bytes;
        let is_new = known.value != value;
        known.value = value;
        Ok(is_new)
    }
}

/// The value in a message; `None`: there is no value, or its type is not known.
fn value(datatype: Option<DataType>, metric: &Metric) -> Result<Option<MetricValue>, MetricFault> {
    match (&metric.content, metric.is_null, datatype) {
        (None, ..) | (_, Some(true), _) | (.., None) => Ok(None),
        (Some(content), _, Some(datatype)) => {
            datatype.read(content).map(Some).map_err(|_| MetricFault::Value)
        }
    }
}

/// A metric with a name and a value that is taken without a birth, because no birth was requested
/// from its node. The type is that of the message, or the widest of its field.
pub(super) fn told_by_name(metric: &Metric) -> Option<Metric> {
    let content = metric.content.as_ref()?;
    metric.name.as_ref()?;
    let widest = match content {
        MetricContent::Int(_) => DataType::UInt32,
        MetricContent::Long(_) => DataType::Int64,
        MetricContent::Float(_) => DataType::Float,
        MetricContent::Double(_) => DataType::Double,
        MetricContent::Boolean(_) => DataType::Boolean,
        MetricContent::Text(_) => DataType::String,
        MetricContent::Bytes(_) => return None,
    };
    let datatype = metric.datatype.or(Some(widest.number()));
    Some(Metric { datatype, alias: None, ..metric.clone() })
}

fn text_bytes(value: Option<&MetricValue>) -> usize {
    match value {
        Some(MetricValue::Text(text)) => text.len(),
        Some(
            MetricValue::Signed(_)
            | MetricValue::Unsigned(_)
            | MetricValue::Real(_)
            | MetricValue::Bool(_),
        )
        | None => 0,
    }
}

/// A property that is a text of at most `bytes_max` bytes.
fn property(metric: &Metric, name: &str, bytes_max: usize) -> Option<String> {
    match metric.properties.as_ref()?.get(name) {
        Some(PropertyContent::Text(text)) if text.len() <= bytes_max => Some(text.clone()),
        Some(
            PropertyContent::Text(_)
            | PropertyContent::Int(_)
            | PropertyContent::Long(_)
            | PropertyContent::Float(_)
            | PropertyContent::Double(_)
            | PropertyContent::Boolean(_),
        )
        | None => None,
    }
}
