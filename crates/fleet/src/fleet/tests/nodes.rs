//! A node without faults: its births, data, deaths, past values and report.

use super::{Fleet, TypedValue, birth, death, running};
use crate::fleet::{FleetNews, ReceivedMessage};
use rungd_net::sparkplug::{BornMetric, DataType, MetricProperties, MetricValue, vocabulary};

#[test]
fn a_birth_reports_every_metric() {
    let mut fleet = Fleet::new();
    let news = fleet.born(3, &running());
    assert_eq!(news[0], FleetNews::Born { metrics: 7 });
    let is_first = |news: &FleetNews| matches!(news, FleetNews::Value { first: true, .. });
    assert!(news.len() == 8 && news[1..].iter().all(is_first), "{news:?}");
    fleet.now_ms += 2_500;
    let report = fleet.report();
    let node = &report.nodes[0];
    assert_eq!(
        (node.name.to_string().as_str(), node.state, node.age_ms),
        ("plant/press", "online", 2_500)
    );
    assert_eq!(node.told.mode.as_deref(), Some("RUN"));
    assert_eq!((node.told.forces, node.told.scan, node.told.overruns), (Some(2), Some(100), None));
    assert!(node.is_rungd && report.all_run());
}

#[test]
fn a_value_has_the_text_that_the_birth_gives_it() {
    let mut fleet = Fleet::new();
    let metrics = [("state", 5, DataType::Int32, MetricValue::Signed(0))];
    let mut birth = birth(3, &metrics, fleet.now_ms);
    let texts = Some("0 = idle; 1 = dosing".to_owned());
    let properties = MetricProperties { texts, ..MetricProperties::default() };
    let (name, alias, datatype) = ("state".to_owned(), Some(5), DataType::Int32);
    let state = BornMetric { name, alias, datatype, properties };
    birth.metrics[1] = state.born(Some(&MetricValue::Signed(0)), fleet.now_ms);
    fleet.press("NBIRTH", &birth);
    for (seq, value, wanted) in [(1, 1, Some("dosing")), (2, 7, None)] {
        let value = TypedValue { datatype: DataType::Int32, value: MetricValue::Signed(value) };
        let news = fleet.value(seq, 5, value);
        let [FleetNews::Value { text, .. }] = &news[..] else { panic!("{news:?}") };
        assert_eq!(text.as_deref(), wanted);
    }
}

#[test]
fn a_data_message_changes_values() {
    let mut fleet = Fleet::new();
    fleet.born(3, &running());
    let news = fleet.value(
        1,
        5,
        TypedValue { datatype: DataType::Boolean, value: MetricValue::Bool(true) },
    );
    let (name, value) = ("jam".to_owned(), Some(MetricValue::Bool(true)));
    let told = FleetNews::Value {
        name,
        value,
        text: None,
        unit: None,
        historical: false,
        first: false,
        told_ms: Some(fleet.now_ms),
    };
    assert_eq!(news, [told]);
    let same = fleet.value(
        2,
        5,
        TypedValue { datatype: DataType::Boolean, value: MetricValue::Bool(true) },
    );
    assert_eq!(same, [], "the same value again is no change");
    fleet.value(
        3,
        1,
        TypedValue { datatype: DataType::String, value: MetricValue::Text("STOP".to_owned()) },
    );
    assert_eq!(fleet.report().nodes[0].told.mode.as_deref(), Some("STOP"));
    assert!(!fleet.report().all_run());
}

#[test]
fn a_second_birth_reports_only_changed_metrics() {
    let mut fleet = Fleet::new();
    fleet.born(3, &running());
    let mut again = running();
    again[4].3 = MetricValue::Bool(true);
    let news = fleet.born(3, &again);
    assert_eq!(news.len(), 2, "{news:?}");
    assert!(matches!(&news[1], FleetNews::Value { name, .. } if name == "jam"));
}

#[test]
fn sequence_numbers_wrap_after_255() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    for number in 1..=600_u64 {
        let value = MetricValue::Signed((number % 100) as i64);
        fleet.value(number % 256, 6, TypedValue { datatype: DataType::Int16, value });
    }
    assert_eq!((fleet.state(), fleet.report().nodes[0].gaps), ("online", 0));
}

#[test]
fn only_a_death_of_the_present_session_makes_a_node_offline() {
    let mut fleet = Fleet::new();
    fleet.born(4, &running());
    let old = death(3, fleet.now_ms);
    assert_eq!(fleet.press("NDEATH", &old), [], "the will of the connection before");
    assert_eq!((fleet.state(), fleet.report().nodes[0].old_deaths), ("online", 1));
    let own = death(4, fleet.now_ms);
    assert_eq!(fleet.press("NDEATH", &own), [FleetNews::Died]);
    assert_eq!(fleet.press("NDEATH", &own), [], "dead once");
    assert_eq!(fleet.state(), "offline");
    assert_eq!(fleet.report().nodes[0].told.mode.as_deref(), Some("RUN"), "its last word stays");
    fleet.born(5, &running());
    assert_eq!(fleet.state(), "online");
}

#[test]
fn historical_values_do_not_change_present_values() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let mut past = super::data(
        1,
        1,
        TypedValue { datatype: DataType::String, value: MetricValue::Text("FAULT".into()) },
        5,
    );
    past.metrics[0].is_historical = Some(true);
    let news = fleet.press("NDATA", &past);
    assert!(matches!(&news[..], [FleetNews::Value { historical: true, .. }]), "{news:?}");
    let report = fleet.report();
    assert_eq!(report.nodes[0].told.mode.as_deref(), Some("RUN"));
    assert_eq!(report.nodes[0].historical_values, 1);
}

