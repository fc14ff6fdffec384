//! A hostile broker: garbage, oversized messages, floods of names. They are bounded and counted,
//! and cause no panic.

use proptest::prelude::*;

use super::{Fleet, TypedValue, birth, running};
use crate::fleet::{FleetLimits, FleetView, ReceivedMessage};
use rungd_net::mqtt::LongMessage;
use rungd_net::sparkplug::{DataType, MetricValue, vocabulary};

#[test]
fn garbage_creates_no_node() {
    let mut fleet = Fleet::new();
    fleet.hear("spBv1.0/plant/NBIRTH/press", &[0xff; 40]);
    fleet.hear("spBv1.0/plant/NOTHING/press", b"");
    fleet.hear("shop/orders", b"7");
    let report = fleet.report();
    assert_eq!(report.nodes.len(), 0);
    assert_eq!((report.counts.garbage, report.counts.foreign_topics), (1, 2));
    assert_eq!(report.counts.left_out().len(), 2);
}

#[test]
fn garbage_makes_a_node_stale() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    fleet.hear("spBv1.0/plant/NDATA/press", &[0xff; 40]);
    assert_eq!(fleet.state(), "stale");
}

#[test]
fn an_oversized_message_is_not_read() {
    let mut fleet = Fleet::new();
    fleet.hear("spBv1.0/plant/NBIRTH/press", &vec![0; (4 << 20) + 1]);
    assert_eq!(fleet.report().counts.too_large, 1);
}

/// The message is longer than a packet may be, so not even its bytes are received.
#[test]
fn an_oversized_message_makes_its_node_stale() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let giant = |topic: &str, retained| {
        let topic = topic.to_owned();
        LongMessage { topic, bytes: 2 << 20, bytes_max: 1 << 20, retained }
    };
    for (topic, retained) in
        [("spBv1.0/plant/NBIRTH/press", true), ("spBv1.0/plant/NCMD/press", false)]
    {
        assert_eq!(fleet.view.miss(&giant(topic, retained), fleet.now_ms).len(), 0);
        assert_eq!(fleet.state(), "online");
    }
    let changes = fleet.view.miss(&giant("spBv1.0/plant/NDATA/press", false), fleet.now_ms);
    assert_eq!((changes.len(), fleet.state()), (1, "stale"));
    fleet.view.miss(&giant("spBv1.0/plant/NBIRTH/nobody", false), fleet.now_ms);
    let report = fleet.report();
    assert_eq!((report.counts.too_large, report.nodes.len()), (4, 1));
}

/// A metric of two bytes takes some hundred bytes in memory: a payload of a million such metrics is
/// not read.
#[test]
fn a_payload_of_empty_metrics_is_not_read() {
    let mut fleet = Fleet::new();
    fleet.hear("spBv1.0/plant/NBIRTH/press", &[0x12, 0].repeat(1_000_000));
    assert_eq!(fleet.report().counts.garbage, 1);
}

#[test]
fn nodes_and_metrics_have_limits() {
    let limits = FleetLimits { nodes_max: 3, metrics_max: 4, ..FleetLimits::default() };
    let mut fleet = Fleet::new();
    fleet.view = FleetView::new(limits, None);
    let payload = birth(0, &running(), 5).bytes();
    for number in 0..10 {
        fleet.hear(&format!("spBv1.0/plant/NBIRTH/press{number}"), &payload);
    }
    let report = fleet.report();
    assert_eq!((report.nodes.len(), report.counts.nodes_refused), (3, 7));
    assert_eq!((report.nodes[0].metrics, report.nodes[0].metrics_refused), (4, 3));
}

#[test]
fn all_bytes_together_have_a_limit() {
    let limits = FleetLimits { bytes_max: 10_000, ..FleetLimits::default() };
    let mut fleet = Fleet::new();
    fleet.view = FleetView::new(limits, None);
    let text = |size: usize| MetricValue::Text("x".repeat(size));
    for number in 0..10 {
        let metrics = [("text", 1, DataType::String, text(4_000))];
        let payload = birth(0, &metrics, 5).bytes();
        fleet.hear(&format!("spBv1.0/plant/NBIRTH/press{number}"), &payload);
    }
    let refused =
        |fleet: &Fleet| fleet.report().nodes.iter().map(|n| n.metrics_refused).sum::<u64>();
    let first = refused(&fleet);
    assert!(first >= 8, "{first}");
    // The same births again take no more memory.
    for _ in 0..100 {
        let metrics = [("text", 1, DataType::String, text(4_000))];
        let payload = birth(0, &metrics, 5).bytes();
        fleet.hear("spBv1.0/plant/NBIRTH/press0", &payload);
    }
    assert_eq!(refused(&fleet), first);
}

#[test]
fn a_text_beyond_the_limit_is_refused() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let long = MetricValue::Text("x".repeat((256 << 10) + 1));
    fleet.value(1, 1, TypedValue { datatype: DataType::String, value: long });
    let report = fleet.report();
    assert_eq!((report.nodes[0].told.mode.as_deref(), report.nodes[0].metrics_refused), (None, 1));
}

#[test]
fn a_birth_with_a_name_or_an_alias_twice_keeps_the_first() {
    let mut fleet = Fleet::new();
    let metrics = [
        ("a", 1, DataType::Boolean, MetricValue::Bool(true)),
        ("a", 2, DataType::Boolean, MetricValue::Bool(false)),
        ("b", 1, DataType::Boolean, MetricValue::Bool(false)),
    ];
    fleet.born(0, &metrics);
    let report = fleet.report();
    assert_eq!((report.nodes[0].metrics, report.nodes[0].values_refused), (2, 2));
}

