//! Payloads read and written by a foreign library, pysparkplug: it reads the values that rungd
//! sends, and `FleetView` reads its values.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use rungd_fleet::fleet::{FleetLimits, FleetView, ReceivedMessage};
use rungd_net::sparkplug::{
    BornMetric, DataType, MessageKind, MetricProperties, MetricValue, Payload, Topic,
};
use serde_json::{Value, json};

use crate::fleet::broker::program;
use rungd_test_support::needs::{python_can, usable};

const NOW_MS: u64 = 1_790_000_000_000;

/// Everything of the library that the script names.
const NEEDED: &str = "import pysparkplug as spb; spb.NBirth, spb.NData, spb.NDeath, spb.NCmd";

/// A Python that has the library; prints a message if there is none.
pub fn library() -> Option<PathBuf> {
    let python = program("python3")
        .into_iter()
        .chain([std::env::temp_dir().join("rungd-ci-venv/bin/python3")])
        .find(|python| {
            let mut tried = Command::new(python);
            tried.args(["-c", NEEDED]).stderr(Stdio::null());
            tried.status().is_ok_and(|status| status.success())
        });
    if python.is_none() {
        usable(python_can(Path::new("python3"), "pysparkplug", NEEDED));
    }
    python
}

/// The output of the script.
fn script(python: &Path, mode: &str, input: &str) -> String {
    let script =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fleet/foreign/sparkplug_host.py");
    let mut command = Command::new(python);
    command.arg(script).arg(mode).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// The messages as the library reads them, one JSON value each.
pub fn seen(python: &Path, messages: &[(String, Vec<u8>)]) -> Vec<Value> {
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let lines = messages.iter().map(|(topic, bytes)| format!("{topic} {}\n", hex(bytes)));
    let printed = script(python, "read", &lines.collect::<String>());
    printed.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// The least and largest values of the types, with the same values in JSON.
fn extremes() -> Vec<(DataType, MetricValue, Value)> {
    let signed = |of, value: i64| (of, MetricValue::Signed(value), json!(value));
    let unsigned = |of, value: u64| (of, MetricValue::Unsigned(value), json!(value));
    vec![
        signed(DataType::Int8, -128),
        signed(DataType::Int16, -32_768),
        signed(DataType::Int16, -1),
        signed(DataType::Int16, 32_767),
        signed(DataType::Int32, i32::MIN.into()),
        signed(DataType::Int32, i32::MAX.into()),
        signed(DataType::Int64, i64::MIN),
        signed(DataType::Int64, i64::MAX),
        unsigned(DataType::UInt8, 255),
        unsigned(DataType::UInt16, 65_535),
        unsigned(DataType::UInt32, u32::MAX.into()),
        unsigned(DataType::UInt64, u64::MAX),
        (DataType::Float, MetricValue::Real(0.5), json!(0.5)),
        (DataType::Double, MetricValue::Real(0.1), json!(0.1)),
        (DataType::Boolean, MetricValue::Bool(true), json!(true)),
        (DataType::String, MetricValue::Text("Füllstand".to_owned()), json!("Füllstand")),
    ]
}

fn metric(at: usize, datatype: DataType) -> BornMetric {
    let (name, alias) = (format!("metric{at}"), Some(at as u64));
    BornMetric { name, alias, datatype, properties: MetricProperties::default() }
}

#[test]
fn a_foreign_sparkplug_library_reads_all_values() {
    let Some(python) = library() else { return };
    let all = extremes();
    let topic = |kind| Topic::of_node("plant", kind, "press").to_string();
    let born = all
        .iter()
        .enumerate()
        .map(|(at, (of, value, _))| metric(at, *of).born(Some(value), NOW_MS));
    let birth = Payload { timestamp: Some(NOW_MS), metrics: born.collect(), seq: Some(0) };
    let told = all.iter().enumerate().map(|(at, (of, value, _))| {
        let mut told = metric(at, *of).data(Some(value), NOW_MS + 1);
        told.is_historical = Some(true);
        told
    });
    let data = Payload { timestamp: Some(NOW_MS), metrics: told.collect(), seq: Some(1) };
    let none = metric(0, DataType::Int8).data(None, NOW_MS);
    let none = Payload { timestamp: Some(NOW_MS), metrics: vec![none], seq: Some(2) };
    let messages = [
        (topic(MessageKind::NodeBirth), birth.bytes()),
        (topic(MessageKind::NodeData), data.bytes()),
        (topic(MessageKind::NodeData), none.bytes()),
    ];
    let seen = seen(&python, &messages);
    for (at, (datatype, _, value)) in all.iter().enumerate() {
        let expected = json!({
            "name": format!("metric{at}"), "type": datatype.name().to_uppercase(),
            "value": value, "timestamp": NOW_MS, "historical": false, "null": false,
        });
        assert_eq!(seen[0]["metrics"][at], expected);
        let past = &seen[1]["metrics"][at];
        assert_eq!((&past["value"], &past["historical"]), (value, &json!(true)));
    }
    assert_eq!(seen[2]["metrics"][0]["null"], json!(true));
    assert_eq!([&seen[0]["seq"], &seen[1]["seq"]], [&json!(0), &json!(1)]);
}

#[test]
fn messages_of_a_foreign_sparkplug_library_are_read() {
    let Some(python) = library() else { return };
    let printed = script(&python, "write", "");
    let mut view = FleetView::new(FleetLimits::default(), None);
    let mut states = Vec::new();
    for line in printed.lines() {
        let (topic, hex) = line.split_once(' ').unwrap();
        let byte = |at: usize| u8::from_str_radix(&hex[2 * at..2 * at + 2], 16).unwrap();
        let payload: Vec<u8> = (0..hex.len() / 2).map(byte).collect();
        view.hear(ReceivedMessage { topic, payload: &payload, is_retained: false }, NOW_MS);
        let report = serde_json::to_value(view.report(NOW_MS)).unwrap();
        let node = &report["nodes"][0];
        states.push((node["state"].clone(), node["mode"].clone()));
        assert_eq!((&node["forces"], &node["history_replaying"]), (&json!(2), &json!(true)));
        assert_eq!((&node["values_refused"], &node["gaps"]), (&json!(0), &json!(0)), "{node}");
    }
    let expected = [("online", "RUN"), ("online", "STOP"), ("offline", "STOP")];
    assert_eq!(states, expected.map(|(state, mode)| (json!(state), json!(mode))));
}
