//! The packets of a session, and its events, with a broker that is in order.

use std::time::Duration;

use tokio::io::duplex;

use super::super::{BrokerLogin, LastWill, MqttEvent, MqttSession, MqttVersion, Qos};
use super::*;

#[test]
fn the_connect_packet_contains_every_setting() {
    run(async {
        for version in VERSIONS {
            let mut settings = settings(version);
            settings.keepalive = Duration::from_millis(1500);
            let (user, password) = ("plant".to_owned(), "sesame".to_owned());
            settings.login = Some(BrokerLogin { user, password });
            let (ours, theirs) = duplex(1 << 10);
            let mut broker = Broker(theirs);
            let (topic, payload) = ("will".to_owned(), vec![1, 2]);
            let will = LastWill { topic, payload, qos: Qos::AtLeastOnce, retain: true };
            let address = address();
            let begin = MqttSession::begin(Box::new(ours), &settings, &address, Some(&will));
            let said = async {
                let (first, body) = broker.packet().await;
                broker.says(connack(version)).await;
                (first, body)
            };
            let (session, (first, body)) = tokio::join!(begin, said);
            session.unwrap();
            assert_eq!(first, 0x10);
            // A clean session, a retained will of QoS 1, user and password; a keepalive of 2 s.
            assert_eq!(body[7..10], [0b1110_1110, 0, 2]);
            assert_eq!(body[6], if version == MqttVersion::V5 { 5 } else { 4 });
            for part in [&b"\x00\x02me"[..], b"\x00\x04will\x00\x02\x01\x02\x00\x05plant"] {
                assert!(body.windows(part.len()).any(|bytes| bytes == part), "{body:?}");
            }
            // With MQTT 5, the packet contains the maximum packet length: 1000 bytes.
            let told = body.windows(5).any(|bytes| bytes == [0x27, 0, 0, 3, 0xe8]);
            assert_eq!(told, version == MqttVersion::V5);
        }
    });
}

#[test]
fn received_messages_have_their_topic_payload_and_flags() {
    run(async {
        for version in VERSIONS {
            let (mut session, mut broker) = session(version).await;
            let once = Delivery { qos: Qos::AtLeastOnce, retained: true };
            broker.says(&publish(version, "a/b", b"one", once)).await;
            broker
                .says(&publish(
                    version,
                    "c",
                    b"",
                    Delivery { qos: Qos::AtMostOnce, retained: false },
                ))
                .await;
            assert_eq!(session.next().await.unwrap(), message("a/b", b"one", once));
            let other = message("c", b"", Delivery { qos: Qos::AtMostOnce, retained: false });
            assert_eq!(session.next().await.unwrap(), other);
            session.ping().await.unwrap();
            // The acknowledgement of the first message, before the ping.
            assert_eq!(broker.packet().await, (0x40, vec![0, 7]));
            assert_eq!(broker.packet().await.0, 0xc0);
        }
    });
}

#[test]
fn packets_are_read_byte_by_byte_even_if_calls_are_cancelled() {
    run(async {
        for version in VERSIONS {
            let (mut session, mut broker) = session(version).await;
            let how = Delivery { qos: Qos::AtLeastOnce, retained: false };
            for byte in publish(version, "a", &[5; 300], how) {
                let nothing = tokio::time::timeout(Duration::from_millis(1), session.next()).await;
                assert!(nothing.is_err());
                broker.says(&[byte]).await;
            }
            assert_eq!(session.next().await.unwrap(), message("a", &[5; 300], how));
        }
    });
}