/// A node beyond the limit is not kept, so its state is not known.
#[test]
fn a_fleet_with_nodes_beyond_the_limit_is_not_reported_as_running() {
    let limits = FleetLimits { nodes_max: 1, ..FleetLimits::default() };
    let mut fleet = Fleet::new();
    fleet.view = FleetView::new(limits, None);
    fleet.born(0, &running());
    assert!(fleet.report().all_run() && fleet.report().is_as_expected());
    fleet.hear("spBv1.0/plant/NBIRTH/other", &birth(0, &running(), 5).bytes());
    assert!(!fleet.report().all_run() && !fleet.report().is_as_expected());
}

/// The node has no heartbeat, but publishes a mode.
#[test]
fn a_published_mode_counts_even_without_a_heartbeat() {
    let mut fleet = Fleet::new();
    let mode = |mode: &str| MetricValue::Text(mode.to_owned());
    fleet.born(0, &[(vocabulary::MODE, 1, DataType::String, mode("FAULT"))]);
    assert!(!fleet.report().all_run());
}

#[test]
fn hosts_beyond_the_limit_are_counted() {
    let mut fleet = Fleet::new();
    for number in 0..150 {
        let state = br#"{"online":true,"timestamp":7}"#;
        fleet.hear(&format!("spBv1.0/STATE/host{number}"), state);
    }
    let report = fleet.report();
    assert_eq!((report.hosts.len(), report.counts.hosts_refused), (100, 50));
    assert_eq!(report.counts.left_out().len(), 1);
}

/// The text of one node must not fill the answer for all nodes.
#[test]
fn a_long_text_is_cut_in_an_answer() {
    let mut fleet = Fleet::new();
    let long = MetricValue::Text("é\u{7f}".repeat(80_000));
    fleet.born(0, &[(vocabulary::MODE, 1, DataType::String, long)]);
    let json = serde_json::to_string(&fleet.report()).expect("JSON");
    assert!(json.len() < 5_000, "{}", json.len());
    assert!(fleet.report().nodes[0].told.mode.as_ref().is_some_and(|it| it.ends_with('…')));
}

/// The metrics of rungd's own nodes are ignored if they have wrong types.
#[test]
fn metrics_of_rungd_with_wrong_types_are_ignored() {
    let mut fleet = Fleet::new();
    let text = || MetricValue::Text("2".to_owned());
    fleet.born(
        0,
        &[
            (vocabulary::MODE, 1, DataType::Int32, MetricValue::Signed(1)),
            (vocabulary::FORCES, 2, DataType::String, text()),
            (vocabulary::SCAN, 3, DataType::UInt64, MetricValue::Unsigned(u64::MAX)),
            (vocabulary::CONTROLLER, 4, DataType::String, text()),
            (vocabulary::ALARM_LIST, 5, DataType::Int32, MetricValue::Signed(1)),
        ],
    );
    let report = fleet.report();
    let told = &report.nodes[0].told;
    assert_eq!((&told.mode, told.forces, told.scan, told.controller), (&None, None, None, None));
    assert!(report.nodes[0].is_rungd && !report.all_run());
    assert_eq!(fleet.view.alarms(fleet.now_ms).unknown.len(), 1);
}

#[test]
fn the_first_ignored_message_of_each_kind_is_reported() {
    let mut fleet = Fleet::new();
    let before = fleet.view.counts;
    fleet.hear("shop/orders", b"7");
    let once = fleet.view.counts;
    assert_eq!(once.begun(&before), ["on topics that do not belong to Sparkplug B 3.0"]);
    fleet.hear("shop/orders", b"8");
    assert_eq!(fleet.view.counts.begun(&once), Vec::<&str>::new());
    let twice = ("a", 1, DataType::Boolean, MetricValue::Bool(true));
    fleet.born(0, &[twice.clone(), twice]);
    let left_out = fleet.view.left_out();
    assert_eq!(left_out.len(), 2, "{left_out:?}");
    assert!(left_out[1].starts_with("1 values"), "{left_out:?}");
}

proptest! {
    /// No bytes cause a panic, and the count of messages is right.
    #[test]
    fn no_bytes_cause_a_panic_and_every_message_is_counted(
        messages in proptest::collection::vec((0_usize..6, any::<Vec<u8>>(), any::<bool>()), 0..40),
    ) {
        let topics = [
            "spBv1.0/g/NBIRTH/n", "spBv1.0/g/NDATA/n", "spBv1.0/g/NDEATH/n",
            "spBv1.0/g/DDATA/n/d", "spBv1.0/STATE/h", "spBv1.0/g/NCMD/n",
        ];
        let mut fleet = Fleet::new();
        fleet.born(0, &running());
        for (topic, payload, is_retained) in &messages {
            let (topic, is_retained) = (topics[*topic], *is_retained);
            let message = ReceivedMessage { topic, payload, is_retained };
            fleet.view.hear(message, fleet.now_ms);
        }
        fleet.view.wants_birth(fleet.now_ms);
        fleet.view.alarms(fleet.now_ms);
        prop_assert_eq!(fleet.report().counts.messages, messages.len() as u64 + 1);
    }
}
