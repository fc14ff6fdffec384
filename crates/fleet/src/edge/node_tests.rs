//! What the node publishes for given events: tests without a broker, a controller or a clock.

use std::path::Path;
use std::sync::Arc;

use super::journal::LineSubject;
use super::keys::read_edge;
use super::node::{EdgeNode, NodeAction};
use super::settings::EdgeSettings;
use super::tags::chooser;
use rungd_base::random::SplitMix64;
use rungd_client::live::{HistorySpan, LogEvent, LogGap, LogPosition, LoggedChange, LoggedProgram};
use rungd_client::operator::protocol::GivenValue;
use rungd_history::record::{RecordedFile, RecordedProgram};
use rungd_net::sparkplug::{
    DataType, HostState, Metric, MetricContent, MetricValue, Payload, Sequence, metric_of,
    vocabulary,
};

const LADDER: &str = r#"
[tags]
start = { at = "X0", doc = "the button" }
on    = { at = "Y0" }
count = { at = "CT0" }
level = { at = "D0", min = -10, max = 90 }
heat  = { at = "R0" }
word  = { at = "MHR1" }
const = { value = 5 }
[[program]]
name = "Main"
rung = [{ when = ["start"], do = ["OUT on"] }]
"#;

const EDGE: &str = r#"
[node]
group = "g"
name = "n"
[broker]
addresses = ["mqtt://h"]
"#;

fn settings(more: &str) -> EdgeSettings {
    let read = read_edge(Path::new("e.toml"), format!("{EDGE}{more}").as_bytes());
    read.settings.unwrap_or_else(|| panic!("{:?}", read.findings))
}

fn program(settings: &EdgeSettings, ladder: &str) -> Arc<LoggedProgram> {
    let file = |name: &str, text: &str| RecordedFile { name: name.into(), text: text.into() };
    let files = vec![file("c.toml", "ladder = [\"l.toml\"]\n"), file("l.toml", ladder)];
    let recorded = Arc::new(RecordedProgram { files, ..RecordedProgram::default() });
    Arc::new(LoggedProgram::of(&recorded, &chooser(settings)).expect("it loads"))
}

fn at(scan: u64) -> LogPosition {
    LogPosition { process_start_ns: 1, scan, unix_ns: scan as i64 * 10_000_000 }
}

fn began(program: &Arc<LoggedProgram>, scan: u64) -> LogEvent {
    let values = vec![0; program.chosen.len()];
    LogEvent::Begins { program: Arc::clone(program), values, at: at(scan) }
}

fn changed(program: &LoggedProgram, name: &str, scan: u64, value: i32) -> LogEvent {
    let cell = program.chosen.iter().position(|(known, _)| known == name).expect(name) as u32;
    LogEvent::Changed(LoggedChange { cell, value, scan, unix_ns: at(scan).unix_ns })
}

/// A node that is born, with its program.
fn born(more: &str) -> (EdgeNode, Arc<LoggedProgram>) {
    let settings = settings(more);
    let program = program(&settings, LADDER);
    let mut node = EdgeNode::new(settings, Sequence::of(255).unwrap_or_default(), None);
    node.live(vec![began(&program, 1)], at(1), 1000);
    node.next_birth();
    node.connected(2000);
    (node, program)
}

fn outs(node: &mut EdgeNode) -> Vec<NodeAction> {
    std::iter::from_fn(|| node.take_out()).collect()
}

/// The published messages: kind and payload.
fn published(node: &mut EdgeNode) -> Vec<(String, Payload)> {
    let message = |out: NodeAction| match out {
        NodeAction::Publish(topic, payload) => {
            let kind = topic.split('/').nth(2).unwrap_or_default().to_owned();
            Some((kind, Payload::read(&payload).expect("a payload")))
        }
        NodeAction::Replay(_)
        | NodeAction::Write(..)
        | NodeAction::Leave(_)
        | NodeAction::Say(_)
        | NodeAction::SayLimited(..) => None,
    };
    outs(node).into_iter().filter_map(message).collect()
}

