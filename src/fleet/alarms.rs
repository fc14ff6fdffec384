//! The alarms that a node tells: JSON in one metric, as `rungd alarms --json` has them.
//!
//! The text comes from outside: what cannot be read is counted, and each list has an end.

use serde::Serialize;
use serde_json::Value;

use super::heard::NodeName;
use crate::operator::protocol::Alarm;

/// The most alarms of a node.
const ALARMS_MAX: usize = 100;

/// An alarm of a node.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct FleetAlarm {
    /// The node.
    #[serde(flatten)]
    pub node: NodeName,
    /// The node's present state: [`super::report::NodeReport::state`]. The alarms of a node that is
    /// not online are those of its last word.
    pub state: String,
    /// The alarm.
    pub alarm: Alarm,
}

/// The alarms of all nodes; the answer of `rungd fleet alarms`.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct FleetAlarmList {
    /// Those that stand, and those that wait for an acknowledgement; node by node.
    pub alarms: Vec<FleetAlarm>,
    /// Nodes whose alarms are not known: no birth of them was heard, or they tell none.
    pub unknown: Vec<NodeName>,
}

/// The alarms of a text, and how many of its entries cannot be read. `None`: it is no list.
pub(super) fn alarms_of(text: &str) -> Option<(Vec<Alarm>, u64)> {
    let list: Value = serde_json::from_str(text).ok()?;
    let list = match list {
        Value::Array(list) => list,
        Value::Object(mut answer) => match answer.remove("alarms") {
            Some(Value::Array(list)) => list,
            Some(_) | None => return None,
        },
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => return None,
    };
    let (mut alarms, mut unread) = (Vec::new(), 0);
    for entry in list {
        match serde_json::from_value::<Alarm>(entry) {
            Ok(alarm) if alarms.len() < ALARMS_MAX => alarms.push(alarm),
            Ok(_) | Err(_) => unread += 1,
        }
    }
    Some((alarms, unread))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_is_an_array_or_an_answer() {
        let one = r#"{"tag":"jam","text":"Jam","priority":"high","state":"acknowledged"}"#;
        let (alarms, unread) = alarms_of(&format!("[{one},7]")).expect("a list");
        assert_eq!((alarms[0].tag.as_str(), alarms.len(), unread), ("jam", 1, 1));
        let answer = format!(r#"{{"mode":"RUN","scans":3,"alarms":[{one}]}}"#);
        assert_eq!(alarms_of(&answer).expect("an answer").0.len(), 1);
    }

    #[test]
    fn what_is_no_list() {
        for text in ["", "7", "null", "{}", r#"{"alarms":7}"#, "[", &"[".repeat(100_000)] {
            assert!(alarms_of(text).is_none(), "{text:.20}");
        }
    }

    #[test]
    fn a_list_has_an_end() {
        let one = r#"{"tag":"jam","text":"Jam"}"#;
        let many = format!("[{}]", vec![one; 150].join(","));
        let (alarms, unread) = alarms_of(&many).expect("a list");
        assert_eq!((alarms.len(), unread), (100, 50));
    }
}
