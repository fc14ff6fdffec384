//! Servers that are no brokers, and brokers that send invalid packets or refuse a session.

use tokio::io::duplex;

use super::super::{MqttSession, MqttVersion, Qos, conversation};
use super::*;

/// The reason why no session begins with a broker that first sends these bytes.
async fn refusal(version: MqttVersion, says: &[u8]) -> String {
    let (ours, theirs) = duplex(1 << 10);
    let mut broker = Broker(theirs);
    broker.says(says).await;
    let (settings, address) = (settings(version), address());
    let begin = MqttSession::begin(Box::new(ours), &settings, &address, None).await;
    drop(broker);
    begin.err().expect("no session").to_string()
}

#[test]
fn a_refusal_is_reported_in_words() {
    run(async {
        for (version, says, words) in [
            (MqttVersion::V3, &[0x20, 2, 0, 1][..], "version of MQTT"),
            (MqttVersion::V3, &[0x20, 2, 0, 2], "client id"),
            (MqttVersion::V3, &[0x20, 2, 0, 3], "not available"),
            (MqttVersion::V3, &[0x20, 2, 0, 4], "password is wrong"),
            (MqttVersion::V3, &[0x20, 2, 0, 5], "correct the login"),
            (MqttVersion::V5, &[0x20, 3, 0, 0x86, 0], "password is wrong"),
            (MqttVersion::V5, &[0x20, 3, 0, 0x9d, 0], "moved"),
            // A broker with only MQTT 3.1.1.
            (MqttVersion::V5, &[0x20, 2, 0, 1], "version of MQTT"),
        ] {
            let said = refusal(version, says).await;
            assert!(said.contains(words) && said.contains("refused"), "{said}");
        }
    });
}

#[test]
fn a_peer_that_is_no_mqtt_broker_is_reported() {
    run(async {
        for version in VERSIONS {
            for says in [
                &b"HTTP/1.1 400 Bad Request\r\n\r\n"[..],
                b"220 mail.example ESMTP\r\n",
                &[0x20, 2, 0, 9],
                &[0x20, 1, 0],
                &[0x20, 0xff, 0xff, 0xff, 0xff, 1],
                &[0x00, 0],
                PINGRESP,
                &[0x90, 3, 0, 1, 0],
                &publish(version, "early", b"", Delivery { qos: Qos::AtMostOnce, retained: false }),
            ] {
                let said = refusal(version, says).await;
                let known = ["an invalid packet", "more than 1000 bytes"];
                assert!(known.iter().any(|words| said.contains(words)), "{says:?}: {said}");
            }
        }
    });
}

#[test]
fn an_invalid_packet_of_the_broker_ends_the_session() {
    run(async {
        for version in VERSIONS {
            let how = Delivery { qos: Qos::AtMostOnce, retained: false };
            for says in [
                connack(version),
                PINGRESP,
                PINGREQ,
                &[0x40, 2, 0, 1],
                &[0x50, 2, 0, 1],
                &[0x62, 2, 0, 1],
                &[0x70, 2, 0, 1],
                &[0x90, 3, 0, 1, 0],
                &[0xb0, 2, 0, 1],
                &[0xf0, 0],
                &[0x34, 6, 0, 1, b'a', 0, 9, 0],
                &[0x36, 6, 0, 1, b'a', 0, 9, 0],
                &publish(version, "", b"", how),
                &publish(version, "a/#", b"", how),
                &[0x30, 3, 0, 9, b'a'],
                &[0x30, 3, 0, 1, 0xff],
            ] {
                let (mut session, mut broker) = session(version).await;
                broker.says(says).await;
                let cause = end(&mut session, 0).await;
                assert!(matches!(cause, MqttCause::Garbage(_)), "{version:?} {says:?}: {cause}");
            }
        }
    });
}

