//! Brokers and links that send nothing, or take nothing.

use std::time::Duration;

use tokio::io::{AsyncReadExt as _, duplex};
use tokio::time::{Instant, advance, sleep, timeout};

use super::super::{LinkSilence, MqttEvent, MqttFailure, MqttSession, MqttVersion, Qos};
use super::*;

fn silence(failure: &MqttFailure) -> Option<LinkSilence> {
    if let MqttCause::Silent(silence, _) = failure.cause { Some(silence) } else { None }
}

/// Checks that the time since `since` is in this range of tenths of a keepalive.
fn within(since: Instant, from: u32, to: u32) {
    let tenths = since.elapsed().as_millis() / (KEEPALIVE.as_millis() / 10);
    assert!((from..=to).contains(&(tenths as u32)), "{:?}", since.elapsed());
}

#[test]
fn a_broker_is_pinged_after_half_a_keepalive_and_lost_after_another_keepalive() {
    run(async {
        let (mut session, mut broker) = session(MqttVersion::V3).await;
        let since = Instant::now();
        let failure = session.next().await.unwrap_err();
        within(since, 15, 16);
        assert_eq!(silence(&failure), Some(LinkSilence::NoByte), "{failure}");
        assert_eq!(broker.packet().await, (PINGREQ[0], Vec::new()));
        // Every further call returns the same cause.
        assert_eq!(session.next().await.unwrap_err().cause, failure.cause);
        assert_eq!(session.ping().await.unwrap_err().cause, failure.cause);
        let publish = session.publish("a", b"", Qos::AtMostOnce, false).await;
        assert_eq!(publish.unwrap_err().cause, failure.cause);
    });
}

#[test]
fn a_broker_that_answers_is_never_silent() {
    run(async {
        for version in VERSIONS {
            let (mut session, mut broker) = session(version).await;
            let answers = async {
                for _ in 0..100 {
                    assert_eq!(broker.packet().await.0, PINGREQ[0]);
                    sleep(KEEPALIVE * 9 / 10).await;
                    broker.says(PINGRESP).await;
                }
            };
            let hears = async {
                for number in 1..=100 {
                    assert_eq!(session.next().await.unwrap(), MqttEvent::Pong(number));
                }
            };
            tokio::join!(answers, hears);
        }
    });
}

#[test]
fn publishing_to_a_broker_that_never_answers_is_detected() {
    run(async {
        let (mut session, mut broker) = session(MqttVersion::V3).await;
        let since = Instant::now();
        let swallows = async {
            let mut bytes = [0; 1000];
            while broker.0.read(&mut bytes).await.is_ok_and(|count| count > 0) {}
        };
        let sends = async {
            loop {
                let sent = session.publish("a", b"value", Qos::AtMostOnce, false).await;
                if let Err(failure) = sent {
                    within(since, 15, 17);
                    assert_eq!(silence(&failure), Some(LinkSilence::NoByte));
                    drop(session);
                    return;
                }
                sleep(Duration::from_millis(100)).await;
            }
        };
        tokio::join!(swallows, sends);
    });
}

#[test]
fn a_blocked_link_is_detected_and_its_queue_is_limited() {
    run(async {
        let mut settings = settings(MqttVersion::V3);
        settings.queue_bytes_max = 10_000;
        let (mut session, _broker) = begun(&settings, CONNACK_3, 100).await;
        let since = Instant::now();
        let mut queued = 0;
        let failure = loop {
            match session.publish("a", &[0; 1000], Qos::AtMostOnce, false).await {
                Ok(_) => queued += 1,
                Err(failure) => break failure,
            }
        };
        assert!((9..=10).contains(&queued), "{queued}");
        within(since, 10, 11);
        assert_eq!(silence(&failure), Some(LinkSilence::NoProgress), "{failure}");
    });
}

#[test]
fn a_slow_broker_does_not_count_as_silent() {
    run(async {
        let mut settings = settings(MqttVersion::V3);
        settings.queue_bytes_max = 2000;
        settings.answer_max = 100 * KEEPALIVE;
        let (mut session, mut broker) = begun(&settings, CONNACK_3, 64).await;
        let reads = async {
            loop {
                sleep(KEEPALIVE / 5).await;
                let (first, _) = broker.packet().await;
                if first == PINGREQ[0] {
                    broker.says(PINGRESP).await;
                }
            }
        };
        let sends = async {
            for _ in 0..15 {
                session.publish("a", &[0; 1000], Qos::AtMostOnce, false).await.unwrap();
            }
            assert!(matches!(session.next().await.unwrap(), MqttEvent::Pong(_)));
        };
        tokio::select! { () = reads => {}, () = sends => {} }
    });
}

