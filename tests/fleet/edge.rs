//! `rungd edge` with a real controller and mosquitto: births, changes, links that fail, commands.
//! The tag `n` counts without a gap, so a lost or disordered value is visible.

use std::time::Duration;

use rungd_net::mqtt::TlsFiles;
use rungd_net::sparkplug::{DataType, MessageKind, MetricValue, vocabulary};

use crate::fleet::edge_rig::{CONTROLLER, Edge, Host, LADDER, commanded};
use crate::fleet::mosquitto::{Mosquitto, MosquittoOptions};
use crate::fleet::nats::NatsCluster;
use rungd_test_support::running::live::{Live, run};

/// A controller, a broker, and the edge node's primary host.
pub fn plant() -> Option<(Live, Mosquitto, Host)> {
    let broker = Mosquitto::start(&MosquittoOptions::default())?;
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let host = Host::listen(&broker.url());
    Some((live, broker, host))
}

pub const PRIMARY: &str = "[sparkplug]\nprimary-host = \"judge\"\n";

/// Waits until the host has every value of the count since the first one, each with a single time.
/// Historical values may arrive late.
pub fn await_whole(host: &Host) {
    let next = |pair: &[(u64, i64)]| pair[1].1 == pair[0].1 + 1 && pair[1].0 > pair[0].0;
    let holes = |host: &Host| {
        let all = host.integers("n");
        all.windows(2).filter(|pair| !next(pair)).map(<[_]>::to_vec).collect::<Vec<_>>()
    };
    host.await_it("whole count", |host| {
        let holes = holes(host);
        // Visible only if the test fails.
        holes.iter().for_each(|pair| println!("not yet whole: {pair:?}"));
        holes.is_empty()
    });
}

/// Waits until the count has grown by `more`.
pub fn await_more(host: &Host, more: i64) {
    let last = host.integers("n").last().map_or(0, |(_, value)| *value);
    host.await_it("count", |host| {
        host.integers("n").last().is_some_and(|(_, value)| *value >= last + more)
    });
}

/// Present values are in order of time, and so are historical values. After a birth, the node may
/// send historical values again.
pub fn are_ordered(host: &Host) {
    let mut last = [0, 0];
    for of in host.told().iter().filter(|of| !of.name.starts_with("rungd/")) {
        if of.is_born {
            last[1] = 0;
            continue;
        }
        let last = &mut last[usize::from(of.is_historical)];
        assert!(of.time_ms >= *last, "{of:?} behind {last}");
        *last = of.time_ms;
    }
}

#[test]
fn changes_arrive_at_the_host_and_a_shutdown_is_published() {
    let Some((live, broker, host)) = plant() else { return };
    let mut edge = Edge::start(&live, &broker.url(), PRIMARY);
    host.await_it("birth", |host| host.count(MessageKind::NodeBirth) > 0);
    await_more(&host, 20);
    let told = host.told();
    let fact = |name: &str| told.iter().rev().find(|of| of.name == name).map(|of| &of.value);
    assert_eq!(fact(vocabulary::MODE), Some(&MetricValue::Text("RUN".to_owned())));
    assert_eq!(fact(vocabulary::CONTROLLER), Some(&MetricValue::Bool(true)));
    await_whole(&host);
    are_ordered(&host);
    edge.end();
    assert!(edge.said().ends_with("ends after a signal: its death was published\n"));
    host.await_it("death", |host| host.count(MessageKind::NodeDeath) > 0);
    let birth = host.heard().into_iter().rfind(|of| of.kind == MessageKind::NodeBirth);
    let death = host.heard().into_iter().rfind(|of| of.kind == MessageKind::NodeDeath);
    let number = |metrics: &[rungd_net::sparkplug::Metric]| {
        let is_it =
            |of: &&rungd_net::sparkplug::Metric| of.name.as_deref() == Some(vocabulary::BD_SEQ);
        metrics.iter().find(is_it).unwrap().content.clone()
    };
    assert_eq!(number(&birth.unwrap().payload.metrics), number(&death.unwrap().payload.metrics));
}