#[test]
fn a_lost_connection_differs_from_a_disconnect() {
    run(async {
        let (mut session, mut broker) = session(MqttVersion::V5).await;
        broker.says(&[0xe0, 2, 0x8e, 0]).await;
        let cause = end(&mut session, 0).await;
        assert!(cause.to_string().contains("same client id"), "{cause}");
        for version in VERSIONS {
            let (mut session, mut broker) = super::session(version).await;
            // Half of a frame, then the end of the connection.
            broker.says(&[0x30, 9, 0]).await;
            drop(broker);
            assert_eq!(end(&mut session, 0).await, MqttCause::Closed);
        }
    });
}

#[test]
fn a_refused_message_gives_a_failure_with_its_reason() {
    run(async {
        let (mut session, mut broker) = session(MqttVersion::V5).await;
        let once = Qos::AtLeastOnce;
        let number = session.publish("a", b"", once, false).await.unwrap().unwrap();
        let [high, low] = number.to_be_bytes();
        broker.says(&[0x40, 3, high, low, 0x97]).await;
        let cause = end(&mut session, 0).await;
        assert_eq!(cause, MqttCause::MessageRefused(0x97, number));
        assert!(cause.to_string().contains("quota"), "{cause}");
    });
}

#[test]
fn a_message_that_cannot_be_sent_does_not_end_the_session() {
    run(async {
        for version in VERSIONS {
            let (mut session, mut broker) = session(version).await;
            let long = "a".repeat(70_000);
            for topic in ["", "a/#", "+", "a\0", &long] {
                let sent = session.publish(topic, b"", Qos::AtLeastOnce, false).await;
                let cause = sent.unwrap_err().cause;
                assert!(matches!(cause, MqttCause::NotSendable(_)), "{cause}");
            }
            for filters in [&[][..], &[("a", Qos::AtMostOnce); 65], &[("", Qos::AtMostOnce)]] {
                let cause = session.subscribe(filters).await.unwrap_err().cause;
                assert!(matches!(cause, MqttCause::NotSendable(_)), "{filters:?}: {cause}");
            }
            session.publish("a", b"", Qos::AtMostOnce, false).await.unwrap();
            assert_eq!(broker.packet().await.0, 0x30);
        }
    });
}

#[test]
fn unread_messages_stay_in_the_socket() {
    run(async {
        let mut settings = settings(MqttVersion::V3);
        settings.queue_bytes_max = 10_000;
        settings.packet_bytes_max = 10_000;
        let (mut session, mut broker) = begun(&settings, CONNACK_3, 1000).await;
        let flood = publish(
            MqttVersion::V3,
            "a",
            &[0; 900],
            Delivery { qos: Qos::AtMostOnce, retained: false },
        );
        let floods = async {
            for count in 0.. {
                let said = tokio::time::timeout(KEEPALIVE, broker.says(&flood)).await;
                if said.is_err() {
                    return count;
                }
            }
            unreachable!()
        };
        let sends = async {
            for _ in 0..200 {
                session.publish("a", b"", Qos::AtMostOnce, false).await.unwrap();
                tokio::time::sleep(KEEPALIVE / 100).await;
            }
        };
        let (count, ()) = tokio::join!(floods, sends);
        assert!((8..20).contains(&count), "{count}");
    });
}

#[test]
fn a_conversation_ends_for_any_bytes() {
    let mut random = rungd_base::random::SplitMix64(7);
    for _ in 0..20_000 {
        let length = random.next() % 60;
        let mut bytes: Vec<u8> = (0..length).map(|_| random.next() as u8).collect();
        // Most of the inputs begin like a packet.
        if let [_, kind, count, ..] = &mut bytes[..] {
            (*kind, *count) = (*kind & 0xf3, *count & 0x1f);
        }
        conversation(&bytes);
    }
}

/// A message of QoS 1 with number 0, in both versions.
#[test]
fn a_message_with_number_0_is_refused() {
    for version in [0, 3] {
        conversation(&[version, 0x33, 7, 0, 3, b't', b'/', b'1', 0, 0]);
        conversation(&[version, 0x33, 10, 0, 3, b't', b'/', b'1', 0, 0, 0, 0, 0]);
    }
}
