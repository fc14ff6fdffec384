//! Packets that are longer than allowed: messages are left out, any other packet ends the session.

use std::time::Duration;

use tokio::time::{Instant, sleep};

use super::super::skip::{PacketSieve, SiftedBytes};
use super::super::{LinkSilence, LongMessage, MqttEvent, MqttVersion, Qos};
use super::*;

const TOPIC: &str = "plant/giant";

/// A message whose packet has exactly this number of bytes, from 131 to 16386.
fn giant(version: MqttVersion, how: Delivery, bytes: usize) -> Vec<u8> {
    let rest = publish(version, TOPIC, b"", how).len();
    let packet = publish(version, TOPIC, &vec![7; bytes - rest], how);
    assert_eq!(packet.len(), bytes);
    packet
}

fn left_out(bytes: u32, retained: bool) -> LongMessage {
    LongMessage { topic: TOPIC.to_owned(), bytes, bytes_max: 1000, retained }
}

const HOWS: [Delivery; 3] = [
    Delivery { qos: Qos::AtMostOnce, retained: true },
    Delivery { qos: Qos::AtLeastOnce, retained: false },
    Delivery { qos: Qos::AtLeastOnce, retained: true },
];

/// The bytes that a sieve passes and the messages that it leaves out, if the bytes come in these
/// parts.
fn sifted(parts: &[&[u8]]) -> (Vec<u8>, Vec<(LongMessage, Option<u16>)>) {
    let mut sieve = PacketSieve::new(1000);
    let (mut passed, mut out) = (Vec::new(), Vec::new());
    for part in parts {
        let mut bytes = *part;
        while let Some(sifted) = sieve.next(&mut bytes).unwrap() {
            match sifted {
                SiftedBytes::Head(head, count) => passed.extend(&head[..count]),
                SiftedBytes::Body(body) => passed.extend(body),
                SiftedBytes::LeftOut(message, number) => out.push((message, number)),
            }
        }
        assert!(bytes.is_empty());
    }
    assert_eq!(sieve.under_way(), None);
    (passed, out)
}

#[test]
fn an_oversized_message_is_skipped_however_the_bytes_are_split() {
    for version in VERSIONS {
        for how in HOWS {
            let small = publish(version, "a", b"one", how);
            let bytes = [&small[..], PINGRESP, &giant(version, how, 1001), &small, PINGRESP];
            let (bytes, passes) =
                (bytes.concat(), [&small[..], PINGRESP, &small, PINGRESP].concat());
            let number = (how.qos == Qos::AtLeastOnce).then_some(7);
            let expected = (passes, vec![(left_out(1001, how.retained), number)]);
            for at in 0..=bytes.len() {
                assert_eq!(sifted(&[&bytes[..at], &bytes[at..]]), expected, "cut at {at}");
            }
            let each: Vec<&[u8]> = bytes.chunks(1).collect();
            assert_eq!(sifted(&each), expected);
            assert_eq!(sifted(&[&bytes]), expected);
        }
    }
}

#[test]
fn the_longest_packet_passes_whole() {
    for version in VERSIONS {
        let longest = giant(version, HOWS[1], 1000);
        assert_eq!(sifted(&[&longest]), (longest, Vec::new()));
    }
    // The sieve passes any other packet, and a length of five bytes: the library refuses them.
    for bytes in [&[0x20, 0xe9, 7][..], &[0x30, 0xff, 0xff, 0xff, 0xff], &[0x40, 0x80, 0x80, 0]] {
        assert_eq!(sifted(&[bytes]), (bytes.to_vec(), Vec::new()));
    }
}

#[test]
fn only_the_beginning_of_a_long_topic_is_kept() {
    let mut packet = vec![0x31, 0x84, 0x20, 0x0f, 0xff];
    packet.extend([b't'; 0xfff]);
    packet.extend([0; 3]);
    let (passed, out) = sifted(&[&packet]);
    assert!(passed.is_empty());
    let [(LongMessage { topic, bytes, .. }, None)] = &out[..] else { panic!("{out:?}") };
    assert_eq!((topic.as_str(), *bytes), (&*("t".repeat(200) + "…"), packet.len() as u32));
}

