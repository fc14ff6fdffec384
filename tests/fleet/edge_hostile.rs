//! `rungd edge` beside strangers at its broker, and beside a log that nobody reads.

use rungd::mqtt::{MqttVersion, Qos};
use rungd::sparkplug::MessageKind;

use crate::edge::{PRIMARY, are_ordered, await_more, await_whole, plant};
use crate::edge_rig::Edge;
use crate::sessions::{confirmed, run, session, settings};

const COMMANDS: &str = "spBv1.0/plant/NCMD/press";

/// Publishes messages as a stranger, and waits until the broker has them.
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

/// A broker of MQTT 5 keeps it to itself: it is told the longest packet.
#[test]
fn a_giant_that_the_broker_keeps_does_not_keep_a_node_away() {
    for (version, said) in [("3.1.1", 1), ("5", 0)] {
        let Some((live, broker, host)) = plant() else { return };
        strange(&broker.url(), &[(COMMANDS, &vec![0; 2 << 20], true)]);
        let more = format!("version = \"{version}\"\n{PRIMARY}");
        let mut edge = Edge::start(&live, &broker.url(), &more);
        await_more(&host, 20);
        // One that comes later.
        strange(&broker.url(), &[(COMMANDS, &vec![0; 3 << 20], false)]);
        await_more(&host, 20);
        edge.await_line(&format!("for `{COMMANDS}`, where 1048576 are the most"), 2 * said);
        edge.await_line("removes it", said);
        await_whole(&host);
        edge.end();
        let log = edge.said();
        assert_eq!(log.matches("left out: a message of 2097").count(), said, "{log}");
        assert_eq!(
            (log.matches("the next try").count(), host.count(MessageKind::NodeBirth)),
            (0, 1)
        );
    }
}

#[test]
fn a_log_that_nobody_reads_holds_nothing_up() {
    let Some((live, broker, host)) = plant() else { return };
    let mut edge = Edge::start_unheard(&live, &broker.url(), PRIMARY);
    await_more(&host, 20);
    edge.end();
    host.await_it("death", |host| host.count(MessageKind::NodeDeath) > 0);
}

#[test]
fn an_end_without_a_broker_is_said() {
    let Some((live, mut broker, host)) = plant() else { return };
    let mut edge = Edge::start(&live, &broker.url(), PRIMARY);
    await_more(&host, 5);
    broker.kill();
    edge.await_line("the next try", 1);
    edge.end();
    assert!(edge.said().contains("ends as it was told to: it "), "{}", edge.said());
    are_ordered(&host);
}
