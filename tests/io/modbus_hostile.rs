//! Invalid and excessive requests: the real program with hostile clients.
//!
//! Every connection is answered or closed, the next client is served at once, and no scan is
//! missed. With `-- --nocapture` the tests print the time until the next client was served; their
//! bounds leave room for a busy machine.

use rungd_test_support::modbus;
use rungd_test_support::running::process;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use rungd_test_support::metronome::Stopwatch;
use rungd_test_support::modbus::{Client, served_within};
use rungd_test_support::running::process::{BLINKS, Plant, Running, find, no_scan_missed};

const PERIOD: Duration = Duration::from_millis(2);

/// A controller with a Modbus server on a free port, and its address.
fn start(settings: &str, prefix: &[&str]) -> (Plant, Running, String) {
    let controller =
        format!("scan.period = \"2ms\"\n[modbus-server]\nlisten = \"127.0.0.1:0\"\n{settings}\n");
    let plant = Plant::new(BLINKS, &controller);
    let running = Running::new(&mut plant.command(prefix));
    let line = running.line("Modbus server listens");
    let address = line["address"].as_str().unwrap().to_owned();
    running.line("RUN: scanning");
    (plant, running, address)
}

/// Stops the controller, checks that no scan was missed, and prints how late scans were.
fn ended(running: &mut Running) {
    let lines = running.stop();
    no_scan_missed(&lines, PERIOD, PERIOD);
    let whole = find(&lines, "scan statistics of the whole run");
    let [scans, skipped, late] = ["scans", "skipped", "late_us_p99"].map(|field| &whole[field]);
    println!("  {scans} scans, {skipped} skipped, p99 of lateness {late} us");
}

/// All bytes that the server sends before it closes the connection or becomes silent.
fn all_replies(stream: &mut TcpStream) -> Vec<u8> {
    stream.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
    let mut bytes = Vec::new();
    let _ = stream.read_to_end(&mut bytes);
    bytes
}

const READ: [u8; 12] = [0, 7, 0, 0, 0, 6, 1, 3, 0, 0, 0, 1];
const REPLY: [u8; 11] = [0, 7, 0, 0, 0, 5, 1, 3, 2, 0, 0];

#[test]
fn frames_with_a_false_length_are_never_answered_wrongly() {
    let (_plant, mut running, address) = start("frame-timeout = \"200ms\"", &[]);
    let mut slowest = Duration::ZERO;
    for length in (0..=300).chain([1000, 0x7fff, 0x8000, 0xff00, 0xffff]) {
        let mut bytes = READ.to_vec();
        bytes[4..6].copy_from_slice(&(length as u16).to_be_bytes());
        let mut client = TcpStream::connect(&address).unwrap();
        client.write_all(&bytes).unwrap();
        client.shutdown(Shutdown::Write).unwrap();
        let reply = all_replies(&mut client);
        match length {
            6 => assert_eq!(reply, REPLY),
            // A smaller length makes a malformed request of that many bytes; the bytes after it are
            // not a frame.
            2..=5 => assert_eq!(reply, [0, 7, 0, 0, 0, 3, 1, 0x83, 3], "{length}"),
            _ => assert!(reply.is_empty(), "{length}: {reply:?}"),
        }
        slowest = slowest.max(served_within(&address));
    }
    println!("lengths that lie: the next client served within {slowest:?}");
    ended(&mut running);
}

#[test]
fn connections_with_another_protocol_are_closed_at_once() {
    let (_plant, mut running, address) = start("", &[]);
    for protocol in [1_u16, 0x00ff, 0x0100, 0x5420, 0xffff] {
        let mut bytes = READ.to_vec();
        bytes[2..4].copy_from_slice(&protocol.to_be_bytes());
        let mut client = TcpStream::connect(&address).unwrap();
        client.write_all(&bytes).unwrap();
        assert!(all_replies(&mut client).is_empty(), "{protocol}");
        // The first bytes are enough: the server does not wait for the rest.
        let watch = Stopwatch::start(running.child.id());
        let mut client = TcpStream::connect(&address).unwrap();
        client.write_all(&bytes[..4]).unwrap();
        client.set_read_timeout(Some(process::PATIENCE)).unwrap();
        assert!(matches!(client.read(&mut [0; 1]), Ok(0) | Err(_)));
        assert!(watch.elapsed() < Duration::from_secs(2));
    }
    println!("other protocols: the next client served within {:?}", served_within(&address));
    ended(&mut running);
}

#[test]
fn split_and_joined_frames_are_answered_in_order() {
    let settings = "writable = [\"MHR1..MHR9\", \"MC1..MC9\"]";
    let (_plant, mut running, address) = start(settings, &[]);
    let requests: [&[u8]; 6] = [
        &[3, 0, 0, 0, 2],
        &[16, 0, 0, 0, 2, 4, 0, 7, 0, 8],
        &[22, 0, 0, 0, 0, 0, 9],
        &[23, 0, 0, 0, 2, 0, 1, 0, 1, 2, 0, 5],
        &[15, 0, 0, 0, 3, 1, 7],
        &[99],
    ];
    let replies: [&[u8]; 6] = [
        &[3, 4, 0, 9, 0, 5],
        &[16, 0, 0, 0, 2],
        &[22, 0, 0, 0, 0, 0, 9],
        &[23, 4, 0, 9, 0, 5],
        &[15, 0, 0, 0, 3],
        &[0xe3, 1],
    ];
    let mut client = Client::connect(&address);
    requests[1..].iter().for_each(|pdu| drop(client.ask(1, pdu)));
    let glued: Vec<u8> = requests.iter().flat_map(|pdu| modbus::frame(7, 1, pdu)).collect();
    let expected: Vec<u8> = replies.iter().flat_map(|pdu| modbus::frame(7, 1, pdu)).collect();
    for at in 0..=glued.len() {
        let mut stream = TcpStream::connect(&address).unwrap();
        stream.set_nodelay(true).unwrap();
        stream.set_read_timeout(Some(process::PATIENCE)).unwrap();
        stream.write_all(&glued[..at]).unwrap();
        std::thread::sleep(Duration::from_millis(2));
        stream.write_all(&glued[at..]).unwrap();
        let mut reply = vec![0; expected.len()];
        stream.read_exact(&mut reply).unwrap();
        assert_eq!(reply, expected, "split at {at}");
    }
    let mut stream = TcpStream::connect(&address).unwrap();
    stream.set_read_timeout(Some(process::PATIENCE)).unwrap();
    for byte in &glued {
        stream.write_all(&[*byte]).unwrap();
    }
    let mut reply = vec![0; expected.len()];
    stream.read_exact(&mut reply).unwrap();
    assert_eq!(reply, expected, "byte by byte");
    ended(&mut running);
}

