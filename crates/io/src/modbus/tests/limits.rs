//! The limits of the server: the number of connections, and the time that a client may take.

use std::io::Write;
use std::thread;
use std::time::{Duration, Instant};

use super::controller::{Controller, settings};
use crate::modbus::settings::ModbusServerSettings;

const PERIOD: Duration = Duration::from_millis(2);
const READ: [u8; 5] = [3, 0, 0, 0, 1];
const FRAME: Duration = Duration::from_millis(300);
const IDLE: Duration = Duration::from_millis(600);

fn impatient() -> Controller {
    let [frame_timeout_ms, idle_timeout_ms] = [FRAME, IDLE].map(|limit| limit.as_millis() as u32);
    Controller::start(
        ModbusServerSettings { frame_timeout_ms, idle_timeout_ms, ..settings() },
        PERIOD,
    )
}

#[test]
fn a_connection_beyond_the_limit_is_closed() {
    let controller =
        Controller::start(ModbusServerSettings { connections: 3, ..settings() }, PERIOD);
    let mut inside: Vec<_> = (0..3).map(|_| controller.client()).collect();
    for client in &mut inside {
        client.ask(&READ);
    }
    assert!(controller.client().is_closed());
    for client in &mut inside {
        client.ask(&READ);
    }
    drop(inside.pop());
    let since = Instant::now();
    let mut admitted = loop {
        let mut client = controller.client();
        let frame = client.frame(&READ);
        if client.stream.write_all(&frame).is_ok() && client.next_reply().is_some() {
            break client;
        }
        assert!(since.elapsed() < Duration::from_secs(5), "its place is free again");
        thread::sleep(Duration::from_millis(10));
    };
    admitted.ask(&READ);
}

#[test]
fn the_oldest_silent_connection_is_closed_for_a_new_client() {
    let controller =
        Controller::start(ModbusServerSettings { connections: 3, ..settings() }, PERIOD);
    let mut panel = controller.client();
    panel.ask(&READ);
    let (mut first, mut second) = (controller.client(), controller.client());
    first.stream.write_all(&[0, 1, 0]).unwrap();
    let mut newcomer = controller.client();
    assert_eq!(newcomer.ask(&READ).len(), 4);
    assert!(first.is_closed());
    let mut another = controller.client();
    assert_eq!(another.ask(&READ).len(), 4);
    assert!(second.is_closed());
    assert!(controller.client().is_closed(), "all have been served, and keep their places");
    for client in [&mut panel, &mut newcomer, &mut another] {
        assert_eq!(client.ask(&READ).len(), 4);
    }
}

#[test]
fn an_unfinished_frame_ends_the_connection() {
    let controller = impatient();
    let mut client = controller.client();
    client.ask(&READ);
    let (frame, since) = (client.frame(&READ), Instant::now());
    client.stream.write_all(&frame[..9]).unwrap();
    assert!(client.is_closed());
    assert!((FRAME..IDLE).contains(&since.elapsed()), "{:?}", since.elapsed());
}

#[test]
fn single_bytes_do_not_extend_the_time_limit_of_a_frame() {
    let controller = impatient();
    let mut client = controller.client();
    let (frame, since) = (client.frame(&READ), Instant::now());
    for byte in frame {
        if client.stream.write_all(&[byte]).is_err() {
            break;
        }
        thread::sleep(FRAME / 4);
    }
    assert!(client.is_closed());
    assert!(since.elapsed() > FRAME);
}

#[test]
fn a_silent_client_is_disconnected_but_a_slow_client_is_not() {
    let controller = impatient();
    let (mut silent, mut slow) = (controller.client(), controller.client());
    let since = Instant::now();
    for _ in 0..4 {
        slow.ask(&READ);
        thread::sleep(IDLE / 3);
    }
    assert!(silent.is_closed());
    assert!(since.elapsed() >= IDLE);
    slow.ask(&READ);
}

#[test]
fn a_client_that_reads_no_replies_is_disconnected() {
    let controller = impatient();
    let mut greedy = controller.client();
    greedy.stream.set_write_timeout(Some(Duration::from_millis(100))).unwrap();
    let requests = greedy.frame(&[4, 0, 0, 0, 125]).repeat(1000);
    let since = Instant::now();
    while since.elapsed() < Duration::from_secs(20) {
        match greedy.stream.write(&requests) {
            Ok(_) => {}
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
            Err(_) => break,
        }
    }
    assert!(since.elapsed() < Duration::from_secs(20), "the server closed it");
    controller.client().ask(&READ);
}
