//! The Modbus client's outputs wait neither for slow inputs nor for inputs that a unit refuses.

use rungd_test_support::running::process;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::io::liars::{Lie, PATIENT, Script, client, listen, poll, tcp_frame, tcp_link, tcp_to};
use rungd_io::device::{Driver, Exchange, ExchangeExtent, ExchangeReason};
use rungd_io::modbus_client::settings::{ClientSettings as Settings, LinkSettings, Watchdog};
use rungd_io::modbus_client::{ModbusClient, TcpConnection};

type Seen = Arc<Mutex<Vec<Vec<u8>>>>;

/// A client whose peer records its requests and reacts by `lie`.
async fn seen(
    settings: impl FnOnce(&mut Settings),
    lie: fn(&[u8]) -> Lie,
) -> (ModbusClient<TcpConnection>, Seen) {
    let script = Script::default();
    let seen = Seen::default();
    for _ in 0..100 {
        let seen = Arc::clone(&seen);
        script.lock().unwrap().push(Box::new(move |request, _| {
            seen.lock().unwrap().push(request[7..].to_vec());
            lie(request)
        }));
    }
    let address = listen(&script);
    let mut wanted = client(LinkSettings::Tcp(tcp_link(address)));
    settings(&mut wanted);
    let mut client = ModbusClient::new(&wanted, tcp_to(address, PATIENT));
    client.connect().await.unwrap();
    (client, seen)
}

/// The functions and addresses of the requests since the last call.
fn asked(seen: &Seen) -> Vec<(u8, u8)> {
    let seen = std::mem::take(&mut *seen.lock().unwrap());
    seen.into_iter().map(|pdu| (pdu[0], pdu[2])).collect()
}

/// Spreads the inputs over four requests instead of one.
fn apart(settings: &mut Settings) {
    let input = settings.inputs[0];
    settings.inputs = (0..4)
        .map(|n| rungd_io::modbus_client::settings::ModbusPoint { at: n * 10, ..input })
        .collect();
}

fn urgent<'a>(outputs: &'a [i32], inputs: &'a mut [Option<i32>]) -> Exchange<'a> {
    Exchange { is_urgent: &|| true, ..poll(outputs, inputs) }
}

#[tokio::test]
async fn urgent_outputs_interrupt_reads_which_then_continue() {
    let (mut client, seen) = seen(apart, |_| Lie::None).await;
    let mut inputs = [None; 4];
    assert_eq!(client.exchange(urgent(&[1], &mut inputs)).await, Ok(ExchangeExtent::Part));
    assert_eq!(asked(&seen), [(5, 0), (4, 0)]);
    assert_eq!(client.exchange(urgent(&[0], &mut inputs)).await, Ok(ExchangeExtent::Part));
    assert_eq!(asked(&seen), [(5, 0), (4, 10)]);
    let change = Exchange { occasion: ExchangeReason::Change, ..urgent(&[1], &mut inputs) };
    assert_eq!(client.exchange(change).await, Ok(ExchangeExtent::Whole));
    assert_eq!(asked(&seen), [(5, 0)]);
    assert_eq!(client.exchange(poll(&[1], &mut inputs)).await, Ok(ExchangeExtent::Whole));
    assert_eq!(asked(&seen), [(4, 20), (4, 30)]);
    assert_eq!(inputs, [1000, 1010, 1020, 1030].map(Some));
    // The reads start from the first input again.
    assert_eq!(client.exchange(urgent(&[1], &mut inputs)).await, Ok(ExchangeExtent::Part));
    assert_eq!(asked(&seen), [(4, 0)]);
    // After a new connection, all writes and reads start again.
    client.connect().await.unwrap();
    assert_eq!(client.exchange(poll(&[1], &mut inputs)).await, Ok(ExchangeExtent::Whole));
    assert_eq!(asked(&seen), [(5, 0), (4, 0), (4, 10), (4, 20), (4, 30)]);
}

#[tokio::test]
async fn an_error_in_a_part_fails_the_whole_exchange() {
    let refuses_one = |request: &[u8]| match request[7..10] {
        [4, 0, 0] => Lie::Say(tcp_frame(request, &[0x84, 2])),
        _ => Lie::None,
    };
    let (mut client, _seen) = seen(apart, refuses_one).await;
    let mut inputs = [None; 4];
    for _ in 0..3 {
        assert_eq!(client.exchange(urgent(&[1], &mut inputs)).await, Ok(ExchangeExtent::Part));
    }
    let trouble = client.exchange(urgent(&[1], &mut inputs)).await.unwrap_err();
    assert_eq!(trouble.reason, "reading input 0 of unit 1: exception 2 (illegal data address)");
}

#[tokio::test]
async fn a_refused_write_does_not_end_an_exchange_with_pending_reads() {
    let refuses_writes = |request: &[u8]| match request[7] {
        5 => Lie::Say(tcp_frame(request, &[0x85, 6])),
        _ => Lie::None,
    };
    let (mut client, _seen) = seen(apart, refuses_writes).await;
    let mut inputs = [None; 4];
    for _ in 0..3 {
        assert_eq!(client.exchange(urgent(&[1], &mut inputs)).await, Ok(ExchangeExtent::Part));
    }
    let trouble = client.exchange(urgent(&[1], &mut inputs)).await.unwrap_err();
    assert_eq!(trouble.reason, "writing coil 0 of unit 1: exception 6 (device busy)");
    assert_eq!(
        inputs,
        [1000, 1010, 1020, 1030].map(Some),
        "all of one exchange, handed on together"
    );
}

