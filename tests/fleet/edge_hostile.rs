//! `rungd edge` with foreign clients at its broker, and with a log that nobody reads.

use rungd_net::mqtt::{MqttVersion, Qos};
use rungd_net::sparkplug::{DataType, MessageKind, MetricValue};

use crate::fleet::edge::{PRIMARY, are_ordered, await_more, await_whole, plant};
use crate::fleet::edge_rig::{Edge, ToldValue, commanded};
use crate::fleet::sessions::{confirmed, run, session, settings};

const COMMANDS: &str = "spBv1.0/plant/NCMD/press";

/// Publishes messages as a foreign client, and waits until the broker has them.
fn strange(url: &str, messages: &[(&str, &[u8], bool)]) {
    run(async {
        let mut session = session(&settings(url, MqttVersion::V3, "stranger")).await;
        for (topic, payload, retain) in messages {
            session.publish(topic, payload, Qos::AtLeastOnce, *retain).await.unwrap();
        }
        confirmed(&mut session).await;
        session.disconnect().await.unwrap();
    });
}

/// A broker of MQTT 5 does not deliver the giant message, because the client has announced its
/// longest packet.
#[test]
fn an_oversized_retained_message_does_not_block_a_node() {
    for (version, said) in [("3.1.1", 1), ("5", 0)] {
        let Some((live, broker, host)) = plant() else { return };
        strange(&broker.url(), &[(COMMANDS, &vec![0; 2 << 20], true)]);
        let more = format!("version = \"{version}\"\n{PRIMARY}");
        let mut edge = Edge::start(&live, &broker.url(), &more);
        await_more(&host, 20);
        // A giant message during the session.
        strange(&broker.url(), &[(COMMANDS, &vec![0; 3 << 20], false)]);
        await_more(&host, 20);
        edge.await_line(&format!("for `{COMMANDS}`, above the maximum of 1048576"), 2 * said);
        edge.await_line("removes it", said);
        await_whole(&host);
        edge.end();
        let log = edge.said();
        assert_eq!(log.matches("left out: a message of 2097").count(), said, "{log}");
        assert_eq!((log.matches("answers").count(), log.matches("next try").count()), (2, 0));
    }
}

#[test]
fn an_unread_log_does_not_block_an_edge_node() {
    let Some((live, broker, host)) = plant() else { return };
    let mut edge = Edge::start_unheard(&live, &broker.url(), PRIMARY);
    await_more(&host, 20);
    edge.end();
    host.await_it("death", |host| host.count(MessageKind::NodeDeath) > 0);
}

#[test]
fn a_shutdown_without_a_broker_is_reported() {
    let Some((live, mut broker, host)) = plant() else { return };
    let mut edge = Edge::start(&live, &broker.url(), PRIMARY);
    await_more(&host, 5);
    broker.kill();
    edge.await_line("the next try", 1);
    edge.end();
    assert!(edge.said().contains("ends after a signal: it "), "{}", edge.said());
    are_ordered(&host);
}

/// Two nodes of the same name disconnect each other. The log reports it, and each node waits before
/// it connects again.
#[test]
fn a_second_node_of_the_same_name_is_reported() {
    let Some((live, broker, host)) = plant() else { return };
    let edge = Edge::start(&live, &broker.url(), PRIMARY);
    await_more(&host, 5);
    run(async {
        let other = settings(&broker.url(), MqttVersion::V3, "rungd-plant-press");
        let _other = session(&other).await;
        edge.await_line("another client connected with the same client id", 1);
    });
    edge.await_line("this client's id is `rungd-plant-press`", 1);
    await_more(&host, 5);
    await_whole(&host);
}

/// A controller that hangs receives one command at a time. It would otherwise do the rest long
/// after they were sent.
#[test]
fn commands_that_waited_for_a_hanging_controller_are_not_executed() {
    let Some((live, broker, host)) = plant() else { return };
    let more = format!("{PRIMARY}[commands]\ntags = [\"start\"]\n");
    let edge = Edge::start(&live, &broker.url(), &more);
    await_more(&host, 5);
    let pid = rustix::process::Pid::from_child(&live.child);
    rustix::process::kill_process(pid, rustix::process::Signal::STOP).unwrap();
    let start = |on| commanded("start", DataType::Boolean, MetricValue::Bool(on));
    // The answer to the first command may be missing.
    host.command(vec![start(false)]);
    (0..5).for_each(|_| host.command(vec![start(true)]));
    edge.await_line("and is too old", 5);
    rustix::process::kill_process(pid, rustix::process::Signal::CONT).unwrap();
    await_more(&host, 5);
    let is_on = |of: &ToldValue| of.name == "on" && of.value == MetricValue::Bool(true);
    assert!(!host.told().iter().any(is_on));
}

/// The log reports unreadable states once in a while. A state that is older than the host's last
/// one changes nothing.
#[test]
fn invalid_and_older_host_states_are_ignored() {
    let Some((live, broker, host)) = plant() else { return };
    let mut edge = Edge::start(&live, &broker.url(), PRIMARY);
    await_more(&host, 5);
    let text = format!("\"{}\"", "A".repeat(900_000));
    let deep = "[".repeat(100_000);
    let state = "spBv1.0/STATE/judge";
    let old = br#"{"online":false,"timestamp":1}"#;
    let many: Vec<(&str, &[u8], bool)> = vec![(state, b"ONLINE", false); 100];
    strange(&broker.url(), &many);
    let few: [&[u8]; 4] = [text.as_bytes(), deep.as_bytes(), b"\xff", old];
    strange(&broker.url(), &few.map(|payload| (state, payload, false)));
    await_more(&host, 20);
    await_whole(&host);
    edge.end();
    let said = edge.said();
    let is_short = said.lines().all(|line| line.chars().count() < 1100);
    assert!(is_short && !said.contains("next try"), "{said}");
    assert!(said.contains("more lines were left out"), "{said}");
    assert!(said.contains("states of hosts that cannot be read"), "{said}");
}
