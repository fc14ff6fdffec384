//! The payload's protocol buffer messages, as far as an edge node and a host of rungd need them.
//!
//! The numbers are those of `sparkplug_b.proto`. Fields that are not named here (metadata, data
//! sets, templates) are skipped when a payload is read.

use prost::Message;
use prost::encoding::{DecodeContext, decode_key, skip_field};

/// The maximum number of metrics of a payload. A metric may have only two bytes, but takes a
/// hundred times as much in memory.
const METRICS_MAX: usize = 50_000;

/// A payload of any message but STATE.
#[derive(Clone, PartialEq, Message)]
pub struct Payload {
    /// The time of its publication, ms since 1970 (UTC).
    #[prost(uint64, optional, tag = "1")]
    pub timestamp: Option<u64>,
    /// The metrics.
    #[prost(message, repeated, tag = "2")]
    pub metrics: Vec<Metric>,
    /// The sequence number: 0 to 255, rises by one with each message; absent in NDEATH and in
    /// commands.
    #[prost(uint64, optional, tag = "3")]
    pub seq: Option<u64>,
}

/// A metric.
#[derive(Clone, PartialEq, Message)]
pub struct Metric {
    /// Its name; in births, and in metrics without an alias.
    #[prost(string, optional, tag = "1")]
    pub name: Option<String>,
    /// The number that replaces its name, from the node's last birth.
    #[prost(uint64, optional, tag = "2")]
    pub alias: Option<u64>,
    /// The time of the value, ms since 1970 (UTC).
    #[prost(uint64, optional, tag = "3")]
    pub timestamp: Option<u64>,
    /// A [`super::DataType`]; in births, and in metrics without an alias.
    #[prost(uint32, optional, tag = "4")]
    pub datatype: Option<u32>,
    /// Whether the value is from the past, and so not the present one.
    #[prost(bool, optional, tag = "5")]
    pub is_historical: Option<bool>,
    /// Whether the value is not to be stored.
    #[prost(bool, optional, tag = "6")]
    pub is_transient: Option<bool>,
    /// Whether there is no value.
    #[prost(bool, optional, tag = "7")]
    pub is_null: Option<bool>,
    /// Its properties, such as unit and limits; in births.
    #[prost(message, optional, tag = "9")]
    pub properties: Option<PropertySet>,
    /// The value.
    #[prost(oneof = "MetricContent", tags = "10, 11, 12, 13, 14, 15, 16")]
    pub content: Option<MetricContent>,
}

/// The value of a metric, as it is sent.
#[derive(Clone, PartialEq, prost::Oneof)]
#[allow(missing_docs)]
pub enum MetricContent {
    /// Integers of up to 32 bits; negative integers are in two's complement. The specification has
    /// `uint32`, whose decoder would silently truncate a longer number.
    #[prost(uint64, tag = "10")]
    Int(u64),
    /// Integers of 64 bits, and times.
    #[prost(uint64, tag = "11")]
    Long(u64),
    #[prost(float, tag = "12")]
    Float(f32),
    #[prost(double, tag = "13")]
    Double(f64),
    #[prost(bool, tag = "14")]
    Boolean(bool),
    #[prost(string, tag = "15")]
    Text(String),
    #[prost(bytes = "vec", tag = "16")]
    Bytes(Vec<u8>),
}

/// Properties: keys, and the same number of values.
#[derive(Clone, PartialEq, Message)]
pub struct PropertySet {
    /// The names.
    #[prost(string, repeated, tag = "1")]
    pub keys: Vec<String>,
    /// The values, in the order of the names.
    #[prost(message, repeated, tag = "2")]
    pub values: Vec<PropertyValue>,
}

/// The value of a property.
#[derive(Clone, PartialEq, Message)]
pub struct PropertyValue {
    /// A [`super::DataType`].
    #[prost(uint32, optional, tag = "1")]
    pub datatype: Option<u32>,
    /// Whether there is no value.
    #[prost(bool, optional, tag = "2")]
    pub is_null: Option<bool>,
    /// The value.
    #[prost(oneof = "PropertyContent", tags = "3, 4, 5, 6, 7, 8")]
    pub content: Option<PropertyContent>,
}

/// The value of a property, as it is sent.
#[derive(Clone, PartialEq, prost::Oneof)]
#[allow(missing_docs)]
pub enum PropertyContent {
    #[prost(uint32, tag = "3")]
    Int(u32),
    #[prost(uint64, tag = "4")]
    Long(u64),
    #[prost(float, tag = "5")]
    Float(f32),
    #[prost(double, tag = "6")]
    Double(f64),
    #[prost(bool, tag = "7")]
    Boolean(bool),
    #[prost(string, tag = "8")]
    Text(String),
}

impl Payload {
    /// The payload as bytes.
    pub fn bytes(&self) -> Vec<u8> {
        self.encode_to_vec()
    }

    /// Reads a payload.
    ///
    /// # Errors
    /// The bytes are no payload: the reason, for people.
    pub fn read(bytes: &[u8]) -> Result<Payload, String> {
        if metrics_in(bytes) > METRICS_MAX {
            return Err(format!("not a Sparkplug payload: it has more than {METRICS_MAX} metrics"));
        }
        Payload::decode(bytes).map_err(|error| format!("not a Sparkplug payload: {error}"))
    }
}

/// The number of metrics in a payload, as far as its fields can be decoded.
fn metrics_in(mut bytes: &[u8]) -> usize {
    let mut metrics = 0;
    while let Ok((tag, wire_type)) = decode_key(&mut bytes) {
        metrics += usize::from(tag == 2);
        if skip_field(wire_type, tag, &mut bytes, DecodeContext::default()).is_err() {
            break;
        }
    }
    metrics
}

impl PropertySet {
    /// The value of a property.
    pub fn get(&self, key: &str) -> Option<&PropertyContent> {
        let at = self.keys.iter().position(|known| known == key)?;
        self.values.get(at)?.content.as_ref()
    }
}