fn metric<'a>(payload: &'a Payload, name: &str) -> &'a Metric {
    let is_it = |metric: &&Metric| metric.name.as_deref() == Some(name);
    payload.metrics.iter().find(is_it).unwrap_or_else(|| panic!("no {name}"))
}

fn ncmd(metrics: Vec<Metric>) -> Vec<u8> {
    Payload { timestamp: Some(1), metrics, seq: None }.bytes()
}

fn named(name: &str, datatype: DataType, value: MetricValue) -> Metric {
    let name = Some(name.to_owned());
    Metric { name, datatype: Some(datatype.number()), ..metric_of(datatype, Some(&value), 1) }
}

#[test]
fn a_birth_has_every_tag_with_its_type() {
    let (mut node, _) = born("");
    let messages = published(&mut node);
    let [(kind, birth)] = &messages[..] else { panic!("{messages:?}") };
    assert_eq!((kind.as_str(), birth.seq, birth.timestamp), ("NBIRTH", Some(0), Some(2000)));
    for (name, datatype) in [
        (vocabulary::BD_SEQ, DataType::Int64),
        (vocabulary::REBIRTH, DataType::Boolean),
        (vocabulary::SCAN, DataType::Int64),
        ("start", DataType::Boolean),
        ("count.Acc", DataType::Int32),
        ("count.Done", DataType::Boolean),
        ("level", DataType::Int32),
        ("heat", DataType::Float),
        ("word", DataType::UInt16),
    ] {
        assert_eq!(metric(birth, name).datatype, Some(datatype.number()), "{name}");
    }
    assert!(!birth.metrics.iter().any(|metric| metric.name.as_deref() == Some("const")));
    assert_eq!(metric(birth, vocabulary::BD_SEQ).content, Some(MetricContent::Long(0)));
    let level = metric(birth, "level").properties.as_ref().expect("it has limits");
    assert!(level.get("engLow").is_some() && level.get("readOnly").is_some());
    let mut aliases: Vec<_> = birth.metrics.iter().filter_map(|metric| metric.alias).collect();
    let count = aliases.len();
    aliases.sort_unstable();
    aliases.dedup();
    assert_eq!(aliases.len(), count, "each alias stands for one metric");
}

#[test]
fn data_follow_in_order_with_the_times_of_their_scans() {
    let (mut node, program) = born("");
    let birth = published(&mut node).remove(0).1;
    let mut seq = 0;
    for round in 0..300_u64 {
        let scan = 10 + round * 2;
        let events = vec![
            changed(&program, "start", scan, (round % 2) as i32),
            changed(&program, "level", scan + 1, -5),
        ];
        node.live(events, at(scan + 1), 3000 + round);
        let [(kind, data)] = &published(&mut node)[..] else { panic!("one message") };
        seq = (seq + 1) % 256;
        assert_eq!((kind.as_str(), data.seq), ("NDATA", Some(seq)));
        let [start, level] = &data.metrics[..] else { panic!("{data:?}") };
        assert_eq!(start.alias, metric(&birth, "start").alias);
        assert_eq!((start.timestamp, &start.name), (Some(scan * 10), &None));
        assert_eq!((level.timestamp, level.is_historical), (Some((scan + 1) * 10), None));
        assert_eq!(level.content, Some(MetricContent::Int(u64::from(-5_i32 as u32))));
    }
}

#[test]
fn nothing_is_published_without_the_primary_host() {
    let (mut node, program) = born("[sparkplug]\nprimary-host = \"scada\"\n");
    assert!(node.awaited().is_some() && published(&mut node).is_empty());
    let state = |online, timestamp| HostState { online, timestamp }.bytes();
    let topic = "spBv1.0/STATE/scada";
    node.message(topic, &state(false, 50), 2100);
    node.message("spBv1.0/STATE/other", &state(true, 60), 2100);
    node.message(topic, b"garbage", 2100);
    assert!(published(&mut node).is_empty());
    node.live(vec![changed(&program, "start", 5, 1)], at(5), 2200);
    assert_eq!(node.published(), None);
    node.message(topic, &state(true, 70), 2300);
    let all = outs(&mut node);
    // The changes since the start are published too.
    let span = HistorySpan { from: at(1), margin_ns: 30_000_000_000, until: at(5) };
    assert!(all.contains(&NodeAction::Replay(span)), "{all:?}");
    assert!(all.iter().any(|out| matches!(out, NodeAction::Publish(..))));
    // An older state and an already known state change nothing.
    node.message(topic, &state(false, 69), 2400);
    node.message(topic, &state(true, 70), 2400);
    assert_eq!(outs(&mut node), []);
    node.message(topic, &state(false, 70), 2500);
    assert!(matches!(&outs(&mut node)[..], [NodeAction::Leave(_)]));
    // At a different broker, the host's state has a different time.
    node.disconnected();
    node.connected(2600);
    node.message(topic, &state(true, 40), 2600);
    assert_eq!(published(&mut node).len(), 1);
}

