//! When values may be old: gaps, unknown aliases, a lost link; and when births are requested.

use super::{Fleet, TypedValue, death, running};
use crate::fleet::ask::rebirth_request;
use crate::fleet::{FleetNews, ReceivedMessage};
use rungd_net::sparkplug::{DataType, MetricContent, MetricValue, Payload, Topic, vocabulary};

fn jam() -> TypedValue {
    TypedValue { datatype: DataType::Boolean, value: MetricValue::Bool(true) }
}

#[test]
fn a_gap_makes_a_node_stale_until_its_next_birth() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let news = fleet.value(2, 5, jam());
    let why = "messages are missing: number 1 was due, 2 came".to_owned();
    assert_eq!(news, [FleetNews::Stale { why }], "a birth may be missing: no value by alias");
    assert_eq!(fleet.value(3, 5, jam()), []);
    assert_eq!((fleet.state(), fleet.report().nodes[0].gaps), ("stale", 1));
    fleet.born(0, &running());
    assert_eq!(fleet.state(), "online");
    assert_eq!(fleet.value(1, 5, jam()).len(), 1);
}

#[test]
fn a_message_without_a_number_is_a_gap() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let mut payload = super::data(1, 5, jam(), 5);
    payload.seq = None;
    fleet.press("NDATA", &payload);
    assert_eq!(fleet.state(), "stale");
}

#[test]
fn messages_of_devices_count_in_the_sequence_of_their_node() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let device = Payload { timestamp: Some(5), metrics: Vec::new(), seq: Some(1) };
    fleet.hear("spBv1.0/plant/DBIRTH/press/io", &device.bytes());
    assert_eq!(fleet.value(2, 5, jam()).len(), 1);
    assert_eq!(fleet.state(), "online");
    fleet.hear("spBv1.0/plant/DDATA/press/io", &device.bytes());
    assert_eq!(fleet.state(), "stale");
}

#[test]
fn an_unknown_alias_makes_a_node_stale() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let news = fleet.value(1, 99, jam());
    assert_eq!(news, [FleetNews::Stale { why: "its birth has no alias 99".to_owned() }]);
}

#[test]
fn a_value_of_a_wrong_type_is_refused() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    assert_eq!(
        fleet.value(1, 5, TypedValue { datatype: DataType::Int16, value: MetricValue::Signed(1) }),
        []
    );
    let report = fleet.report();
    assert_eq!((report.nodes[0].state, report.nodes[0].values_refused), ("online", 1));
}

#[test]
fn a_lost_link_makes_all_nodes_stale() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let changes = fleet.view.lose_link(fleet.now_ms);
    assert_eq!((changes.len(), fleet.state()), (1, "stale"));
    assert_eq!(fleet.view.lose_link(fleet.now_ms), [], "once");
}

#[test]
fn data_after_a_death_makes_a_node_unborn() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let death = death(0, 5);
    fleet.press("NDEATH", &death);
    assert_eq!(fleet.value(1, 5, jam()), [FleetNews::Heard]);
    assert_eq!(fleet.state(), "unborn");
}

#[test]
fn births_are_requested_at_most_every_ten_seconds() {
    let mut fleet = Fleet::new();
    fleet.value(7, 5, jam());
    assert_eq!(fleet.view.wants_birth(fleet.now_ms).len(), 1);
    assert_eq!(fleet.view.wants_birth(fleet.now_ms + 9_999), []);
    assert_eq!(fleet.view.wants_birth(fleet.now_ms + 10_000).len(), 1);
    fleet.born(0, &running());
    assert_eq!(fleet.view.wants_birth(fleet.now_ms + 60_000), []);
    fleet.value(9, 5, jam());
    assert_eq!(fleet.view.wants_birth(fleet.now_ms + 120_000).len(), 1);
}

/// A stranger's names that never answer do not prevent requests to the other nodes.
#[test]
fn births_are_requested_from_nodes_in_turn() {
    let mut fleet = Fleet::new();
    let payload = super::data(7, 5, jam(), 5).bytes();
    (0..1_500).for_each(|at| drop(fleet.hear(&format!("spBv1.0/junk/NDATA/{at}"), &payload)));
    fleet.value(7, 5, jam());
    let mut asked = Vec::new();
    for step in 0..100 {
        asked.extend(fleet.view.wants_birth(fleet.now_ms + step * 500));
    }
    assert!(asked.iter().any(|name| name.group == "plant"), "of {} requests", asked.len());
}

#[test]
fn values_after_an_unknown_alias_in_a_message_are_ignored() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let mut payload = super::data(1, 99, jam(), 5);
    payload.metrics.extend(super::data(1, 5, jam(), 5).metrics);
    let news = fleet.press("NDATA", &payload);
    assert!(matches!(&news[..], [FleetNews::Stale { .. }]), "{news:?}");
}

/// The birth of that session was among the missing messages.
#[test]
fn a_death_of_a_session_with_a_missed_birth_makes_a_node_offline() {
    let mut fleet = Fleet::new();
    fleet.born(255, &running());
    fleet.view.lose_link(fleet.now_ms);
    let old = death(254, 5);
    assert_eq!(fleet.press("NDEATH", &old), []);
    assert_eq!(fleet.state(), "stale");
    let missed = death(1, 5);
    assert_eq!(fleet.press("NDEATH", &missed), [FleetNews::Died]);
    assert_eq!(fleet.state(), "offline");
}

#[test]
fn a_rebirth_request_is_the_command_of_the_specification() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let name = fleet.report().nodes[0].name.clone();
    let (topic, bytes) = rebirth_request(&name, 1234);
    assert_eq!(topic, "spBv1.0/plant/NCMD/press");
    assert!(Topic::read(&topic).is_some());
    let payload = Payload::read(&bytes).expect("a payload");
    assert_eq!((payload.seq, payload.timestamp), (None, Some(1234)));
    let metric = &payload.metrics[0];
    assert_eq!(metric.name.as_deref(), Some(vocabulary::REBIRTH));
    assert_eq!(metric.content, Some(MetricContent::Boolean(true)));
}

#[test]
fn retained_messages_are_ignored() {
    let mut fleet = Fleet::new();
    let payload = super::birth(0, &running(), 5).bytes();
    let topic = "spBv1.0/plant/NBIRTH/press";
    let kept = ReceivedMessage { topic, payload: &payload, is_retained: true };
    assert_eq!(fleet.view.hear(kept, 1), []);
    let report = fleet.report();
    assert_eq!((report.nodes.len(), report.counts.kept_by_broker), (0, 1));
}
