//! The server's log lines.

use std::io::Write;
use std::thread;
use std::time::{Duration, Instant};

use super::controller::{Controller, Do, settings};
use crate::modbus::settings::ModbusServerSettings;

const PERIOD: Duration = Duration::from_millis(1);

/// Waits for a log line that contains all of these parts.
fn expect(controller: &Controller, parts: &[&str]) {
    let since = Instant::now();
    let logged = || controller.logged().lines().any(|line| parts.iter().all(|p| line.contains(p)));
    while !logged() {
        let text = controller.logged();
        assert!(since.elapsed() < Duration::from_secs(10), "{parts:?} in:\n{text}");
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_refused_write_is_logged_with_client_place_and_reason() {
    let controller = Controller::start(settings(), PERIOD);
    let mut client = controller.client();
    let address = client.stream.local_addr().unwrap().to_string();
    client.ask(&[16, 0, 122, 0, 2, 4, 0, 1, 0, 1]);
    let place = "place=MHR123..MHR124 exception=2";
    expect(&controller, &["WARN", &address, place, "MHR124 is not in `writable`"]);
    client.ask(&[6, 0, 109, 0, 101]);
    expect(&controller, &["WARN", "place=MHR110 exception=3", "MHR110 takes 1 to 100, not 101"]);
    client.ask(&[5, 0xff, 0xff, 0, 0]);
    expect(&controller, &["WARN", "place=coil 65535 exception=2", "nothing is at coil 65535"]);
    controller.order(Do::Fault);
    client.ask(&[5, 0, 0, 0, 0]);
    expect(&controller, &["WARN", "place=MC1 exception=4", "the controller is in FAULT"]);
}

#[test]
fn connections_are_logged_with_the_reason_of_their_end() {
    let limits = ModbusServerSettings { connections: 1, idle_timeout_ms: 300, ..settings() };
    let controller = Controller::start(limits, PERIOD);
    let mut client = controller.client();
    let address = client.stream.local_addr().unwrap().to_string();
    client.ask(&[1, 0, 0, 0, 1]);
    expect(&controller, &["INFO", "connected", &address]);
    assert!(controller.client().is_closed());
    expect(&controller, &["WARN", "no connection left", "connections=1"]);
    assert!(client.is_closed());
    expect(&controller, &["INFO", &address, "no request for 0.3 s"]);
    let mut client = controller.client();
    client.stream.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
    assert!(client.is_closed());
    expect(&controller, &["WARN", "not Modbus TCP: protocol identifier 21536"]);
    drop(controller.client());
    expect(&controller, &["INFO", "the client closed it"]);
}
