//! Metrics in the form in which callers make them.

use super::payload::{Metric, MetricContent, PropertyContent, PropertySet, PropertyValue};
use super::types::{DataType, MetricValue};

/// A metric of a birth: its definition, which is published once. Data refer to it by its alias.
#[derive(Clone, Debug, PartialEq)]
pub struct BornMetric {
    /// Its name.
    pub name: String,
    /// The number that replaces its name; `None`: it is sent by name.
    pub alias: Option<u64>,
    /// Its type.
    pub datatype: DataType,
    /// Its properties, for people.
    pub properties: MetricProperties,
}

/// The properties of a metric in a birth, for people. Their names are those that common hosts show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MetricProperties {
    /// `engUnit`: the unit.
    pub unit: Option<String>,
    /// `texts`: what its values mean, `0 = idle; 1 = dosing`.
    pub texts: Option<String>,
    /// `documentation`: what it is.
    pub documentation: Option<String>,
    /// `engLow`, `engHigh`: its limits.
    pub limits: Option<(f64, f64)>,
    /// `readOnly`: no command can write it.
    pub is_read_only: Option<bool>,
}

impl BornMetric {
    /// The metric in a birth; `None`: it has no value.
    pub fn born(&self, value: Option<&MetricValue>, timestamp: u64) -> Metric {
        Metric {
            name: Some(self.name.clone()),
            alias: self.alias,
            datatype: Some(self.datatype.number()),
            properties: self.properties.set(),
            ..metric_of(self.datatype, value, timestamp)
        }
    }

    /// The metric in data.
    pub fn data(&self, value: Option<&MetricValue>, timestamp: u64) -> Metric {
        let name = self.alias.is_none().then(|| self.name.clone());
        let datatype = self.alias.is_none().then(|| self.datatype.number());
        let alias = self.alias;
        Metric { name, alias, datatype, ..metric_of(self.datatype, value, timestamp) }
    }
}

/// A value with its time, without name, alias and type. A value that does not fit the type is sent
/// as a missing value.
pub fn metric_of(datatype: DataType, value: Option<&MetricValue>, timestamp: u64) -> Metric {
    let content: Option<MetricContent> = value.and_then(|value| datatype.write(value));
    let is_null = content.is_none().then_some(true);
    Metric { timestamp: Some(timestamp), is_null, content, ..Metric::default() }
}

impl MetricProperties {
    fn set(&self) -> Option<PropertySet> {
        let mut set = PropertySet::default();
        let mut put = |key: &str, datatype: DataType, content: PropertyContent| {
            set.keys.push(key.to_owned());
            let datatype = Some(datatype.number());
            set.values.push(PropertyValue { datatype, is_null: None, content: Some(content) });
        };
        if let Some(unit) = &self.unit {
            put("engUnit", DataType::String, PropertyContent::Text(unit.clone()));
        }
        if let Some(texts) = &self.texts {
            put("texts", DataType::String, PropertyContent::Text(texts.clone()));
        }
        if let Some(text) = &self.documentation {
            put("documentation", DataType::String, PropertyContent::Text(text.clone()));
        }
        if let Some((low, high)) = self.limits {
            put("engLow", DataType::Double, PropertyContent::Double(low));
            put("engHigh", DataType::Double, PropertyContent::Double(high));
        }
        if let Some(is_read_only) = self.is_read_only {
            put("readOnly", DataType::Boolean, PropertyContent::Boolean(is_read_only));
        }
        (!set.keys.is_empty()).then_some(set)
    }
}

#[cfg(test)]
mod tests {
    use super::super::payload::Payload;
    use super::*;

    fn level() -> BornMetric {
        let properties = MetricProperties {
            unit: Some("bar".to_owned()),
            texts: Some("0 = empty; 10 = full".to_owned()),
            documentation: Some("the tank's level".to_owned()),
            limits: Some((0.0, 10.0)),
            is_read_only: Some(true),
        };
        let (name, alias) = ("level".to_owned(), Some(7));
        BornMetric { name, alias, datatype: DataType::Int32, properties }
    }

    #[test]
    fn a_written_birth_is_read_back() {
        let metric = level().born(Some(&MetricValue::Signed(-5)), 1000);
        let payload = Payload { timestamp: Some(1001), metrics: vec![metric], seq: Some(0) };
        assert_eq!(Payload::read(&payload.bytes()), Ok(payload.clone()));
        let set = payload.metrics[0].properties.as_ref().expect("a birth has properties");
        assert_eq!(set.get("engUnit"), Some(&PropertyContent::Text("bar".to_owned())));
        let texts = PropertyContent::Text("0 = empty; 10 = full".to_owned());
        assert_eq!(set.get("texts"), Some(&texts));
        assert_eq!(set.get("engLow"), Some(&PropertyContent::Double(0.0)));
        assert_eq!(set.get("nothing"), None);
    }

    #[test]
    fn data_metrics_carry_only_the_alias() {
        let metric = level().data(Some(&MetricValue::Signed(3)), 5);
        assert_eq!((metric.name, metric.alias, metric.datatype), (None, Some(7), None));
        assert_eq!(metric.content, Some(MetricContent::Int(3)));
        let none = level().data(None, 5);
        assert_eq!((none.is_null, none.content), (Some(true), None));
    }

    /// The bytes of a small payload, by the numbers of `sparkplug_b.proto`: key, value.
    #[test]
    fn the_bytes_of_a_payload_follow_the_specification() {
        let metric = level().data(Some(&MetricValue::Signed(-1)), 5);
        let payload = Payload { timestamp: Some(6), metrics: vec![metric], seq: Some(255) };
        let bytes = [
            0x08, 6, // timestamp
            0x12, 10, // a metric of 10 bytes:
            0x10, 7, // its alias
            0x18, 5, // its timestamp
            0x50, 0xff, 0xff, 0xff, 0xff, 0x0f, // its value, 32 bits of ones
            0x18, 0xff, 0x01, // seq
        ];
        assert_eq!(payload.bytes(), bytes);
    }

    #[test]
    fn an_invalid_payload_is_refused() {
        assert!(Payload::read(&[0x12, 200, 1, 2]).is_err());
        assert!(Payload::read(&[0xff; 40]).is_err());
    }
}
