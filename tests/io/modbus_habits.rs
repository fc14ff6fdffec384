//! The habits of real devices: each works with its key, and without the key the trouble names it.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::io::habit_peer::{HabitPeer, SeenRequests};
use crate::io::liars::{BOUND, PATIENT, client, exchange, peer, poll, rtu_client, tcp_link};
use crate::io::line::await_over_a_line;
use rungd_io::device::{Driver, Exchange, ExchangeFailure, ExchangeReason};
use rungd_io::modbus_client::settings::{
    ClientSettings, ConnectionUse, LinkSettings as Way, ModbusPoint, ModbusTable, PeerHabits,
    PointForm, RtuLine, RtuPort, Transaction,
};
use rungd_io::modbus_client::{ModbusClient, PeerLink, RtuLines, RtuLink, TcpConnection};
use tokio::time::timeout;

/// A timeout that expires in tests of silence.
const SHORT: Duration = Duration::from_millis(150);

type SharedSeen = Arc<Mutex<SeenRequests>>;

/// A device, and the settings of a client for it: `input 0..1` of unit 1 read, `coil 0` written.
fn device(habits: HabitPeer) -> (SocketAddr, ClientSettings, SharedSeen) {
    let (address, seen) = habits.start();
    let way = match habits.rtu {
        true => Way::Rtu(RtuLine { port: RtuPort::Tcp(peer(address)), echo: false }),
        false => Way::Tcp(tcp_link(address)),
    };
    (address, client(way), seen)
}

/// A connected client by Modbus TCP.
async fn tcp(settings: &ClientSettings, patience: Duration) -> ModbusClient<TcpConnection> {
    let Way::Tcp(link) = settings.link else { panic!("a device by Modbus TCP") };
    connected(ModbusClient::new(settings, TcpConnection::new(link, settings.habits, patience)))
        .await
}

/// A connected client by Modbus RTU over TCP.
async fn rtu(settings: &ClientSettings, patience: Duration) -> ModbusClient<RtuLink> {
    let Way::Rtu(line) = &settings.link else { panic!("a device by Modbus RTU") };
    let link = RtuLines::default().link(line, settings.habits, patience);
    connected(ModbusClient::new(settings, link)).await
}

async fn connected<L: PeerLink>(mut client: ModbusClient<L>) -> ModbusClient<L> {
    client.connect().await.unwrap();
    client
}

/// Exchanges until it succeeds; returns the troubles before.
async fn well<L: PeerLink>(client: &mut ModbusClient<L>) -> Vec<ExchangeFailure> {
    let mut troubles = Vec::new();
    let until_well = async {
        loop {
            match exchange(client).await {
                Ok(inputs) => return assert_eq!(inputs, [1000, 1001]),
                Err(trouble) if trouble.is_disconnected => {
                    troubles.push(trouble);
                    let _ = client.connect().await;
                }
                Err(trouble) => troubles.push(trouble),
            }
            tokio::task::yield_now().await;
        }
    };
    timeout(BOUND, until_well).await.expect("the device never comes up");
    troubles
}

/// The trouble of the first exchange.
async fn told<L: PeerLink>(client: &mut ModbusClient<L>) -> String {
    exchange(client).await.expect_err("a habit without its key").reason
}

/// Puts the inputs into two requests.
fn apart(settings: &mut ClientSettings) {
    settings.inputs[1].at = 10;
}

/// The result of one exchange with inputs in two requests.
async fn apart_well<L: PeerLink>(client: &mut ModbusClient<L>) -> Result<(), String> {
    let mut inputs = [None; 2];
    let done = timeout(BOUND, client.exchange(poll(&[1], &mut inputs))).await.unwrap();
    done.map_err(|trouble| trouble.reason)?;
    assert_eq!(inputs, [Some(1000), Some(1010)]);
    Ok(())
}

fn requests(seen: &SharedSeen) -> Vec<(u8, Vec<u8>)> {
    std::mem::take(&mut seen.lock().unwrap().requests)
}

#[tokio::test]
async fn requests_lost_after_connecting_are_reported_and_keep_the_connection() {
    for rtu_frames in [false, true] {
        let peer = HabitPeer { lost: 2, rtu: rtu_frames, ..HabitPeer::default() };
        let (_, settings, seen) = device(peer);
        let troubles = match rtu_frames {
            true => well(&mut rtu(&settings, SHORT).await).await,
            false => well(&mut tcp(&settings, SHORT).await).await,
        };
        let first = &troubles[0].reason;
        assert!(first.contains("none since connecting: try `connect-delay`"), "{first}");
        assert!(troubles.iter().all(|trouble| !trouble.is_disconnected), "{troubles:#?}");
        assert_eq!(seen.lock().unwrap().connections, 1);
    }
}

