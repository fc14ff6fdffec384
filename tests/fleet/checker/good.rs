//! Stories without a fault: the rules must not complain about them, and the spoilers break them.

use rungd_net::sparkplug::{
    BornMetric, DataType, HostState, MessageKind, Metric, MetricProperties, MetricValue, Payload,
    Topic, metric_of, vocabulary,
};

use super::story::{Connect, Connection, Published, Step, Story};

/// The time at which the stories happen.
const NOW_MS: u64 = 1_790_000_000_000;

/// An edge node with a primary host: two connections with MQTT 3.1.1, one with MQTT 5.
pub fn edge() -> Story {
    let mut story = Story {
        group: "plant".to_owned(),
        node: "press".to_owned(),
        host: Some("room".to_owned()),
        connections: Vec::new(),
    };
    story.connections = vec![
        edge_connection(&story, 255, 4),
        edge_connection(&story, 0, 4),
        edge_connection(&story, 1, 5),
    ];
    story
}

fn edge_connection(story: &Story, number: i64, version: u8) -> Connection {
    let sent = |kind: MessageKind, payload: &Payload, qos: u8| Published {
        topic: story.topic(kind),
        payload: payload.bytes(),
        qos,
        retain: false,
        at_ms: NOW_MS,
    };
    let death = sent(MessageKind::NodeDeath, &death(number), 1);
    let state = HostState { online: true, timestamp: NOW_MS - 9 }.bytes();
    let host = Topic::of_host("room").to_string();
    let mut steps = vec![
        Step::Subscribed(vec![(story.topic(MessageKind::NodeCommand), 1), (host.clone(), 1)]),
        Step::Got(got(host.clone(), state)),
        Step::Sent(sent(MessageKind::NodeBirth, &birth(number), 0)),
    ];
    for seq in 1..=300 {
        steps.push(Step::Sent(sent(MessageKind::NodeData, &data(seq % 256), 0)));
    }
    let ask = rebirth_metric(true);
    let ask = Payload { timestamp: Some(NOW_MS), metrics: vec![ask], seq: None };
    steps.push(Step::Got(got(story.topic(MessageKind::NodeCommand), ask.bytes())));
    steps.push(Step::Sent(sent(MessageKind::NodeBirth, &birth(number), 0)));
    steps.push(Step::Sent(sent(MessageKind::NodeData, &data(1), 0)));
    let gone = HostState { online: false, timestamp: NOW_MS }.bytes();
    steps.push(Step::Got(got(host, gone)));
    steps.push(Step::Sent(death.clone()));
    steps.push(Step::Disconnected(if version == 5 { 4 } else { 0 }));
    let connect = connect(version, death);
    Connection { connect, steps }
}

fn connect(version: u8, will: Published) -> Connect {
    Connect { version, clean: true, session_expiry_s: 0, will: Some(will), at_ms: NOW_MS }
}

fn got(topic: String, payload: Vec<u8>) -> Published {
    Published { topic, payload, qos: 1, retain: false, at_ms: NOW_MS }
}

fn rebirth_metric(value: bool) -> Metric {
    let value = metric_of(DataType::Boolean, Some(&MetricValue::Bool(value)), NOW_MS);
    let name = Some(vocabulary::REBIRTH.to_owned());
    Metric { name, datatype: Some(DataType::Boolean.number()), ..value }
}

fn number_metric(number: i64) -> Metric {
    let value = metric_of(DataType::Int64, Some(&MetricValue::Signed(number)), NOW_MS);
    let name = Some(vocabulary::BD_SEQ.to_owned());
    Metric { name, datatype: Some(DataType::Int64.number()), ..value }
}

fn level() -> BornMetric {
    let properties =
        MetricProperties { unit: Some("bar".to_owned()), ..MetricProperties::default() };
    let name = "level".to_owned();
    BornMetric { name, alias: Some(7), datatype: DataType::Int16, properties }
}

fn jam() -> BornMetric {
    let properties = MetricProperties::default();
    BornMetric { name: "jam".to_owned(), alias: Some(8), datatype: DataType::Boolean, properties }
}

fn birth(number: i64) -> Payload {
    let metrics = vec![
        number_metric(number),
        rebirth_metric(false),
        level().born(Some(&MetricValue::Signed(-3)), NOW_MS),
        jam().born(None, NOW_MS),
    ];
    Payload { timestamp: Some(NOW_MS), metrics, seq: Some(0) }
}

fn data(seq: u64) -> Payload {
    let mut past = level().data(Some(&MetricValue::Signed(1)), NOW_MS - 100_000_000);
    past.is_historical = Some(true);
    let metrics = vec![
        level().data(Some(&MetricValue::Signed(4)), NOW_MS),
        past,
        jam().data(Some(&MetricValue::Bool(seq.is_multiple_of(2))), NOW_MS),
    ];
    Payload { timestamp: Some(NOW_MS), metrics, seq: Some(seq) }
}

fn death(number: i64) -> Payload {
    Payload { timestamp: Some(NOW_MS), metrics: vec![number_metric(number)], seq: None }
}

/// A host that requests a node's birth: one connection with each version of MQTT.
pub fn host() -> Story {
    let mut story = Story { host: Some("room".to_owned()), ..Story::default() };
    story.connections = vec![host_connection(4), host_connection(5)];
    story
}

fn host_connection(version: u8) -> Connection {
    let topic = Topic::of_host("room").to_string();
    let state = |online: bool| Published {
        topic: topic.clone(),
        payload: HostState { online, timestamp: NOW_MS }.bytes(),
        qos: 1,
        retain: true,
        at_ms: NOW_MS,
    };
    let ask = Payload { timestamp: Some(NOW_MS), metrics: vec![rebirth_metric(true)], seq: None };
    let command = Published {
        topic: Topic::of_node("plant", MessageKind::NodeCommand, "press").to_string(),
        payload: ask.bytes(),
        qos: 0,
        retain: false,
        at_ms: NOW_MS,
    };
    let filters = vec![("spBv1.0/+/NBIRTH/+".to_owned(), 1), (topic.clone(), 1)];
    let steps = vec![
        Step::Subscribed(filters),
        Step::Sent(state(true)),
        Step::Got(state(false)),
        Step::Sent(state(true)),
        Step::Sent(command),
        Step::Sent(state(false)),
        Step::Disconnected(0),
    ];
    Connection { connect: connect(version, state(false)), steps }
}