#[test]
fn a_returning_host_gets_at_most_one_birth_a_second() {
    let (mut node, _) = born("[sparkplug]\nprimary-host = \"scada\"\n");
    let came = |at| HostState { online: true, timestamp: 1000 + at }.bytes();
    let mut births = 0;
    for at in 0..3000 {
        node.message("spBv1.0/STATE/scada", &came(at), 5000 + at);
        node.tick(5000 + at);
        births += published(&mut node).iter().filter(|(kind, _)| kind == "NBIRTH").count();
    }
    // The first birth ends the node's wait. The last state still requests a birth, which follows
    // later.
    assert!((4..=5).contains(&births), "{births}");
    node.tick(9000);
    assert_eq!(published(&mut node).len(), 1);
}

#[test]
fn past_values_are_published_as_historical_besides_present_values() {
    let (mut node, program) = born("");
    let birth = published(&mut node).remove(0).1;
    assert_eq!(node.published(), Some(at(1)));
    node.confirm(at(1));
    node.disconnected();
    assert_eq!(node.published(), None);
    node.live(vec![changed(&program, "start", 5, 1)], at(9), 3000);
    node.connected(4000);
    let all = outs(&mut node);
    let span = HistorySpan { from: at(1), margin_ns: 30_000_000_000, until: at(9) };
    assert!(all.contains(&NodeAction::Replay(span)), "{all:?}");
    assert_eq!(node.published(), Some(at(1)), "nothing of the past is told yet");
    // The present is published at the same time.
    node.live(vec![changed(&program, "start", 12, 0)], at(12), 4100);
    assert_eq!(published(&mut node)[0].1.metrics[0].is_historical, None);
    let past = vec![began(&program, 0), changed(&program, "start", 5, 1)];
    node.past(past, at(7), 4200);
    let data = published(&mut node).remove(0).1;
    assert_eq!(data.metrics[0].is_historical, Some(true));
    assert_eq!((data.metrics[0].timestamp, data.metrics[0].alias), {
        (Some(50), metric(&birth, "start").alias)
    });
    assert_eq!(node.published(), Some(at(7)));
    node.past_done(4300);
    assert_eq!(node.published(), Some(at(12)), "then the present counts");
    let last = published(&mut node).pop().expect("its end is told").1;
    assert!(last.metrics.iter().any(|of| of.content == Some(MetricContent::Boolean(false))));
}

#[test]
fn missing_changes_are_counted_and_reported() {
    let (mut node, _) = born("");
    node.confirm(at(1));
    node.disconnected();
    node.live(Vec::new(), at(9000), 3000);
    node.connected(4000);
    outs(&mut node);
    let why = "it is gone".to_owned();
    let gap = LogGap { scans: Some(77), from_ns: 0, to_ns: 60_000_000_000, why };
    node.past(vec![LogEvent::Missing(gap)], at(9000), 5000);
    let all = outs(&mut node);
    let is_said = |out: &NodeAction| {
        let NodeAction::Say(line) = out else { return false };
        line.contains("77 scans") && line.contains("it is gone")
    };
    let is_told = |out: &NodeAction| {
        let NodeAction::Publish(_, payload) = out else { return false };
        let payload = Payload::read(payload).expect("a payload");
        payload.metrics.iter().any(|of| of.content == Some(MetricContent::Long(77)))
    };
    let (said, told) = (all.iter().any(is_said), all.iter().any(is_told));
    assert!(said && told, "{all:?}");
}

