//! `rungd edge` at a recording broker: the specification's statements judge its packets, and a
//! foreign library reads them.

use rungd_net::sparkplug::{HostState, MessageKind, Payload, Topic, vocabulary};

use crate::fleet::checker::recorder::{Recorder, now_ms};
use crate::fleet::checker::story::{Connection, Step, Story};
use crate::fleet::checker::{edge_rules, judge};
use crate::fleet::edge_rig::{CONTROLLER, Edge, LADDER, commanded};
use crate::fleet::foreign::{library, seen};
use rungd_test_support::running::live::Live;

const STATE: &str = "spBv1.0/STATE/room";

/// The number of messages of a kind in a connection.
fn count(connection: &Connection, kind: MessageKind) -> usize {
    connection.sent().filter(|sent| sent.kind() == Some(kind)).count()
}

/// Waits for the connection `number`, delivers the host's state as online, and waits for a birth
/// and for data.
fn begin(recorder: &Recorder, number: usize) {
    recorder.until("a subscription", |all| {
        let filters = all.get(number - 1).map(|it| it.subscribed().count());
        all.len() == number && filters.is_some_and(|filters| filters >= 2)
    });
    recorder.deliver(STATE, HostState { online: true, timestamp: now_ms() }.bytes());
    recorder.until("data", |all| count(&all[number - 1], MessageKind::NodeData) >= 5);
}

/// The story of a node that receives a request for a birth, loses its link, loses its host, and
/// ends.
fn story(version: &str) -> Story {
    let recorder = Recorder::start();
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let more = format!("version = \"{version}\"\n[sparkplug]\nprimary-host = \"room\"\n");
    let mut edge = Edge::start(&live, &recorder.url, &more);
    begin(&recorder, 1);
    let value = rungd_net::sparkplug::MetricValue::Bool(true);
    let ask = commanded(vocabulary::REBIRTH, rungd_net::sparkplug::DataType::Boolean, value);
    let ask = Payload { timestamp: Some(now_ms()), metrics: vec![ask], seq: None };
    // On a busy machine a node may learn its controller's tags after a birth; then it sends a further
    // birth by itself, perhaps now. (`crates/fleet/src/edge/node_tests.rs` counts births in virtual time.)
    let births = |all: &[Connection]| count(&all[0], MessageKind::NodeBirth);
    let before = births(&recorder.connections());
    recorder.deliver("spBv1.0/plant/NCMD/press", ask.bytes());
    recorder.until("a birth on request", |all| births(all) > before);
    recorder.cut();
    begin(&recorder, 2);
    recorder.deliver(STATE, HostState { online: false, timestamp: now_ms() }.bytes());
    begin(&recorder, 3);
    edge.end();
    recorder.until("its end", |all| {
        let last = all.last().and_then(|it| it.steps.last());
        matches!(last, Some(Step::Disconnected(_)))
    });
    let (group, node, host) = ("plant".to_owned(), "press".to_owned(), Some("room".to_owned()));
    Story { group, node, host, connections: recorder.connections() }
}

#[test]
fn an_edge_node_follows_every_checked_statement_of_sparkplug() {
    for version in ["3.1.1", "5"] {
        let story = story(version);
        let wrong = judge(&edge_rules(), &story);
        assert!(wrong.is_empty(), "MQTT {version}: {wrong:#?}");
        a_foreign_host_sees_it(&story);
    }
}

/// The foreign library decodes every message, and the ladder's count rises.
fn a_foreign_host_sees_it(story: &Story) {
    let Some(library) = library() else { return };
    let sent = story.sent().map(|(_, sent)| (sent.topic.clone(), sent.payload.clone()));
    let seen = seen(&library, &sent.collect::<Vec<_>>());
    assert_eq!(seen.len(), story.sent().count());
    let of_metric = |name: &'static str| {
        let metrics = seen.iter().filter_map(|message| message["metrics"].as_array()).flatten();
        metrics.filter(move |metric| metric["name"] == name)
    };
    let born = of_metric("n").next().expect("the count is born");
    assert_eq!((&born["type"], born["value"].is_i64()), (&"INT32".into(), true), "{born}");
    let present = of_metric("n").filter(|metric| metric["historical"] == false);
    let values: Vec<i64> = present.filter_map(|metric| metric["value"].as_i64()).collect();
    assert!(values.windows(2).all(|pair| pair[0] <= pair[1]), "{values:?}");
    assert!(of_metric(vocabulary::MODE).any(|metric| metric["value"] == "RUN"));
    let topic = Topic::of_node("plant", MessageKind::NodeDeath, "press").to_string();
    assert_eq!(
        story.connections.last().and_then(|it| it.sent().last()).map(|it| &it.topic),
        Some(&topic)
    );
}
