//! No file descriptors are left: clients hold them all, or the limit was lowered. No scan is
//! missed, no thread spins, and later clients are served again.

use rungd_test_support::running::process;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::net::UnixStream;
use std::process::Command;
use std::time::{Duration, Instant};

use rungd_test_support::running::process::{
    BLINKS, Plant, Running, no_scan_missed, processor_time,
};

const PERIOD: Duration = Duration::from_millis(2);

/// A controller with a Modbus server for more clients than there are descriptors.
fn plant() -> (Plant, String) {
    let listen = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let controller = format!(
        "scan.period = \"2ms\"\n[modbus-server]\nlisten = \"{listen}\"\nconnections = 1024\n\
         image.outputs = {{ from = \"Y0..Y7\", to = \"MI1..MI8\" }}\n"
    );
    (Plant::new(BLINKS, &controller), listen)
}

/// Whether a new client is answered within the time.
fn is_served(listen: &str, within: Duration) -> bool {
    let Ok(mut client) = TcpStream::connect(listen) else { return false };
    client.set_read_timeout(Some(within)).unwrap();
    let request = [0, 7, 0, 0, 0, 6, 1, 2, 0, 0, 0, 8];
    let mut reply = [0; 10];
    client.write_all(&request).is_ok()
        && client.read_exact(&mut reply).is_ok()
        && reply[..9] == [0, 7, 0, 0, 0, 4, 1, 2, 1]
}

/// Waits until a new client is served again.
fn served_again(listen: &str) {
    let since = Instant::now();
    while !is_served(listen, Duration::from_secs(2)) {
        assert!(since.elapsed() < process::PATIENCE, "nobody is served any more");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Lets the controller run without descriptors, and checks that it does not spin.
fn lack(running: &Running) {
    let (before, since) = (processor_time(running.child.id()), Instant::now());
    std::thread::sleep(Duration::from_millis(1500));
    let busy = (processor_time(running.child.id()) - before) / since.elapsed().as_secs_f64();
    // The limit allows for a debug build that scans every 2 ms meanwhile.
    assert!(busy < 0.6, "{busy} of a processor");
}

#[test]
fn new_clients_are_served_after_clients_used_up_all_descriptors() {
    let (plant, listen) = plant();
    let mut running = Running::new(&mut plant.command(&["prlimit", "--nofile=64:64"]));
    running.line("RUN: scanning");
    // No more clients than the backlog of the socket: a further client would try again only after
    // seconds.
    let clients: Vec<_> = (0..120).map(|_| TcpStream::connect(&listen).unwrap()).collect();
    running.line("cannot accept a client");
    lack(&running);
    assert!(is_served(&listen, Duration::from_secs(2)), "who has asked nothing gives way");
    drop(clients);
    served_again(&listen);
    no_scan_missed(&running.stop(), PERIOD, Duration::from_millis(1500));
}

#[test]
fn operators_are_served_after_operators_used_up_all_descriptors() {
    let controller = "scan.period = \"2ms\"\noperator.socket = \"rungd.sock\"\n";
    let plant = Plant::new(BLINKS, controller);
    let socket = plant.0.join("rungd.sock");
    let mut running = Running::new(&mut plant.command(&["prlimit", "--nofile=48:48"]));
    running.line("RUN: scanning");
    let status = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
        let output = command.arg("status").arg("--socket").arg(&socket).output().unwrap();
        output.status.success()
    };
    assert!(status());
    let clients: Vec<_> = (0..60).map(|_| UnixStream::connect(&socket).unwrap()).collect();
    running.line("accepts no client");
    lack(&running);
    drop(clients);
    let since = Instant::now();
    while !status() {
        assert!(since.elapsed() < process::PATIENCE, "no operator is served any more");
    }
    no_scan_missed(&running.stop(), PERIOD, Duration::from_millis(1500));
}

#[test]
fn clients_are_served_after_the_descriptor_limit_was_lowered_and_raised() {
    let (plant, listen) = plant();
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN: scanning");
    assert!(is_served(&listen, Duration::from_secs(2)));
    let limit = |soft: &str| {
        let pid = format!("--pid={}", running.pid());
        let done = Command::new("prlimit").arg(pid).arg(format!("--nofile={soft}:")).status();
        assert!(done.unwrap().success());
    };
    limit("3");
    let waiting = TcpStream::connect(&listen).unwrap();
    running.line("cannot accept a client");
    lack(&running);
    limit("256");
    drop(waiting);
    served_again(&listen);
    no_scan_missed(&running.stop(), PERIOD, Duration::from_millis(1500));
}
