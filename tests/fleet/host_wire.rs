//! `rungd fleet` at a recording broker: the specification's statements judge its packets, and its
//! output is compared with the delivered messages.

use rungd_net::sparkplug::{
    BornMetric, DataType, HostState, MetricProperties, MetricValue, Payload, metric_of, vocabulary,
};
use serde_json::Value;

use crate::fleet::checker::recorder::{Recorder, now_ms};
use crate::fleet::checker::story::{Connection, Step, Story};
use crate::fleet::checker::{host_rules, judge};
use crate::fleet::fleet_process::FleetProcess;

pub fn metric(name: &str, alias: u64, datatype: DataType) -> BornMetric {
    let properties = MetricProperties::default();
    BornMetric { name: name.to_owned(), alias: Some(alias), datatype, properties }
}

pub fn birth() -> Payload {
    let now = now_ms();
    let text = |text: &str| MetricValue::Text(text.to_owned());
    let list = r#"[{"tag":"jam","text":"Belt jammed","priority":"high","state":"unacknowledged"}]"#;
    let number = BornMetric { alias: None, ..metric(vocabulary::BD_SEQ, 0, DataType::Int64) };
    let told = [
        (metric(vocabulary::MODE, 1, DataType::String), text("RUN")),
        (metric(vocabulary::LADDER, 2, DataType::String), text("press")),
        (metric(vocabulary::SCAN, 3, DataType::Int64), MetricValue::Signed(100)),
        (metric(vocabulary::ALARMS, 4, DataType::Int64), MetricValue::Signed(1)),
        (metric(vocabulary::ALARM_LIST, 5, DataType::String), text(list)),
        (metric("jam", 6, DataType::Boolean), MetricValue::Bool(false)),
    ];
    let told = told.iter().map(|(metric, value)| metric.born(Some(value), now));
    let metrics = [number.born(Some(&MetricValue::Signed(0)), now)].into_iter().chain(told);
    Payload { timestamp: Some(now), metrics: metrics.collect(), seq: Some(0) }
}

pub fn data(seq: u64, value: bool) -> Payload {
    let now = now_ms();
    let mut jam = metric_of(DataType::Boolean, Some(&MetricValue::Bool(value)), now);
    jam.alias = Some(6);
    Payload { timestamp: Some(now), metrics: vec![jam], seq: Some(seq) }
}

pub const BIRTH: &str = "spBv1.0/plant/NBIRTH/press";
pub const DATA: &str = "spBv1.0/plant/NDATA/press";

pub fn subscribed(connections: &[Connection]) -> bool {
    connections.last().is_some_and(|last| last.subscribed().next().is_some())
}

pub fn sent(connections: &[Connection], topic: &str) -> usize {
    let all = connections.iter().flat_map(Connection::sent);
    all.filter(|published| published.topic == topic).count()
}

pub fn is_over(connections: &[Connection]) -> bool {
    let last = connections.last().and_then(|it| it.steps.last());
    matches!(last, Some(Step::Disconnected(_)))
}

/// A session of a host with its state and a request for a birth, with a version of MQTT.
fn session(version: &str) -> (Recorder, Value) {
    let recorder = Recorder::start();
    let arguments = [
        "status",
        "--broker",
        &recorder.url,
        "--mqtt",
        version,
        "--host-id",
        "room",
        "--rebirth",
        "--wait",
        "8s",
        "--json",
    ];
    let fleet = FleetProcess::start(&arguments);
    recorder.until("its state", |it| sent(it, "spBv1.0/STATE/room") == 1);
    recorder.deliver(DATA, data(41, true).bytes());
    recorder.until("a request", |it| sent(it, "spBv1.0/plant/NCMD/press") == 1);
    recorder.deliver(BIRTH, birth().bytes());
    recorder.deliver(DATA, data(1, true).bytes());
    let death = HostState { online: false, timestamp: 5 }.bytes();
    recorder.deliver("spBv1.0/STATE/room", death);
    recorder.until("its state again", |it| sent(it, "spBv1.0/STATE/room") >= 2);
    let (code, out, errors) = fleet.stop();
    assert_eq!(code, 0, "{out}{errors}");
    (recorder, serde_json::from_str(&out).unwrap_or_else(|error| panic!("{error}: {out}")))
}

