//! Arbitrary bytes from a client: the server does not panic, replies only to requests, and
//! continues to serve the other clients.

use std::io::Write;
use std::net::Shutdown;
use std::time::Duration;

use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

use super::super::frame::{FrameSplit, split};
use super::controller::{Controller, RawClient, settings};

const PERIOD: Duration = Duration::from_millis(1);
const CASES: u32 = 100;

fn runner() -> TestRunner {
    TestRunner::new(Config { cases: CASES, failure_persistence: None, ..Config::default() })
}

/// Sends the bytes in pieces of these sizes; the sizes repeat.
fn send(client: &mut RawClient, mut bytes: &[u8], pieces: &[usize]) {
    for piece in pieces.iter().cycle() {
        let (now, later) = bytes.split_at(bytes.len().min(*piece));
        if now.is_empty() || client.stream.write_all(now).is_err() {
            return;
        }
        bytes = later;
    }
}

/// The number of whole frames at the start of the bytes.
fn frames(mut bytes: &[u8]) -> usize {
    let mut count = 0;
    while let FrameSplit::Frame { bytes: taken, .. } = split(bytes) {
        bytes = &bytes[taken..];
        count += 1;
    }
    count
}

#[test]
fn random_bytes_do_not_disturb_other_clients() {
    let controller = Controller::start(settings(), PERIOD);
    let honest = std::cell::RefCell::new(controller.client());
    let bytes = prop::collection::vec(any::<u8>(), 0..600);
    let pieces = prop::collection::vec(1_usize..300, 1..8);
    let run = runner().run(&(bytes, pieces), |(bytes, pieces)| {
        let mut client = controller.client();
        send(&mut client, &bytes, &pieces);
        let _ = client.stream.shutdown(Shutdown::Write);
        prop_assert!(client.is_closed());
        prop_assert_eq!(honest.borrow_mut().ask(&[3, 0, 0, 0, 1]).len(), 4);
        Ok(())
    });
    run.unwrap();
}

#[test]
fn random_requests_split_at_random_are_answered_in_order() {
    let controller = Controller::start(settings(), PERIOD);
    // Mostly functions that the server has, and mostly lengths that fit them.
    let function = prop_oneof![4 => 1_u8..17, 1 => any::<u8>()];
    let body = prop_oneof![
        3 => prop::collection::vec(any::<u8>(), 4..5),
        1 => prop::collection::vec(any::<u8>(), 0..253),
        1 => (0_u8..130, 1_u8..9).prop_map(|(first, count)| vec![0, first, 0, count]),
    ];
    let pdu = (function, body).prop_map(|(function, body)| [vec![function], body].concat());
    let pdus = prop::collection::vec(pdu, 1..20);
    let pieces = prop::collection::vec(1_usize..300, 1..8);
    let run = runner().run(&(pdus, pieces), |(pdus, pieces)| {
        let mut client = controller.client();
        let bytes: Vec<u8> = pdus.iter().flat_map(|pdu| client.frame(pdu)).collect();
        prop_assert_eq!(frames(&bytes), pdus.len());
        send(&mut client, &bytes, &pieces);
        for (pdu, number) in pdus.iter().zip(1..) {
            let (transaction, reply) = client.next_reply().expect("a reply to each");
            prop_assert_eq!(transaction, number);
            prop_assert!(reply[0] == pdu[0] || reply[0] == pdu[0] | 0x80);
        }
        Ok(())
    });
    run.unwrap();
}

#[test]
fn requests_before_invalid_bytes_are_answered() {
    let controller = Controller::start(settings(), PERIOD);
    for garbage in [&b"GET / HTTP/1.1\r\n\r\n"[..], &[0, 1, 0, 0, 0, 0, 1], &[0, 1, 0, 0, 1, 0, 1]]
    {
        let mut client = controller.client();
        let mut bytes = client.frame(&[1, 0, 0, 0, 8]);
        bytes.extend(client.frame(&[3, 0, 0, 0, 2]));
        bytes.extend_from_slice(garbage);
        bytes.extend(client.frame(&[1, 0, 0, 0, 8]));
        client.stream.write_all(&bytes).unwrap();
        assert_eq!(client.next_reply(), Some((1, vec![1, 1, 0])));
        assert_eq!(client.next_reply(), Some((2, vec![3, 4, 0, 0, 0, 0])));
        assert_eq!(client.next_reply(), None, "closed: nobody knows where a frame begins");
    }
}

#[test]
fn requests_of_any_unit_are_answered() {
    let controller = Controller::start(settings(), PERIOD);
    let mut client = controller.client();
    for unit in [0_u8, 1, 247, 255] {
        client.stream.write_all(&[0, 9, 0, 0, 0, 6, unit, 1, 0, 0, 0, 1]).unwrap();
        let mut reply = [0; 10];
        std::io::Read::read_exact(&mut client.stream, &mut reply).unwrap();
        assert_eq!(reply, [0, 9, 0, 0, 0, 4, unit, 1, 1, 0]);
    }
}