/// A will has the time of its connection, which may be days ago.
#[test]
fn a_death_has_the_time_of_its_arrival() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    fleet.now_ms += 86_400_000;
    let will = death(0, 5).bytes();
    let topic = "spBv1.0/plant/NDEATH/press";
    let heard = ReceivedMessage { topic, payload: &will, is_retained: false };
    let changes = fleet.view.hear(heard, fleet.now_ms);
    assert_eq!((changes.len(), changes[0].at_ms), (1, fleet.now_ms));
    assert_eq!(fleet.report().nodes[0].clock_ahead_ms, Some(0), "its clock is right");
}

#[test]
fn a_value_is_shown_with_its_own_timestamp() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let mut past = super::data(
        1,
        6,
        TypedValue { datatype: DataType::Int16, value: MetricValue::Signed(3) },
        77,
    );
    past.timestamp = Some(5_000);
    past.metrics[0].is_historical = Some(true);
    past.metrics.push(
        super::data(
            1,
            5,
            TypedValue { datatype: DataType::Boolean, value: MetricValue::Bool(true) },
            78,
        )
        .metrics[0]
            .clone(),
    );
    past.metrics[1].timestamp = None;
    let payload = past.bytes();
    let topic = "spBv1.0/plant/NDATA/press";
    let heard = ReceivedMessage { topic, payload: &payload, is_retained: false };
    let changes = fleet.view.hear(heard, fleet.now_ms);
    let times: Vec<u64> = changes.iter().map(|change| change.at_ms).collect();
    assert_eq!(times, [77, 5_000], "that of the message, if the value has none");
}

#[test]
fn a_historical_value_of_a_wrong_type_is_counted_as_refused() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    let mut past = super::data(
        1,
        5,
        TypedValue { datatype: DataType::Int16, value: MetricValue::Signed(3) },
        77,
    );
    past.metrics[0].is_historical = Some(true);
    assert_eq!(fleet.press("NDATA", &past), []);
    assert_eq!(fleet.report().nodes[0].values_refused, 1);
}

#[test]
fn a_node_without_a_heartbeat_becomes_silent() {
    let mut fleet = Fleet::new();
    fleet.born(0, &running());
    fleet.now_ms += 30_000;
    assert_eq!(fleet.state(), "online");
    fleet.now_ms += 1;
    assert_eq!(fleet.state(), "silent");
    let mut other = Fleet::new();
    other.born(0, &[("level", 1, DataType::Int16, MetricValue::Signed(1))]);
    other.now_ms += 3_600_000;
    assert_eq!(other.state(), "online", "others speak by exception alone");
}

#[test]
fn a_configured_group_excludes_other_groups() {
    let mut fleet = Fleet::new();
    fleet.view = crate::fleet::FleetView::new(Default::default(), Some("north".to_owned()));
    fleet.born(0, &running());
    let payload = birth(0, &running(), 5).bytes();
    fleet.hear("spBv1.0/north/NBIRTH/press", &payload);
    let report = fleet.report();
    assert_eq!((report.nodes.len(), report.nodes[0].name.group.as_str()), (1, "north"));
}

#[test]
fn the_alarms_of_a_node_come_from_its_alarm_list() {
    let mut fleet = Fleet::new();
    let list = r#"[{"tag":"jam","text":"Belt jammed","priority":"high"}]"#;
    let list = MetricValue::Text(list.to_owned());
    fleet.born(0, &[(vocabulary::ALARM_LIST, 1, DataType::String, list)]);
    let payload = birth(0, &running(), 5).bytes();
    fleet.hear("spBv1.0/plant/NBIRTH/other", &payload);
    let alarms = fleet.view.alarms(fleet.now_ms);
    assert_eq!((alarms.alarms.len(), alarms.alarms[0].alarm.tag.as_str()), (1, "jam"));
    assert_eq!(alarms.unknown.len(), 1);
}

#[test]
fn the_state_of_a_host_is_reported() {
    let mut fleet = Fleet::new();
    fleet.hear("spBv1.0/STATE/scada", br#"{"online":true,"timestamp":7}"#);
    fleet.hear("spBv1.0/STATE/old", b"ONLINE");
    let report = fleet.report();
    assert_eq!((report.hosts.len(), report.counts.garbage), (1, 1));
    assert!(report.hosts[0].state.online);
}

#[test]
fn a_node_without_a_birth_reports_its_named_metrics() {
    let mut fleet = Fleet::new();
    let mut named = super::data(
        9,
        1,
        TypedValue { datatype: DataType::String, value: MetricValue::Text("RUN".into()) },
        5,
    );
    (named.metrics[0].name, named.metrics[0].alias) = (Some(vocabulary::MODE.into()), None);
    let news = fleet.press("NDATA", &named);
    assert!(matches!(&news[..], [FleetNews::Heard, FleetNews::Value { .. }]), "{news:?}");
    assert_eq!(fleet.state(), "unborn");
    assert_eq!(fleet.report().nodes[0].told.mode.as_deref(), Some("RUN"));
    assert_eq!(
        fleet.value(
            10,
            5,
            TypedValue { datatype: DataType::Boolean, value: MetricValue::Bool(true) }
        ),
        []
    );
}