#[tokio::test]
async fn a_unit_that_refuses_a_read_receives_changes_at_once() {
    let refuses_reads = |request: &[u8]| match request[7] {
        4 => Lie::Say(tcp_frame(request, &[0x84, 2])),
        _ => Lie::None,
    };
    let (mut client, seen) = seen(|_| {}, refuses_reads).await;
    let mut inputs = [None; 2];
    assert!(client.exchange(poll(&[0], &mut inputs)).await.is_err());
    asked(&seen);
    for on in [1, 0, 1] {
        let change = Exchange { occasion: ExchangeReason::Change, ..poll(&[0], &mut inputs) };
        let on = [on];
        let change = Exchange { outputs: &on, ..change };
        assert_eq!(client.exchange(change).await, Ok(ExchangeExtent::Whole));
        assert_eq!(asked(&seen), [(5, 0)]);
    }
    assert!(client.exchange(poll(&[1], &mut inputs)).await.is_err(), "inputs are missing still");
}

#[tokio::test]
async fn a_unit_that_refuses_a_write_gets_no_request_before_the_next_poll() {
    let refuses_writes = |request: &[u8]| match request[7] {
        5 => Lie::Say(tcp_frame(request, &[0x85, 6])),
        _ => Lie::None,
    };
    let (mut client, seen) = seen(|_| {}, refuses_writes).await;
    let mut inputs = [None; 2];
    assert!(client.exchange(poll(&[0], &mut inputs)).await.is_err());
    asked(&seen);
    let change = Exchange { occasion: ExchangeReason::Change, ..poll(&[1], &mut inputs) };
    assert!(client.exchange(change).await.is_err());
    assert_eq!(asked(&seen), []);
}

#[tokio::test]
async fn a_watchdog_is_fed_between_two_reads() {
    static READS: AtomicU32 = AtomicU32::new(0);
    let slow = |request: &[u8]| match request[7] {
        4 if READS.fetch_add(1, Ordering::Relaxed) < 3 => Lie::After(Duration::from_millis(60)),
        _ => Lie::None,
    };
    let settings = |settings: &mut Settings| {
        apart(settings);
        settings.watchdog = Some(Watchdog { unit: 1, register: 99, every_ms: 50 });
    };
    let (mut client, seen) = seen(settings, slow).await;
    let mut inputs = [None; 4];
    assert_eq!(client.exchange(poll(&[1], &mut inputs)).await, Ok(ExchangeExtent::Part));
    // After the first feeding, the client writes the coil again.
    assert_eq!(asked(&seen), [(5, 0), (6, 99), (5, 0), (4, 0)]);
    assert_eq!(client.exchange(poll(&[1], &mut inputs)).await, Ok(ExchangeExtent::Part));
    assert_eq!(asked(&seen)[0], (6, 99));
}

/// The last value that the binary writes to the coil. The binary ends while its peer reacts to
/// every read by `lie`. `OUT Y0` is ON while the binary scans.
fn last_coil_behind(lie: impl Fn() -> Lie + Clone + Send + 'static) -> Option<u8> {
    let script = Script::default();
    let coils = Seen::default();
    for _ in 0..10_000 {
        let (coils, lie) = (Arc::clone(&coils), lie.clone());
        script.lock().unwrap().push(Box::new(move |request, _| match request[7] {
            5 => {
                coils.lock().unwrap().push(request[10..11].to_vec());
                Lie::None
            }
            _ => lie(),
        }));
    }
    let address = listen(&script);
    let rows: String =
        (0..40).map(|n| format!("{{ from = \"input {}\", to = \"D{n}\" }}, ", n * 2)).collect();
    let device = format!(
        "[[device]]\nname = \"slow\"\ndriver = \"modbus-tcp\"\naddress = \"{address}\"\n\
         loss-after = \"100ms\"\nmap = [{{ from = \"Y0\", to = \"coil 0\" }}, {rows}]\n"
    );
    let ladder = "[[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = [\"$On\"]\n\
                  do = [\"OUT Y0\"]\n";
    let plant = process::Plant::new(ladder, &device);
    let mut rungd = process::Running::new(&mut plant.command::<&str>(&[]));
    let deadline = Instant::now() + process::PATIENCE;
    while coils.lock().unwrap().last() != Some(&vec![0xff]) {
        assert!(Instant::now() < deadline, "the coil is never ON");
        std::thread::sleep(Duration::from_millis(5));
    }
    // The binary ends in the middle of its peer's lies.
    std::thread::sleep(Duration::from_millis(400));
    rungd.stop();
    coils.lock().unwrap().last().map(|value| value[0])
}

#[test]
fn a_shutdown_makes_the_outputs_of_a_slow_peer_safe() {
    let coil = last_coil_behind(|| Lie::After(Duration::from_millis(150)));
    assert_eq!(coil, Some(0));
}

#[test]
fn a_shutdown_makes_outputs_safe_if_the_peer_answers_no_read() {
    let coil = last_coil_behind(|| Lie::Silence);
    assert_eq!(coil, Some(0));
}

#[test]
fn a_shutdown_makes_outputs_safe_if_the_peer_closes_connections_on_reads() {
    let coil = last_coil_behind(|| Lie::Leave(Vec::new()));
    assert_eq!(coil, Some(0));
}