#[test]
fn a_message_longer_than_the_queue_limit_is_sent_alone() {
    run(async {
        let mut settings = settings(MqttVersion::V3);
        settings.queue_bytes_max = 100;
        let (mut session, mut broker) = begun(&settings, CONNACK_3, 64).await;
        let reads = async {
            for _ in 0..2 {
                assert_eq!(broker.packet().await.1.len(), 5003);
            }
        };
        let sends = async {
            for _ in 0..2 {
                session.publish("a", &[0; 5000], Qos::AtMostOnce, false).await.unwrap();
            }
            let nothing = timeout(Duration::from_secs(1), session.next()).await;
            assert!(nothing.is_err());
        };
        tokio::join!(reads, sends);
    });
}

#[test]
fn other_bytes_do_not_replace_the_answer_to_a_ping() {
    run(async {
        let (mut session, mut broker) = session(MqttVersion::V3).await;
        let since = Instant::now();
        let talks = async {
            let message = publish(
                MqttVersion::V3,
                "a",
                b"",
                Delivery { qos: Qos::AtMostOnce, retained: false },
            );
            for _ in 0..50 {
                sleep(KEEPALIVE * 2 / 10).await;
                broker.says(&message).await;
            }
        };
        let hears = async {
            session.ping().await.unwrap();
            loop {
                if let Err(failure) = session.next().await {
                    within(since, 40, 42);
                    return assert_eq!(silence(&failure), Some(LinkSilence::NoPong), "{failure}");
                }
            }
        };
        tokio::select! { () = talks => panic!("it is never silent"), () = hears => {} }
    });
}

#[test]
fn a_paused_client_reads_before_it_reports_silence() {
    run(async {
        let (mut session, mut broker) = session(MqttVersion::V3).await;
        assert_eq!(session.ping().await.unwrap(), 1);
        broker.says(PINGRESP).await;
        advance(20 * KEEPALIVE).await;
        assert_eq!(session.next().await.unwrap(), MqttEvent::Pong(1));
        assert_eq!(session.ping().await.unwrap(), 2);
    });
}

#[test]
fn a_broker_that_never_answers_the_connect_times_out() {
    run(async {
        let (ours, _theirs) = duplex(1 << 10);
        let settings = settings(MqttVersion::V3);
        let address = address();
        let begin = MqttSession::begin(Box::new(ours), &settings, &address, None);
        assert!(timeout(settings.answer_max, begin).await.is_err());
    });
}

#[test]
fn subscriptions_and_messages_without_an_answer_time_out() {
    run(async {
        let (mut session, mut broker) = session(MqttVersion::V3).await;
        let answers = async {
            loop {
                if broker.packet().await.0 == PINGREQ[0] {
                    broker.says(PINGRESP).await;
                }
            }
        };
        let asks = async {
            let mut numbers = 0;
            let failure = loop {
                match session.publish("a", b"", Qos::AtLeastOnce, false).await {
                    Ok(_) => numbers += 1,
                    Err(failure) => break failure,
                }
            };
            assert_eq!((numbers, silence(&failure)), (256, Some(LinkSilence::NoAcknowledgement)));
        };
        tokio::select! { () = answers => {}, () = asks => {} }
        let (mut session, _broker) = super::session(MqttVersion::V3).await;
        let failure = session.subscribe(&[("a", Qos::AtMostOnce)]).await.unwrap_err();
        assert_eq!(silence(&failure), Some(LinkSilence::NoSubscription));
    });
}

#[test]
fn a_version_5_broker_can_lower_the_keepalive_and_the_message_limit() {
    run(async {
        // Server Keep Alive 4 s, Receive Maximum 2.
        let welcome = [0x20, 9, 0, 0, 6, 0x13, 0, 4, 0x21, 0, 2];
        let (mut session, mut broker) = begun(&settings(MqttVersion::V5), &welcome, 1 << 10).await;
        let once = Qos::AtLeastOnce;
        let first = session.publish("a", b"", once, false).await.unwrap().unwrap();
        session.publish("a", b"", once, false).await.unwrap();
        let third = timeout(Duration::from_secs(1), session.publish("a", b"", once, false)).await;
        assert!(third.is_err());
        let [high, low] = first.to_be_bytes();
        broker.says(&[0x40, 2, high, low]).await;
        session.publish("a", b"", once, false).await.unwrap();
        assert_eq!(session.next().await.unwrap(), MqttEvent::Acknowledged(first));
        let since = Instant::now();
        session.next().await.unwrap_err();
        within(since, 5, 7);
    });
}