#[test]
fn changes_during_a_pause_of_the_broker_arrive_later() {
    let Some((live, broker, host)) = plant() else { return };
    let edge = Edge::start(&live, &broker.url(), PRIMARY);
    await_more(&host, 10);
    broker.stop();
    edge.await_line("the next try", 1);
    std::thread::sleep(Duration::from_secs(2));
    broker.cont();
    edge.await_line("answers", 3);
    await_more(&host, 30);
    host.await_it("past", |host| host.told().iter().any(|of| of.is_historical && of.name == "n"));
    await_more(&host, 10);
    await_whole(&host);
    are_ordered(&host);
}

#[test]
fn changes_while_the_broker_is_dead_arrive_later() {
    let Some((live, mut broker, host)) = plant() else { return };
    let edge = Edge::start(&live, &broker.url(), PRIMARY);
    await_more(&host, 10);
    broker.kill();
    edge.await_line("the next try", 1);
    std::thread::sleep(Duration::from_secs(2));
    broker.start_again();
    await_more(&host, 40);
    await_whole(&host);
    are_ordered(&host);
}

#[test]
fn a_killed_edge_node_resumes_at_its_saved_position() {
    let Some((live, broker, host)) = plant() else { return };
    let mut edge = Edge::start(&live, &broker.url(), PRIMARY);
    await_more(&host, 25);
    // An edge node that is killed before it has saved its position sends no historical values.
    let position = live.folder.join("state/position");
    host.await_it("a place that is kept", |_| position.exists());
    edge.kill_and_start();
    host.await_it("death", |host| host.count(MessageKind::NodeDeath) > 0);
    host.await_it("birth", |host| host.count(MessageKind::NodeBirth) > 1);
    await_more(&host, 25);
    await_whole(&host);
}

/// The broker drops the paused edge node, and publishes its will.
#[test]
fn a_paused_edge_node_resumes_at_its_position() {
    let Some((live, broker, host)) = plant() else { return };
    let edge = Edge::start(&live, &broker.url(), PRIMARY);
    await_more(&host, 10);
    edge.signal("STOP");
    host.await_it("death", |host| host.count(MessageKind::NodeDeath) > 0);
    edge.signal("CONT");
    host.await_it("birth", |host| host.count(MessageKind::NodeBirth) > 1);
    await_more(&host, 80);
    await_whole(&host);
    are_ordered(&host);
}

#[test]
fn a_reload_and_a_restart_of_the_controller_publish_births() {
    let Some((mut live, broker, host)) = plant() else { return };
    let edge = Edge::start(&live, &broker.url(), PRIMARY);
    await_more(&host, 10);
    let more = LADDER.replace("[tags]", "[tags]\nlamp = { at = \"Y7\", spare = true }");
    std::fs::write(live.folder.join("ladder.toml"), more).unwrap();
    live.ok("reload");
    host.await_it("birth", |host| host.told().iter().any(|of| of.is_born && of.name == "lamp"));
    await_more(&host, 10);
    await_whole(&host);
    live.end();
    let before = host.count(MessageKind::NodeBirth);
    edge.await_line("the controller does not answer", 1);
    let command = run(&live.folder, &[]);
    let folder = live.folder.clone();
    std::mem::forget(live);
    let live = Live::of(folder, command);
    host.await_it("birth", |host| host.count(MessageKind::NodeBirth) > before);
    host.await_it("the first values", |host| {
        host.told()
            .iter()
            .any(|of| of.is_historical && of.name == "n" && of.value == MetricValue::Signed(1))
    });
    drop(live);
}

