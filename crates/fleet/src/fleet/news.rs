//! The changes that a message causes: the lines of `rungd fleet watch`.

use serde::Serialize;

use super::heard::NodeName;
use rungd_net::sparkplug::MetricValue;

/// A change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FleetChange {
    /// The time of the change, ms since 1970. The time of a value is by the node's clock, if the
    /// message has one. All other times are by this machine's clock, because a will has the time of
    /// its connection.
    pub at_ms: u64,
    /// The node.
    #[serde(flatten)]
    pub node: NodeName,
    /// What changed.
    #[serde(flatten)]
    pub news: FleetNews,
}

/// What changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "what", rename_all = "kebab-case")]
pub enum FleetNews {
    /// The first message from a node came, and it is not a birth.
    Heard,
    /// A birth of a node came.
    Born {
        /// The number of metrics.
        metrics: usize,
    },
    /// The broker or the node itself reports the node's death.
    Died,
    /// From now on the node's values may be old.
    Stale {
        /// The reason.
        why: String,
    },
    /// A metric has a different value.
    Value {
        /// Its name.
        name: String,
        /// Its value; `None`: it has no value.
        #[serde(serialize_with = "plain_value")]
        value: Option<MetricValue>,
        /// What the value means, if its metric says so.
        #[serde(skip_serializing_if = "Option::is_none")]
        text: Option<String>,
        /// Its unit.
        #[serde(skip_serializing_if = "Option::is_none")]
        unit: Option<String>,
        /// Whether the value is from the past, when the link was down.
        #[serde(skip_serializing_if = "std::ops::Not::not")]
        historical: bool,
        /// Whether the value is from a birth and no earlier value is known: the metric may have had
        /// it for long.
        #[serde(skip_serializing_if = "std::ops::Not::not")]
        first: bool,
        /// The time of the value by the node's clock, ms since 1970.
        #[serde(skip)]
        told_ms: Option<u64>,
    },
}

/// Writes a value as JSON: a number, a text, `true`, `false` or `null`.
fn plain_value<S: serde::Serializer>(
    value: &Option<MetricValue>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match value {
        Some(MetricValue::Signed(value)) => serializer.serialize_i64(*value),
        Some(MetricValue::Unsigned(value)) => serializer.serialize_u64(*value),
        // JSON has no infinity: it becomes `null`.
        Some(MetricValue::Real(value)) => serializer.serialize_f64(*value),
        Some(MetricValue::Bool(value)) => serializer.serialize_bool(*value),
        Some(MetricValue::Text(text)) => serializer.serialize_str(text),
        None => serializer.serialize_none(),
    }
}

/// A value for people.
pub fn shown(value: Option<&MetricValue>) -> String {
    match value {
        Some(MetricValue::Signed(value)) => value.to_string(),
        Some(MetricValue::Unsigned(value)) => value.to_string(),
        Some(MetricValue::Real(value)) => value.to_string(),
        Some(MetricValue::Bool(true)) => "ON".to_owned(),
        Some(MetricValue::Bool(false)) => "OFF".to_owned(),
        Some(MetricValue::Text(text)) => text.clone(),
        None => "(no value)".to_owned(),
    }
}