#[test]
fn a_reload_publishes_a_birth_and_a_gap_requests_past_values() {
    let (mut node, program) = born("");
    published(&mut node);
    let other = LADDER.replace("level = ", "height = ");
    let next = self::program(&settings(""), &other);
    let events =
        vec![changed(&program, "start", 5, 1), began(&next, 6), changed(&next, "height", 7, 3)];
    node.live(events, at(7), 3000);
    let messages = published(&mut node);
    let kinds: Vec<_> = messages.iter().map(|(kind, payload)| (&**kind, payload.seq)).collect();
    let expected = [("NDATA", Some(1)), ("NBIRTH", Some(0)), ("NDATA", Some(1))];
    assert_eq!(kinds, expected);
    metric(&messages[1].1, "height");
    node.live(vec![LogEvent::Jumped { from: at(7), to: at(50) }], at(51), 3100);
    let span = HistorySpan { from: at(7), margin_ns: 0, until: at(50) };
    assert_eq!(outs(&mut node)[0], NodeAction::Replay(span));
    // Past values are assigned to tags by name and type; values without such a tag are dropped.
    let past =
        vec![began(&program, 7), changed(&program, "level", 8, 1), changed(&program, "on", 9, 1)];
    node.past(past, at(50), 3200);
    let data = published(&mut node);
    let historical = data.iter().flat_map(|(_, payload)| &payload.metrics);
    let historical = historical.filter(|of| of.is_historical == Some(true)).count();
    assert_eq!(historical, 1);
    node.past_done(3300);
    let all = outs(&mut node);
    assert!(
        all.iter()
            .any(|out| matches!(out, NodeAction::Say(line) if line.contains("1 past values")))
    );
}

#[test]
fn commands_are_refused_unless_listed() {
    let (mut node, _) = born("[commands]\ntags = [\"level\", \"start\"]\n");
    let birth = published(&mut node).remove(0).1;
    let topic = "spBv1.0/g/NCMD/n";
    let level = |value| named("level", DataType::Int32, MetricValue::Signed(value));
    node.message(topic, &ncmd(vec![level(7)]), 3000);
    let write = NodeAction::Write("level".to_owned(), GivenValue::Number(7));
    assert_eq!(outs(&mut node), std::slice::from_ref(&write));
    // Hosts address a tag by its alias.
    let alias = metric(&birth, "level").alias;
    let by_alias = Metric { alias, name: None, datatype: None, ..level(7) };
    node.message(topic, &ncmd(vec![by_alias]), 3000);
    assert_eq!(outs(&mut node), std::slice::from_ref(&write));
    // A command may have both name and alias, and an integer of a different width.
    let wide = named("level", DataType::Int64, MetricValue::Signed(7));
    node.message(topic, &ncmd(vec![Metric { alias, ..wide }]), 3000);
    assert_eq!(outs(&mut node), [write]);
    for refused in [
        named("on", DataType::Boolean, MetricValue::Bool(true)),
        named("nothing", DataType::Boolean, MetricValue::Bool(true)),
        named("level", DataType::String, MetricValue::Text("7".to_owned())),
        named("start", DataType::Int32, MetricValue::Signed(1)),
        Metric { content: None, ..level(1) },
        Metric { datatype: Some(99), ..level(1) },
        Metric { is_null: Some(true), ..level(1) },
        Metric { is_historical: Some(true), ..level(1) },
        Metric { content: Some(MetricContent::Int((1 << 32) + 5)), ..level(1) },
        named("level", DataType::Double, MetricValue::Real(1.0)),
        named("level", DataType::UInt64, MetricValue::Unsigned(u64::MAX)),
        // Name and alias belong to different tags, or no tag has the alias.
        Metric { alias: metric(&birth, "on").alias, ..level(1) },
        Metric { alias: Some(9999), ..level(1) },
        Metric { alias: Some(9999), name: None, ..level(1) },
        Metric::default(),
    ] {
        node.message(topic, &ncmd(vec![refused.clone()]), 5000);
        let all = outs(&mut node);
        assert!(matches!(&all[..], [NodeAction::SayLimited(..)]), "{refused:?}: {all:?}");
    }
    // Each refusal has its own kind of line, so that a flood of one kind hides no other.
    let mut kinds = Vec::new();
    for refused in [
        named("on", DataType::Boolean, MetricValue::Bool(true)),
        named("nothing", DataType::Boolean, MetricValue::Bool(true)),
        named("start", DataType::Int32, MetricValue::Signed(1)),
    ] {
        node.message(topic, &ncmd(vec![refused]), 5000);
        let kind = |out| if let NodeAction::SayLimited(kind, _) = out { Some(kind) } else { None };
        kinds.extend(outs(&mut node).into_iter().filter_map(kind));
    }
    assert_eq!(kinds, [LineSubject::UnlistedTag, LineSubject::UnknownTag, LineSubject::WrongValue]);
    node.message("spBv1.0/g/NCMD/other", &ncmd(vec![level(7)]), 5000);
    node.message(topic, &[0xff; 30], 5000);
    assert!(outs(&mut node).iter().all(|out| matches!(out, NodeAction::SayLimited(..))));
    // In a flood, ten writes per second are passed on.
    for _ in 0..20 {
        node.message(topic, &ncmd((0..5).map(level).collect()), 9000);
    }
    let writes =
        |all: &[NodeAction]| all.iter().filter(|of| matches!(of, NodeAction::Write(..))).count();
    assert_eq!(writes(&outs(&mut node)), 10);
}