#[test]
fn a_host_follows_every_checked_statement_of_sparkplug() {
    for version in ["3.1.1", "5"] {
        let (recorder, report) = session(version);
        recorder.until("its end", is_over);
        let host = Some("room".to_owned());
        let story = Story { host, connections: recorder.connections(), ..Story::default() };
        assert_eq!(judge(&host_rules(), &story), Vec::<String>::new(), "{story:#?}");
        let node = &report["nodes"][0];
        let told = ["group", "node", "state", "mode", "ladder"].map(|key| node[key].as_str());
        let expected = ["plant", "press", "online", "RUN", "press"].map(Some);
        assert_eq!((told, &node["alarms"], &node["births"]), (expected, &1.into(), &1.into()));
    }
}

/// Without an option that requires it, `rungd fleet` publishes nothing.
#[test]
fn a_fleet_command_without_options_publishes_nothing() {
    let recorder = Recorder::start();
    let fleet = FleetProcess::start(&["status", "--broker", &recorder.url, "--wait", "1h"]);
    recorder.until("its subscriptions", subscribed);
    recorder.deliver(DATA, data(41, true).bytes());
    let (code, out, errors) = fleet.stop();
    assert_eq!((code, errors.as_str()), (0, ""));
    assert!(out.starts_with("1 node, heard for ") && out.contains(": 1 unborn\n"), "{out}");
    assert!(out.contains("plant/press: no birth was received"), "{out}");
    assert!(out.contains("`--rebirth` requests it"), "{out}");
    let connections = recorder.connections();
    assert_eq!(connections[0].sent().count(), 0, "{connections:#?}");
    assert!(connections[0].connect.will.is_none() && is_over(&connections));
}

#[test]
fn the_alarms_of_a_node_are_listed() {
    let recorder = Recorder::start();
    let fleet = FleetProcess::start(&["alarms", "--broker", &recorder.url, "--wait", "1h"]);
    recorder.until("its subscriptions", subscribed);
    recorder.deliver(BIRTH, birth().bytes());
    let (code, out, errors) = fleet.stop();
    assert_eq!((code, errors.as_str()), (0, ""));
    assert!(out.starts_with("1 active alarm\nplant/press (online)\n  jam: Belt jammed\n"), "{out}");
}

/// After a connection breaks, every node is stale and the host connects again.
#[test]
fn each_change_is_printed_as_one_line() {
    let recorder = Recorder::start();
    let arguments = ["watch", "--broker", &recorder.url, "--json", "jam"];
    let fleet = FleetProcess::start(&arguments);
    recorder.until("its subscriptions", subscribed);
    recorder.deliver(BIRTH, birth().bytes());
    recorder.deliver(DATA, data(1, true).bytes());
    recorder.deliver(DATA, data(2, true).bytes());
    recorder.deliver(DATA, data(4, false).bytes());
    recorder.deliver(BIRTH, birth().bytes());
    recorder.cut();
    recorder.until("a second connection", |it| it.len() == 2 && subscribed(it));
    recorder.deliver(BIRTH, birth().bytes());
    let (code, out, errors) = fleet.stop();
    assert_eq!(code, 0, "{errors}");
    let lines: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let what: Vec<&str> = lines.iter().map(|line| line["what"].as_str().unwrap()).collect();
    let expected = ["born", "value", "value", "stale", "born", "value", "stale", "born"];
    assert_eq!(what, expected, "{out}{errors}");
    let jam = [1, 2, 5].map(|at| (&lines[at]["value"], lines[at]["first"] == true));
    let [on, off] = [true.into(), false.into()];
    assert_eq!(jam, [(&off, true), (&on, false), (&off, false)], "a name asks for its first value");
}

#[test]
fn an_unreachable_broker_has_its_own_exit_code() {
    let arguments = ["status", "--broker", "mqtt://127.0.0.1:1", "--wait", "1s"];
    let (code, out, errors) = FleetProcess::start(&arguments).end();
    assert_eq!((code, out.as_str()), (69, ""));
    assert!(errors.contains("broker mqtt://127.0.0.1:1: no connection"), "{errors}");
    let (code, _, errors) = FleetProcess::start(&["status", "--broker", "tcp://x"]).end();
    assert!(code == 2 && errors.contains("mqtts://"), "{code} {errors}");
}