#[tokio::test]
async fn the_connect_delay_precedes_the_first_request_of_each_connection() {
    let habits = PeerHabits { connect_delay_ms: 120, ..PeerHabits::default() };
    for peer in [HabitPeer::default(), HabitPeer { rtu: true, ..HabitPeer::default() }] {
        let (_, mut settings, _) = device(peer);
        settings.habits = habits;
        let begun = Instant::now();
        match peer.rtu {
            true => assert!(well(&mut rtu(&settings, PATIENT).await).await.is_empty()),
            false => assert!(well(&mut tcp(&settings, PATIENT).await).await.is_empty()),
        }
        assert!(begun.elapsed() >= Duration::from_millis(120));
    }
}

#[tokio::test]
async fn a_configured_pause_is_kept_and_the_error_without_it_names_the_key() {
    for rtu_frames in [false, true] {
        let short =
            HabitPeer { rtu: rtu_frames, gap: Duration::from_millis(30), ..Default::default() };
        let (_, mut settings, _) = device(short);
        apart(&mut settings);
        settings.habits.pause_ms = 40;
        for _ in 0..2 {
            let done = match rtu_frames {
                true => apart_well(&mut rtu(&settings, PATIENT).await).await,
                false => apart_well(&mut tcp(&settings, PATIENT).await).await,
            };
            assert_eq!(done, Ok(()));
        }
        let (_, settings, _) = device(HabitPeer { gap: PATIENT, ..short });
        let reason = match rtu_frames {
            true => told(&mut rtu(&settings, SHORT).await).await,
            false => told(&mut tcp(&settings, SHORT).await).await,
        };
        assert!(
            reason.starts_with("reading input 0..1 of unit 1: no answer in 150 ms"),
            "{reason}"
        );
        assert!(reason.contains("try `pause`"), "{reason}");
    }
}

#[tokio::test]
async fn a_limit_of_elements_splits_requests_and_the_error_without_it_names_the_key() {
    for (refusal, words) in [
        (
            2,
            "exception 2 (illegal data address); if it accepts shorter requests, set `max-registers`",
        ),
        (
            3,
            "exception 3 (illegal data value); if it accepts shorter requests, set `max-registers`",
        ),
        (0, "2 bytes of data instead of 4; if it accepts shorter requests, set `max-registers`"),
    ] {
        let (_, mut settings, seen) =
            device(HabitPeer { most: Some(1), refusal, ..HabitPeer::default() });
        let reason = told(&mut tcp(&settings, PATIENT).await).await;
        assert!(reason.ends_with(words), "{reason}");
        settings.habits.registers_max = 1;
        requests(&seen);
        assert!(well(&mut tcp(&settings, PATIENT).await).await.is_empty());
        let reads = [vec![4, 0, 0, 0, 1], vec![4, 0, 1, 0, 1]];
        assert!(requests(&seen).into_iter().map(|(_, pdu)| pdu).skip(1).eq(reads));
    }
    let (_, mut settings, _) =
        device(HabitPeer { most: Some(1), refusal: 2, ..Default::default() });
    for input in &mut settings.inputs {
        (input.table, input.form) = (ModbusTable::DiscreteInputs, PointForm::Bit);
    }
    let reason = told(&mut tcp(&settings, PATIENT).await).await;
    assert!(reason.ends_with("set `max-bits`"), "{reason}");
}

#[tokio::test]
async fn a_limit_splits_writes_and_a_refused_function_names_the_alternative() {
    let (_, mut settings, seen) =
        device(HabitPeer { most: Some(1), refusal: 3, ..Default::default() });
    let coil = settings.outputs[0];
    settings.outputs.push(ModbusPoint { at: 1, ..coil });
    let mut client = tcp(&settings, PATIENT).await;
    let mut inputs = [None; 2];
    let trouble = client.exchange(poll(&[1, 1], &mut inputs)).await.unwrap_err();
    assert!(trouble.reason.ends_with("set `max-bits`"), "{trouble}");
    (settings.habits.bits_max, settings.habits.registers_max) = (1, 1);
    requests(&seen);
    let mut client = tcp(&settings, PATIENT).await;
    client.exchange(poll(&[1, 1], &mut inputs)).await.unwrap();
    let writes = [vec![5, 0, 0, 0xff, 0], vec![5, 0, 1, 0xff, 0]];
    assert!(requests(&seen).into_iter().map(|(_, pdu)| pdu).take(2).eq(writes));
}

