//! What a message changed: the lines of `rungd fleet watch`.

use serde::Serialize;

use super::heard::NodeName;
use crate::sparkplug::MetricValue;

/// A change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FleetChange {
    /// When it happened: of a value by the node's clock, if it tells; of everything else by this
    /// machine's, because a will has the time of its connection. Ms since 1970.
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
    /// A node was heard of for the first time, and not its birth.
    Heard,
    /// A node told what it has.
    Born {
        /// How many metrics.
        metrics: usize,
    },
    /// The broker or the node itself says that the node is gone.
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
        /// Its value; `None`: there is none.
        #[serde(serialize_with = "plain_value")]
        value: Option<MetricValue>,
        /// Its unit.
        #[serde(skip_serializing_if = "Option::is_none")]
        unit: Option<String>,
        /// It had the value in the past: the link was down then.
        #[serde(skip_serializing_if = "std::ops::Not::not")]
        historical: bool,
        /// It stood in a birth, and none before it is known: it may have had the value for long.
        #[serde(skip_serializing_if = "std::ops::Not::not")]
        first: bool,
        /// When it had the value, by the node's clock; ms since 1970.
        #[serde(skip)]
        told_ms: Option<u64>,
    },
}

/// A value as JSON has it: a number, a text, `true` or `null`.
fn plain_value<S: serde::Serializer>(
    value: &Option<MetricValue>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match value {
        Some(MetricValue::Signed(value)) => serializer.serialize_i64(*value),
        Some(MetricValue::Unsigned(value)) => serializer.serialize_u64(*value),
        // JSON has no infinity: `null`.
        Some(MetricValue::Real(value)) => serializer.serialize_f64(*value),
        Some(MetricValue::Bool(value)) => serializer.serialize_bool(*value),
        Some(MetricValue::Text(text)) => serializer.serialize_str(text),
        None => serializer.serialize_none(),
    }
}

/// A value for people.
pub(crate) fn shown(value: Option<&MetricValue>) -> String {
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
