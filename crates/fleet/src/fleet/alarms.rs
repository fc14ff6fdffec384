//! The alarms that a node publishes: JSON in one metric, in the format of `rungd alarms --json`.
//!
//! The text comes from outside: entries that cannot be read are counted, and each list has a limit.

use serde::Serialize;
use serde_json::Value;

use super::heard::NodeName;
use super::limits::{FleetCounts, cut};
use rungd_client::operator::protocol::AlarmStatus;

/// The maximum number of alarms of a node.
const ALARMS_MAX: usize = 100;
/// The maximum number of alarms of all nodes.
const ALL_ALARMS_MAX: usize = 10_000;

/// An alarm of a node.
#[derive(Clone, Debug, Serialize)]
pub struct FleetAlarm {
    /// The node.
    #[serde(flatten)]
    pub node: NodeName,
    /// The node's present state: [`super::report::NodeReport::state`]. For a node that is not
    /// online, the alarms are those that it last published.
    pub state: String,
    /// The alarm.
    pub alarm: AlarmStatus,
}

/// The alarms of all nodes; the answer of `rungd fleet alarms`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FleetAlarmList {
    /// The number of known nodes.
    pub nodes: usize,
    /// The alarms that are ON or wait for an acknowledgement, node by node.
    pub alarms: Vec<FleetAlarm>,
    /// Nodes whose alarms are not known.
    pub unknown: Vec<UnknownAlarms>,
    /// Nodes with alarms that are left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cut: Vec<CutAlarms>,
    /// The counts of messages, and of messages that were left out.
    pub counts: FleetCounts,
}

/// A node whose alarms are not known.
#[derive(Clone, Debug, Serialize)]
pub struct UnknownAlarms {
    #[serde(flatten)]
    pub node: NodeName,
    /// The reason, for people.
    pub why: &'static str,
}

/// A node with alarms that are left out.
#[derive(Clone, Debug, Serialize)]
pub struct CutAlarms {
    /// Its group and name.
    #[serde(flatten)]
    pub node: NodeName,
    /// The number of alarms that cannot be read, or are beyond the limits.
    pub left_out: u64,
}

impl FleetAlarmList {
    /// Adds the alarms of a node from the text of its list.
    pub(super) fn add(&mut self, node: &NodeName, state: &str, text: &str) {
        let Some((mut alarms, mut left_out)) = alarms_of(text) else {
            let why = "its alarm list cannot be read";
            return self.unknown.push(UnknownAlarms { node: node.clone(), why });
        };
        let room = ALL_ALARMS_MAX.saturating_sub(self.alarms.len()).min(alarms.len());
        left_out += (alarms.len() - room) as u64;
        alarms.truncate(room);
        let told = alarms.into_iter().map(|alarm| FleetAlarm {
            node: node.clone(),
            state: state.to_owned(),
            alarm,
        });
        self.alarms.extend(told);
        if left_out > 0 {
            self.cut.push(CutAlarms { node: node.clone(), left_out });
        }
    }
}

/// The alarms of a text, and the number of entries that are left out. `None`: the text is no list.
pub(super) fn alarms_of(text: &str) -> Option<(Vec<AlarmStatus>, u64)> {
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
        match serde_json::from_value::<AlarmStatus>(entry) {
            Ok(alarm) if alarms.len() < ALARMS_MAX => alarms.push(short(alarm)),
            Ok(_) | Err(_) => unread += 1,
        }
    }
    Some((alarms, unread))
}

/// An alarm whose texts are cut to the limit.
fn short(mut alarm: AlarmStatus) -> AlarmStatus {
    alarm.tag = cut(&alarm.tag);
    alarm.text = cut(&alarm.text);
    alarm.watch = alarm.watch.as_deref().map(cut);
    // It says the same as `rungd alarms` at the controller, and may be long.
    alarm.why.clear();
    if let Some(acknowledged) = &mut alarm.acknowledged {
        acknowledged.who = cut(&acknowledged.who);
    }
    if let Some(shelf) = &mut alarm.shelved {
        (shelf.who, shelf.why) = (cut(&shelf.who), cut(&shelf.why));
    }
    alarm
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alarm_list_is_read_from_an_array_or_an_answer() {
        let one = r#"{"tag":"jam","text":"Jam","priority":"high","state":"acknowledged"}"#;
        let (alarms, unread) = alarms_of(&format!("[{one},7]")).expect("a list");
        assert_eq!((alarms[0].tag.as_str(), alarms.len(), unread), ("jam", 1, 1));
        let answer = format!(r#"{{"mode":"RUN","scans":3,"alarms":[{one}]}}"#);
        assert_eq!(alarms_of(&answer).expect("an answer").0.len(), 1);
    }

    #[test]
    fn a_text_that_is_no_alarm_list_is_refused() {
        for text in ["", "7", "null", "{}", r#"{"alarms":7}"#, "[", &"[".repeat(100_000)] {
            assert!(alarms_of(text).is_none(), "{text:.20}");
        }
    }

    #[test]
    fn the_text_of_an_alarm_is_limited() {
        let one = format!(r#"[{{"tag":"jam","text":"{}"}}]"#, "é".repeat(10_000));
        let (alarms, _) = alarms_of(&one).expect("a list");
        assert!(alarms[0].text.len() < 600 && alarms[0].text.ends_with('…'));
    }

    #[test]
    fn omitted_alarms_of_a_list_are_counted() {
        let mut all = FleetAlarmList::default();
        let node = |at: usize| NodeName { group: "plant".to_owned(), node: at.to_string() };
        let one = r#"{"tag":"jam","text":"Jam"}"#;
        all.add(&node(0), "online", &format!("[{one},7,{{}}]"));
        assert_eq!((all.alarms.len(), all.cut[0].left_out), (1, 2));
        all.add(&node(1), "online", "[[[[");
        assert_eq!(all.unknown[0].node, node(1));
        let many = format!("[{}]", vec![one; 100].join(","));
        (2..200).for_each(|at| all.add(&node(at), "online", &many));
        assert_eq!(all.alarms.len(), ALL_ALARMS_MAX);
        let left_out: u64 = all.cut.iter().map(|cut| cut.left_out).sum();
        assert_eq!(left_out, 2 + 1 + 198 * 100 - 10_000);
    }

    #[test]
    fn an_alarm_list_is_limited() {
        let one = r#"{"tag":"jam","text":"Jam"}"#;
        let many = format!("[{}]", vec![one; 150].join(","));
        let (alarms, unread) = alarms_of(&many).expect("a list");
        assert_eq!((alarms.len(), unread), (100, 50));
    }
}
