//! The only command that `rungd fleet` can send: a request for a birth (specification, 5.17).
//!
//! It is sent only with `--rebirth`. It changes no value of a controller, but the node sends all
//! its values.

use super::heard::NodeName;
use rungd_net::sparkplug::{
    DataType, MessageKind, Metric, MetricValue, Payload, Topic, metric_of, vocabulary,
};

/// The topic and the bytes of a request.
pub(crate) fn rebirth_request(node: &NodeName, now_ms: u64) -> (String, Vec<u8>) {
    let topic = Topic::of_node(&node.group, MessageKind::NodeCommand, &node.node);
    let value = metric_of(DataType::Boolean, Some(&MetricValue::Bool(true)), now_ms);
    let metric = Metric {
        name: Some(vocabulary::REBIRTH.to_owned()),
        datatype: Some(DataType::Boolean.number()),
        ..value
    };
    let payload = Payload { timestamp: Some(now_ms), metrics: vec![metric], seq: None };
    (topic.to_string(), payload.bytes())
}