#[tokio::test]
async fn wrong_transaction_numbers_are_ignored_if_configured_and_reported_otherwise() {
    let others: [fn(u16) -> u16; 4] = [|_| 0, |n| n.wrapping_add(1), u16::swap_bytes, |n| n - 1];
    for other in others {
        let (_, mut settings, seen) =
            device(HabitPeer { transaction: Some(other), splits: true, ..Default::default() });
        let reason = told(&mut tcp(&settings, PATIENT).await).await;
        assert!(reason.contains("different question (transaction)"), "{reason}");
        assert!(reason.contains("set `transaction = \"ignore\"`"), "{reason}");
        let Way::Tcp(link) = &mut settings.link else { unreachable!() };
        link.transaction = Transaction::Ignore;
        seen.lock().unwrap().connections = 0;
        let mut client = tcp(&settings, PATIENT).await;
        for _ in 0..5 {
            assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
        }
        assert_eq!(seen.lock().unwrap().connections, 1);
    }
}

/// Without transactions, only a new connection is free of late answers.
#[tokio::test]
async fn a_silence_ends_a_connection_with_ignored_transaction_numbers() {
    let (_, mut settings, seen) = device(HabitPeer { lost: 1, ..HabitPeer::default() });
    let Way::Tcp(link) = &mut settings.link else { unreachable!() };
    link.transaction = Transaction::Ignore;
    let mut client = tcp(&settings, SHORT).await;
    for connections in 1..3 {
        let trouble = exchange(&mut client).await.unwrap_err();
        assert!(trouble.is_disconnected && trouble.reason.contains("`connect-delay`"), "{trouble}");
        assert_eq!(seen.lock().unwrap().connections, connections);
        client.connect().await.unwrap();
    }
}

#[tokio::test]
async fn one_request_per_connection_is_possible_and_the_error_without_it_names_the_key() {
    for rtu_frames in [false, true] {
        let (_, mut settings, seen) =
            device(HabitPeer { closes: true, rtu: rtu_frames, ..HabitPeer::default() });
        apart(&mut settings);
        let reason = match rtu_frames {
            true => apart_well(&mut rtu(&settings, PATIENT).await).await,
            false => apart_well(&mut tcp(&settings, PATIENT).await).await,
        };
        let reason = reason.unwrap_err();
        assert!(reason.contains("set `connection = \"per-request\"`"), "{reason}");
        match &mut settings.link {
            Way::Tcp(link) => link.peer.connection = ConnectionUse::PerRequest,
            Way::Rtu(RtuLine { port: RtuPort::Tcp(peer), .. }) => {
                peer.connection = ConnectionUse::PerRequest;
            }
            Way::Rtu(_) => unreachable!(),
        }
        seen.lock().unwrap().connections = 0;
        match rtu_frames {
            true => {
                let mut client = rtu(&settings, PATIENT).await;
                assert_eq!(apart_well(&mut client).await, Ok(()));
                assert_eq!(apart_well(&mut client).await, Ok(()));
            }
            false => {
                let mut client = tcp(&settings, PATIENT).await;
                assert_eq!(apart_well(&mut client).await, Ok(()));
                assert_eq!(apart_well(&mut client).await, Ok(()));
            }
        }
        assert_eq!(seen.lock().unwrap().connections, 5, "a write, and twice two reads");
    }
}

#[tokio::test]
async fn rtu_frames_over_tcp_work_in_parts_and_after_a_closed_connection() {
    let (_, settings, seen) = device(HabitPeer { rtu: true, splits: true, ..Default::default() });
    let mut client = rtu(&settings, PATIENT).await;
    assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
    let expected = [(1, vec![5, 0, 0, 0xff, 0]), (1, vec![4, 0, 0, 0, 2])];
    assert_eq!(requests(&seen), expected);
    // A device that closes an idle connection costs no exchange.
    let (_, mut settings, _) = device(HabitPeer { rtu: true, closes: true, ..Default::default() });
    settings.outputs.clear();
    let mut client = rtu(&settings, PATIENT).await;
    for _ in 0..3 {
        let mut inputs = [None; 2];
        client.exchange(poll(&[], &mut inputs)).await.unwrap();
        assert_eq!(inputs, [Some(1000), Some(1001)]);
    }
}

/// Serial servers send the bytes of a frame in several packets, with gaps that no line would have.
#[tokio::test]
async fn a_gap_within_a_frame_is_tolerated_up_to_the_timeout() {
    for rtu_frames in [false, true] {
        let gap = |split_gap| HabitPeer {
            rtu: rtu_frames,
            splits: true,
            split_gap,
            ..Default::default()
        };
        let (_, settings, seen) = device(gap(Duration::from_millis(80)));
        match rtu_frames {
            true => assert!(well(&mut rtu(&settings, PATIENT).await).await.is_empty()),
            false => assert!(well(&mut tcp(&settings, PATIENT).await).await.is_empty()),
        }
        assert_eq!(requests(&seen).len(), 2, "a write and a read, each asked once");
        let (_, settings, _) = device(gap(PATIENT));
        let reason = match rtu_frames {
            true => told(&mut rtu(&settings, SHORT).await).await,
            false => told(&mut tcp(&settings, SHORT).await).await,
        };
        assert!(
            reason.ends_with("; if the rest was only late, set a longer `timeout`"),
            "{reason}"
        );
    }
}