#[test]
fn a_session_continues_after_an_oversized_message() {
    run(async {
        for version in VERSIONS {
            for how in HOWS {
                let (mut session, mut broker) = session(version).await;
                let small = publish(version, "a", b"one", how);
                broker.says(&[&small[..], &giant(version, how, 9000), &small].concat()).await;
                let one = message("a", b"one", how);
                assert_eq!(session.next().await.unwrap(), one);
                let giant = MqttEvent::LeftOut(left_out(9000, how.retained));
                assert_eq!(session.next().await.unwrap(), giant);
                assert_eq!(session.next().await.unwrap(), one);
                session.ping().await.unwrap();
                let numbered = if how.qos == Qos::AtLeastOnce { 3 } else { 0 };
                for _ in 0..numbered {
                    assert_eq!(broker.packet().await, (0x40, vec![0, 7]));
                }
                assert_eq!(broker.packet().await.0, PINGREQ[0]);
            }
        }
    });
}

#[test]
fn an_invalid_oversized_message_ends_the_session() {
    run(async {
        for version in VERSIONS {
            for says in [
                // QoS 2; no topic; a topic that is longer than the message; number 0.
                &[0x34, 0xe9, 7, 0, 1, b'a', 0, 9][..],
                &[0x30, 0xe9, 7, 0, 0, 0, 9],
                &[0x30, 0xe9, 7, 0x03, 0xe8, b'a'],
                &[0x32, 0xe9, 7, 0, 1, b'a', 0, 0],
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
fn an_oversized_packet_that_is_no_message_is_refused_by_its_length() {
    run(async {
        for version in VERSIONS {
            let (mut session, mut broker) = session(version).await;
            broker
                .says(&publish(
                    version,
                    "a",
                    b"before",
                    Delivery { qos: Qos::AtMostOnce, retained: false },
                ))
                .await;
            broker.says(&[0x90, 0xff, 0xff, 0xff, 0x7f]).await;
            assert_eq!(end(&mut session, 1).await, MqttCause::TooLong(1000));
        }
    });
}

/// The head of a retained message of 256 MiB, with its topic.
fn endless() -> Vec<u8> {
    [&[0x31, 0xff, 0xff, 0xff, 0x7f, 0, TOPIC.len() as u8][..], TOPIC.as_bytes()].concat()
}

/// After three to five keepalives, a session fails because it has no answer.
fn is_blocked(failure: &MqttFailure, since: Instant) {
    let MqttCause::Blocked(message, LinkSilence::NoPong, _) = &failure.cause else {
        panic!("{failure}")
    };
    assert_eq!((&*message.topic, message.bytes), (TOPIC, (1 << 28) + 4));
    assert!(failure.is_silent() && failure.to_string().contains("removes it"), "{failure}");
    assert!((3..=5).contains(&(since.elapsed().as_secs() / KEEPALIVE.as_secs())));
}

/// The failure of a session while the broker sends bytes.
async fn failure_beside(
    session: &mut MqttSession,
    speaks: impl Future<Output = ()>,
) -> MqttFailure {
    tokio::select! {
        () = speaks => panic!("it is never silent"),
        next = session.next() => next.unwrap_err(),
    }
}

#[test]
fn a_slow_oversized_message_does_not_count_as_an_answer() {
    run(async {
        let (mut session, mut broker) = session(MqttVersion::V3).await;
        let since = Instant::now();
        let trickles = async {
            broker.says(&endless()).await;
            for _ in 0..600 {
                sleep(Duration::from_millis(100)).await;
                broker.says(&[0; 10]).await;
            }
        };
        is_blocked(&failure_beside(&mut session, trickles).await, since);
    });
}

#[test]
fn many_oversized_messages_do_not_count_as_an_answer_and_take_no_memory() {
    run(async {
        let (mut session, mut broker) = session(MqttVersion::V3).await;
        let since = Instant::now();
        let floods = async {
            broker.says(&endless()).await;
            loop {
                broker.says(&[0; 1 << 14]).await;
                sleep(Duration::from_millis(5)).await;
            }
        };
        is_blocked(&failure_beside(&mut session, floods).await, since);
    });
}