/// Connects `count` clients, one after another. Each sends these bytes and then nothing.
fn crowd(address: &str, count: usize, bytes: &[u8]) -> Vec<TcpStream> {
    let client = |_| {
        let mut stream = TcpStream::connect(address).unwrap();
        let _ = stream.write_all(bytes);
        stream
    };
    (0..count).map(client).collect()
}

#[test]
fn a_thousand_connections_do_not_block_a_new_client() {
    let (_plant, mut running, address) = start("connections = 8", &[]);
    let mut panel = Client::connect(&address);
    panel.ask(1, &[3, 0, 0, 0, 1]);
    let mut slowest = Duration::ZERO;
    // Silent clients, and slow clients that have begun a frame.
    for bytes in [&[][..], &READ[..9]] {
        let clients = crowd(&address, 1000, bytes);
        for _ in 0..20 {
            slowest = slowest.max(served_within(&address));
            assert_eq!(panel.ask(1, &[3, 0, 0, 0, 1]), [3, 2, 0, 0], "the panel keeps its place");
        }
        drop(clients);
    }
    println!("a thousand connections: the next client served within {slowest:?}");
    ended(&mut running);
}

#[test]
fn a_client_that_sends_byte_by_byte_is_closed_and_others_are_served() {
    let settings = "connections = 4\nframe-timeout = \"300ms\"";
    let (_plant, mut running, address) = start(settings, &[]);
    let mut panel = Client::connect(&address);
    panel.ask(1, &[3, 0, 0, 0, 1]);
    let (mut loris, began) = (TcpStream::connect(&address).unwrap(), Instant::now());
    loris.set_nodelay(true).unwrap();
    // The slow client is served once, so it keeps its place; then it sends a byte now and then.
    loris.write_all(&READ).unwrap();
    loris.read_exact(&mut [0; 11]).unwrap();
    let mut slowest = Duration::ZERO;
    for byte in READ.iter().cycle() {
        if loris.write_all(&[*byte]).is_err() {
            break;
        }
        slowest = slowest.max(served_within(&address));
        assert_eq!(panel.ask(1, &[3, 0, 0, 0, 1]), [3, 2, 0, 0]);
        std::thread::sleep(Duration::from_millis(30));
        assert!(began.elapsed() < process::PATIENCE, "it is never closed");
    }
    println!("a slow client: the next client served within {slowest:?}");
    ended(&mut running);
}

#[test]
fn open_connections_are_served_when_descriptors_run_out() {
    let (_plant, mut running, address) =
        start("connections = 1024", &["prlimit", "--nofile=64:64"]);
    let mut panel = Client::connect(&address);
    panel.ask(1, &[3, 0, 0, 0, 1]);
    // Fewer clients than the system's queue of waiting connections holds.
    let clients = crowd(&address, 120, &[]);
    running.line("cannot accept a client");
    let mut slowest = Duration::ZERO;
    for _ in 0..20 {
        assert_eq!(panel.ask(1, &[3, 0, 0, 0, 1]), [3, 2, 0, 0]);
        slowest = slowest.max(served_within(&address));
    }
    drop(clients);
    println!("no descriptors: the next client served within {slowest:?}");
    ended(&mut running);
}

/// Measures how late scans are, in turns with and without many hostile clients.
#[test]
#[ignore = "half a minute, alone on the machine; run with --release"]
fn print_the_lateness_of_scans_with_and_without_hostile_clients() {
    const TURN: Duration = Duration::from_secs(4);
    // The settings of a punctual controller; without the right to use them, it runs like any other.
    const SETTINGS: &str = "connections = 64\n[realtime]\npolicy = \"fifo\"\npriority = 80";
    for turn in 1..=3 {
        let (_plant, mut running, _) = start(SETTINGS, &[]);
        std::thread::sleep(TURN);
        println!("turn {turn}, no clients:");
        ended(&mut running);
        let (_plant, mut running, address) = start(SETTINGS, &[]);
        let (began, mut slowest, mut connections) = (Instant::now(), Duration::ZERO, 0);
        while began.elapsed() < TURN {
            let silent = crowd(&address, 1000, &[]);
            let slow = crowd(&address, 1000, &READ[..9]);
            let wrong = crowd(&address, 1000, b"GET / HTTP/1.1\r\n\r\n");
            slowest = slowest.max(served_within(&address));
            connections += silent.len() + slow.len() + wrong.len();
        }
        println!("turn {turn}, {connections} hostile; the next served within {slowest:?}:");
        ended(&mut running);
    }
}