#[tokio::test]
async fn two_devices_behind_a_serial_server_share_its_connection() {
    let (_, settings, seen) = device(HabitPeer { rtu: true, ..HabitPeer::default() });
    let Way::Rtu(line) = &settings.link else { unreachable!() };
    let mut lines = RtuLines::default();
    for _ in 0..2 {
        let link = lines.link(line, settings.habits, PATIENT);
        let mut client = connected(ModbusClient::new(&settings, link)).await;
        assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
    }
    assert_eq!(seen.lock().unwrap().connections, 1);
}

#[tokio::test]
async fn wrong_framing_and_a_wrong_unit_are_reported_with_the_right_setting() {
    // The first bytes of a request by Modbus TCP are not whole to a device with RTU's frames.
    let (address, settings, _) = device(HabitPeer { rtu: true, lost: 9, ..HabitPeer::default() });
    let by_tcp = ClientSettings { link: Way::Tcp(tcp_link(address)), ..settings };
    let reason = told(&mut tcp(&by_tcp, SHORT).await).await;
    assert!(reason.contains("`driver = \"modbus-rtu\"` with `port = \"tcp://…\"`"), "{reason}");
    let (_, settings, _) = device(HabitPeer { unit: Some(0), ..HabitPeer::default() });
    let reason = told(&mut tcp(&settings, PATIENT).await).await;
    assert!(reason.ends_with("the answer is unit 0's, not unit 1's: try `unit = 0`"), "{reason}");
    let (_, settings, _) = device(HabitPeer { rtu: true, unit: Some(9), ..Default::default() });
    let reason = told(&mut rtu(&settings, SHORT).await).await;
    assert!(reason.ends_with("the answer is unit 9's, not unit 1's: try `unit = 9`"), "{reason}");
}

#[tokio::test]
async fn a_broadcast_is_written_without_waiting_for_an_answer() {
    let (_, mut settings, seen) = device(HabitPeer { rtu: true, ..HabitPeer::default() });
    settings.outputs[0].unit = 0;
    settings.habits.broadcast_delay_ms = 30;
    let mut client = rtu(&settings, PATIENT).await;
    let begun = Instant::now();
    assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
    assert!(begun.elapsed() >= Duration::from_millis(30), "the units need the time");
    let expected = [(0, vec![5, 0, 0, 0xff, 0]), (1, vec![4, 0, 0, 0, 2])];
    assert_eq!(requests(&seen), expected);
    let last = Exchange { occasion: ExchangeReason::Last, ..poll(&[0], &mut []) };
    assert!(client.exchange(last).await.is_ok());
    let off = Instant::now();
    while seen.lock().unwrap().requests.is_empty() && off.elapsed() < BOUND {
        tokio::task::yield_now().await;
    }
    assert_eq!(requests(&seen), [(0, vec![5, 0, 0, 0, 0])], "safe values are broadcast, too");
}

#[test]
fn a_request_follows_a_broadcast_on_a_serial_line() {
    await_over_a_line(async || {
        let script = crate::io::liars::honest();
        let asked = Arc::new(Mutex::new(Vec::new()));
        let told = Arc::clone(&asked);
        crate::io::liars::lie(&script, move |request, _| {
            told.lock().unwrap().push(request.to_vec());
            crate::io::liars::Lie::Silence
        });
        let broadcast = |settings: &mut ClientSettings| {
            settings.outputs[0].unit = 0;
            settings.habits.broadcast_delay_ms = 20;
        };
        let mut client = rtu_client(script, false, PATIENT, broadcast).await;
        assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
        assert_eq!(asked.lock().unwrap()[0][..2], [0, 5]);
    });
}

#[tokio::test]
async fn all_peer_habits_work_together() {
    let all = HabitPeer {
        rtu: true,
        lost: 1,
        gap: Duration::from_millis(10),
        most: Some(1),
        refusal: 3,
        splits: true,
        ..HabitPeer::default()
    };
    let habits =
        PeerHabits { pause_ms: 20, registers_max: 1, bits_max: 1, ..PeerHabits::default() };
    let (_, mut settings, _) = device(all);
    settings.habits = habits;
    well(&mut rtu(&settings, SHORT * 3).await).await;
    let by_tcp =
        HabitPeer { rtu: false, lost: 0, closes: true, transaction: Some(u16::swap_bytes), ..all };
    let (_, mut settings, _) = device(by_tcp);
    settings.habits = PeerHabits { connect_delay_ms: 5, ..habits };
    let Way::Tcp(link) = &mut settings.link else { unreachable!() };
    link.transaction = Transaction::Ignore;
    link.peer.connection = ConnectionUse::PerRequest;
    assert!(well(&mut tcp(&settings, PATIENT).await).await.is_empty());
}