#[test]
fn a_rebirth_is_sent_at_most_once_a_second() {
    let (mut node, _) = born("");
    published(&mut node);
    let rebirth =
        ncmd(vec![named(vocabulary::REBIRTH, DataType::Boolean, MetricValue::Bool(true))]);
    for now_ms in (2100..5000).step_by(100) {
        node.message("spBv1.0/g/NCMD/n", &rebirth, now_ms);
        node.tick(now_ms);
    }
    let births = published(&mut node);
    assert_eq!(births.len(), 3, "at 2100, at once, at 3100 and 4100");
    assert!(births.iter().all(|(kind, payload)| kind == "NBIRTH" && payload.seq == Some(0)));
}

/// A host that requests a birth may have understood nothing since the first birth. The log position
/// of that birth may be far before the confirmed one.
#[test]
fn a_rebirth_publishes_past_values_again() {
    let rebirth =
        ncmd(vec![named(vocabulary::REBIRTH, DataType::Boolean, MetricValue::Bool(true))]);
    let spans = |asked_ms: u64| {
        let (mut node, _) = born("");
        node.live(Vec::new(), at(50), 2050);
        node.confirm(at(40));
        outs(&mut node);
        node.message("spBv1.0/g/NCMD/n", &rebirth, asked_ms);
        node.tick(asked_ms);
        let all = outs(&mut node).into_iter();
        let span = |out| if let NodeAction::Replay(span) = out { Some(span.from) } else { None };
        all.filter_map(span).collect::<Vec<_>>()
    };
    assert_eq!(spans(2100), [at(1)]);
    assert_eq!(spans(90_000), [at(40)]);
}

#[test]
fn a_silent_controller_has_a_heartbeat() {
    let (mut node, _) = born("");
    published(&mut node);
    for now_ms in (2000..33_000).step_by(100) {
        node.tick(now_ms);
    }
    assert_eq!(published(&mut node).len(), 3);
}

#[test]
fn any_bytes_from_a_broker_do_not_panic() {
    let (mut node, _) = born("[commands]\ntags = [\"level\"]\n[sparkplug]\nprimary-host = \"h\"\n");
    let mut random = SplitMix64(3);
    let topics = ["spBv1.0/g/NCMD/n", "spBv1.0/STATE/h", "", "spBv1.0/g/NCMD/n/d"];
    for round in 0..2000 {
        let bytes: Vec<u8> = (0..random.next() % 60).map(|_| random.next() as u8).collect();
        node.message(topics[round % topics.len()], &bytes, 3000);
        outs(&mut node);
    }
}