#[test]
fn a_killed_controller_leaves_a_reported_gap() {
    let Some((mut live, broker, host)) = plant() else { return };
    let edge = Edge::start(&live, &broker.url(), PRIMARY);
    await_more(&host, 10);
    live.child.kill().unwrap();
    live.child.wait().unwrap();
    edge.await_line("the controller does not answer", 1);
    let command = run(&live.folder, &[]);
    let folder = live.folder.clone();
    std::mem::forget(live);
    let _live = Live::of(folder, command);
    edge.await_line("lost: perhaps some scans", 1);
    let is_first = |of: &crate::fleet::edge_rig::ToldValue| {
        of.is_historical && of.name == "n" && of.value == MetricValue::Signed(1)
    };
    host.await_it("the first values", |host| host.told().iter().any(is_first));
}

/// One of two brokers is killed: the other broker receives all values.
#[test]
fn another_broker_takes_over_after_the_first_is_killed() {
    let Some((live, mut broker, _host)) = plant() else { return };
    let Some(other) = Mosquitto::start(&MosquittoOptions::default()) else { return };
    let host = Host::listen(&other.url());
    let urls = format!("{}\", \"{}", broker.url(), other.url());
    let edge = Edge::start(&live, &urls, PRIMARY);
    edge.await_line("answers", 2);
    std::thread::sleep(Duration::from_secs(1));
    broker.kill();
    await_more(&host, 20);
    await_whole(&host);
}

/// The edge node's server in a cluster is killed. The host, at a different server, receives all
/// values.
#[test]
fn a_cluster_that_loses_a_node_loses_no_change() {
    let Some(mut cluster) = NatsCluster::start() else { return };
    let urls = cluster.urls();
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let host = Host::listen(&urls[2]);
    let edge = Edge::start(&live, &urls[..2].join("\", \""), "");
    await_more(&host, 20);
    cluster.kill(0);
    edge.await_line("the next try", 1);
    host.await_it("past", |host| host.told().iter().any(|of| of.is_historical && of.name == "n"));
    await_more(&host, 30);
    await_whole(&host);
}

#[test]
fn an_edge_node_presents_and_verifies_certificates() {
    let options = MosquittoOptions { tls: true, ..MosquittoOptions::default() };
    let Some(broker) = Mosquitto::start(&options) else { return };
    let of = broker.certificates.as_ref().unwrap();
    let (ca, certificate, key) =
        (Some(of.ca.clone()), Some(of.client.clone()), Some(of.client_key.clone()));
    let host = Host::listen_secured(&broker.url(), Some(TlsFiles { ca, certificate, key }));
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let stranger = Edge::start(&live, &broker.url(), "");
    stranger.await_line("the next try", 1);
    drop(stranger);
    let more = format!(
        "ca = \"{}\"\ncertificate = \"{}\"\nkey = \"{}\"\n",
        of.ca.display(),
        of.client.display(),
        of.client_key.display()
    );
    let _edge = Edge::start(&live, &broker.url(), &more);
    await_more(&host, 5);
}

#[test]
fn commands_write_only_listed_tags() {
    let Some((live, broker, host)) = plant() else { return };
    let more = format!("{PRIMARY}[commands]\ntags = [\"start\"]\n");
    let edge = Edge::start(&live, &broker.url(), &more);
    await_more(&host, 5);
    let rebirths = host.count(MessageKind::NodeBirth);
    host.command(vec![commanded(vocabulary::REBIRTH, DataType::Boolean, MetricValue::Bool(true))]);
    host.await_it("rebirth", |host| host.count(MessageKind::NodeBirth) > rebirths);
    host.send("spBv1.0/plant/NCMD/press", vec![0xff; 100]);
    host.command(vec![commanded("n", DataType::Int32, MetricValue::Signed(-1_000_000))]);
    host.command(vec![commanded("start", DataType::Boolean, MetricValue::Bool(true))]);
    host.await_it("the output", |host| {
        host.told().iter().any(|of| of.name == "on" && of.value == MetricValue::Bool(true))
    });
    edge.await_line("`[commands] tags` does not list it", 1);
    await_more(&host, 5);
    await_whole(&host);
    assert!(live.ok("why start").contains("sparkplug"), "{}", live.ok("why start"));
}
