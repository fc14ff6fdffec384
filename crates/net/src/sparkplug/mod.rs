//! Sparkplug B 3.0: topics, payloads, types, sequence numbers, a host's state. Pure.
//!
//! `edge` publishes with it, `fleet` reads with it. The source is the Eclipse Sparkplug
//! Specification 3.0 (chapters 4 to 6). Any bytes may come in: the worst result is an error.
//! Deliberately absent: MQTT (see `mqtt`), and the check of the order of messages, which the
//! callers do.

mod host_state;
mod metric;
mod pattern;
mod payload;
mod sequence;
mod topic;
mod types;
pub mod vocabulary;

pub use host_state::HostState;
pub use metric::{BornMetric, MetricProperties, metric_of};
pub use pattern::fits;
pub use payload::{Metric, MetricContent, Payload, PropertyContent, PropertySet, PropertyValue};
pub use sequence::Sequence;
pub use topic::{MessageKind, NameFault, Topic, check_name};
pub use types::{DataType, MetricValue, ValueFault};