#[test]
fn acknowledgements_have_the_numbers_of_their_messages() {
    run(async {
        for version in VERSIONS {
            let (mut session, mut broker) = session(version).await;
            let mut numbers = Vec::new();
            for _ in 0..3 {
                let number = session.publish("a", b"x", Qos::AtLeastOnce, true).await.unwrap();
                numbers.push(number.unwrap());
                let (first, body) = broker.packet().await;
                assert_eq!((first, &body[..3]), (0x33, &[0, 1, b'a'][..]));
                assert_eq!(body[3..5], number.unwrap().to_be_bytes());
            }
            assert_eq!(session.publish("a", b"", Qos::AtMostOnce, false).await.unwrap(), None);
            for number in numbers.iter().rev() {
                let [high, low] = number.to_be_bytes();
                broker.says(&[0x40, 2, high, low]).await;
                assert_eq!(session.next().await.unwrap(), MqttEvent::Acknowledged(*number));
            }
        }
    });
}

#[test]
fn a_subscription_keeps_messages_that_arrive_before_its_answer() {
    run(async {
        for version in VERSIONS {
            let (mut session, mut broker) = session(version).await;
            let early =
                publish(version, "a/1", b"kept", Delivery { qos: Qos::AtMostOnce, retained: true });
            let answers = async {
                let (first, body) = broker.packet().await;
                assert_eq!(first, 0x82);
                broker.says(&early).await;
                match version {
                    MqttVersion::V3 => broker.says(&[0x90, 4, body[0], body[1], 0, 1]).await,
                    MqttVersion::V5 => broker.says(&[0x90, 5, body[0], body[1], 0, 0, 1]).await,
                }
            };
            let filters = [("a/#", Qos::AtMostOnce), ("b", Qos::AtLeastOnce)];
            let (subscribed, ()) = tokio::join!(session.subscribe(&filters), answers);
            subscribed.unwrap();
            let kept = message("a/1", b"kept", Delivery { qos: Qos::AtMostOnce, retained: true });
            assert_eq!(session.next().await.unwrap(), kept);
        }
    });
}

#[test]
fn a_refused_filter_gives_a_failure_with_its_name() {
    run(async {
        for (version, answer, words) in [
            (MqttVersion::V3, &[0x90, 4, 0, 1, 0, 0x80][..], "refuses it without a reason"),
            (MqttVersion::V5, &[0x90, 5, 0, 1, 0, 0, 0x87], "not allowed"),
        ] {
            let (mut session, mut broker) = session(version).await;
            broker.says(answer).await;
            let filters = [("a", Qos::AtMostOnce), ("secret/#", Qos::AtMostOnce)];
            let said = session.subscribe(&filters).await.unwrap_err().to_string();
            assert!(said.contains("`secret/#`") && said.contains(words), "{said}");
            assert!(said.starts_with("broker mqtt://plant:1: "), "{said}");
        }
    });
}

#[test]
fn the_answer_to_a_ping_has_its_number() {
    run(async {
        for version in VERSIONS {
            let (mut session, mut broker) = session(version).await;
            for number in 1..4 {
                assert_eq!(session.ping().await.unwrap(), number);
            }
            broker.says(&PINGRESP.repeat(3)).await;
            for number in 1..4 {
                assert_eq!(session.next().await.unwrap(), MqttEvent::Pong(number));
            }
        }
    });
}

#[test]
fn a_disconnect_waits_until_the_broker_has_read_everything() {
    run(async {
        for version in VERSIONS {
            let (mut session, mut broker) = session(version).await;
            session.publish("a", &[1; 100], Qos::AtMostOnce, false).await.unwrap();
            let answers = async {
                assert_eq!(broker.packet().await.0, 0x30);
                let (first, body) = broker.packet().await;
                assert_eq!(first, 0xe0);
                // The code 0 is normal, and may be left out.
                assert!(body.iter().all(|byte| *byte == 0), "{body:?}");
                // Later messages from the broker are received, but ignored.
                broker
                    .says(&publish(
                        version,
                        "late",
                        b"",
                        Delivery { qos: Qos::AtMostOnce, retained: false },
                    ))
                    .await;
                drop(broker);
            };
            let (ended, ()) = tokio::join!(session.disconnect(), answers);
            ended.unwrap();
        }
    });
}
