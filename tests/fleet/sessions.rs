//! Sessions with a mosquitto, with both versions of MQTT.

use std::time::Duration;

use rungd_net::mqtt::{
    BrokerAddress, BrokerSettings, LastWill, MqttCause, MqttEvent, MqttFailure, MqttSession,
    MqttVersion, Qos,
};

use crate::fleet::broker::PATIENCE;
use crate::fleet::mosquitto::{Mosquitto, MosquittoOptions};

const VERSIONS: [MqttVersion; 2] = [MqttVersion::V3, MqttVersion::V5];

/// Runs a test's body, with a time limit.
pub fn run(body: impl Future<Output = ()>) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let body = async { tokio::time::timeout(2 * PATIENCE, body).await };
    runtime.block_on(body).expect("it ends in time");
}

/// The settings of a client of this broker.
pub fn settings(url: &str, version: MqttVersion, id: &str) -> BrokerSettings {
    let address = BrokerAddress::parse(url).unwrap();
    let mut settings = BrokerSettings::new(vec![address], id);
    // A busy machine must not look like a silent broker.
    settings.answer_max = PATIENCE;
    settings.version = version;
    settings
}

/// Begins a session; a refusal is a failure.
pub async fn session(settings: &BrokerSettings) -> MqttSession {
    MqttSession::connect(settings, &settings.addresses[0], None).await.unwrap()
}

/// The reason why the broker refuses a session.
pub async fn refusal(settings: &BrokerSettings) -> MqttFailure {
    let refused = MqttSession::connect(settings, &settings.addresses[0], None).await;
    refused.err().expect("no session")
}

/// The next message: its topic, its payload, and whether it was retained.
pub async fn message(session: &mut MqttSession) -> (String, Vec<u8>, bool) {
    loop {
        if let MqttEvent::Message { topic, payload, retained, .. } = session.next().await.unwrap() {
            return (topic, payload, retained);
        }
    }
}

/// Sends a ping, and returns all events before its answer.
pub async fn confirmed(session: &mut MqttSession) -> Vec<MqttEvent> {
    let asked = session.ping().await.unwrap();
    let mut events = Vec::new();
    loop {
        match session.next().await.unwrap() {
            MqttEvent::Pong(number) if number == asked => return events,
            event => events.push(event),
        }
    }
}

#[test]
fn messages_arrive_and_are_acknowledged() {
    for version in VERSIONS {
        // A new broker each time: the next version would otherwise receive the retained messages.
        let Some(broker) = Mosquitto::start(&MosquittoOptions::default()) else { return };
        run(async {
            let of = |id: &str| settings(&broker.url(), version, id);
            let mut reader = session(&of("reader")).await;
            reader.subscribe(&[("a/+", Qos::AtLeastOnce), ("b", Qos::AtMostOnce)]).await.unwrap();
            let mut writer = session(&of("writer")).await;
            let once = Qos::AtLeastOnce;
            let number = writer.publish("a/1", b"one", once, true).await.unwrap().unwrap();
            let acknowledged = writer.next().await.unwrap();
            assert_eq!(acknowledged, MqttEvent::Acknowledged(number));
            writer.publish("b", b"", Qos::AtMostOnce, false).await.unwrap();
            assert_eq!(confirmed(&mut writer).await, []);
            assert_eq!(message(&mut reader).await, ("a/1".to_owned(), b"one".to_vec(), false));
            assert_eq!(message(&mut reader).await, ("b".to_owned(), Vec::new(), false));
            // A later client receives the retained message, marked as retained.
            let mut late = session(&of("late")).await;
            late.subscribe(&[("a/#", Qos::AtMostOnce)]).await.unwrap();
            assert_eq!(message(&mut late).await, ("a/1".to_owned(), b"one".to_vec(), true));
            late.disconnect().await.unwrap();
        });
    }
}

#[test]
fn the_last_will_is_sent_only_without_disconnect() {
    let Some(broker) = Mosquitto::start(&MosquittoOptions::default()) else { return };
    for version in VERSIONS {
        run(async {
            let of = |id: &str| settings(&broker.url(), version, id);
            let mut reader = session(&of("reader")).await;
            reader.subscribe(&[("#", Qos::AtMostOnce)]).await.unwrap();
            let will = |topic: &str| LastWill {
                topic: topic.to_owned(),
                payload: b"gone".to_vec(),
                qos: Qos::AtLeastOnce,
                retain: false,
            };
            let polite = of("polite");
            let polite =
                MqttSession::connect(&polite, &polite.addresses[0], Some(&will("polite"))).await;
            polite.unwrap().disconnect().await.unwrap();
            let lost = of("lost");
            let lost = MqttSession::connect(&lost, &lost.addresses[0], Some(&will("lost"))).await;
            drop(lost.unwrap());
            assert_eq!(message(&mut reader).await, ("lost".to_owned(), b"gone".to_vec(), false));
        });
    }
}

#[test]
fn a_paused_broker_and_a_killed_broker_are_detected() {
    let Some(mut broker) = Mosquitto::start(&MosquittoOptions::default()) else { return };
    run(async {
        let mut short = settings(&broker.url(), MqttVersion::V3, "held");
        short.keepalive = Duration::from_secs(2);
        let mut held = session(&short).await;
        broker.stop();
        let failure = loop {
            // Messages without an acknowledgement do not hide the broker's silence.
            match held.publish("a", &[7; 1000], Qos::AtMostOnce, false).await {
                Err(failure) => break failure,
                Ok(_) => tokio::time::sleep(Duration::from_millis(100)).await,
            }
        };
        assert!(failure.is_silent(), "{failure}");
        assert!(failure.to_string().contains(&broker.port.to_string()), "{failure}");
        broker.cont();
        let mut other = session(&settings(&broker.url(), MqttVersion::V3, "other")).await;
        broker.kill();
        let failure = other.next().await.unwrap_err();
        let gone = matches!(failure.cause, MqttCause::Closed | MqttCause::Broken(_));
        assert!(gone, "{failure}");
        let failure = refusal(&short).await;
        assert!(matches!(failure.cause, MqttCause::Unreachable(_)), "{failure}");
        broker.start_again();
        session(&short).await.disconnect().await.unwrap();
    });
}

#[test]
fn an_oversized_message_is_skipped_and_the_session_continues() {
    let Some(broker) = Mosquitto::start(&MosquittoOptions::default()) else { return };
    run(async {
        let mut writer = session(&settings(&broker.url(), MqttVersion::V3, "writer")).await;
        let mut small = settings(&broker.url(), MqttVersion::V3, "small");
        small.packet_bytes_max = 1000;
        let mut reader = session(&small).await;
        reader.subscribe(&[("a", Qos::AtMostOnce)]).await.unwrap();
        writer.publish("a", &[0; 900], Qos::AtMostOnce, false).await.unwrap();
        writer.publish("a", &[0; 1000], Qos::AtMostOnce, false).await.unwrap();
        writer.publish("a", &[0; 800], Qos::AtMostOnce, false).await.unwrap();
        confirmed(&mut writer).await;
        assert_eq!(message(&mut reader).await.1.len(), 900);
        let left_out = reader.next().await.unwrap();
        assert!(
            matches!(&left_out, MqttEvent::LeftOut(long) if long.topic == "a" && long.bytes == 1006),
            "{left_out:?}"
        );
        assert_eq!(message(&mut reader).await.1.len(), 800);
    });
}
