//! Modbus clients with peers that lie: every lie results in trouble with a reason, in bounded time,
//! and the next good exchange succeeds.

use crate::io::liars;
use rungd_test_support::patience::PATIENCE;
use rungd_test_support::running::process;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::io::liars::{
    Answer, Lie, PATIENT, Script, TIMEOUT, client, exchange, honest, lie, listen, patience, poll,
    recovers, tcp_frame, tcp_link, tcp_to, with,
};
use proptest::test_runner::TestRunner;
use rungd_io::device::{Driver, ExchangeFailure};
use rungd_io::modbus_client::settings::LinkSettings;
use rungd_io::modbus_client::{ModbusClient, TcpConnection};
use tokio::time::timeout;

fn exception(request: &[u8], code: u8) -> Lie {
    Lie::Say(tcp_frame(request, &[request[7] | 0x80, code]))
}

/// A part of the client's reason, the peer's reaction to a read, and whether the connection is
/// kept.
const TCP_LIES: [(&str, Answer, bool); 22] = [
    ("exception 1 (illegal function)", |ask, _| exception(ask, 1), true),
    ("exception 2 (illegal data address)", |ask, _| exception(ask, 2), true),
    ("exception 6 (device busy)", |ask, _| exception(ask, 6), true),
    ("exception 11 (the gateway's device does not answer)", |ask, _| exception(ask, 11), true),
    ("exception 0, which Modbus does not have", |ask, _| exception(ask, 0), true),
    (
        "to a different question",
        |_, right| Lie::Say(with(right, 1, right[1].wrapping_sub(1))),
        false,
    ),
    ("protocol identifier 1", |_, right| Lie::Say(with(right, 3, 1)), false),
    ("length 0, not 2 to 254", |_, right| Lie::Say(with(right, 5, 0)), false),
    ("length 1, not 2 to 254", |_, right| Lie::Say(with(right, 5, 1)), false),
    ("length 65280, not 2 to 254", |_, _| Lie::Say(vec![0, 1, 0, 0, 0xff, 0]), false),
    ("no whole answer in 400 ms", |_, right| Lie::Say(with(right, 5, 100)), false),
    ("unit 7's, not unit 1's", |_, right| Lie::Say(with(right, 6, 7)), false),
    ("of function 3", |_, right| Lie::Say(with(right, 7, 3)), false),
    ("2 bytes of data instead of 4", |ask, _| Lie::Say(tcp_frame(ask, &[4, 2, 0, 1])), false),
    ("has a wrong length", |ask, _| Lie::Say(tcp_frame(ask, &[4, 4, 0, 1])), false),
    ("not Modbus TCP", |_, _| Lie::Say(b"HTTP/1.1 400 Bad Request".to_vec()), false),
    ("more bytes after", |_, right| Lie::Say([right, right].concat()), false),
    ("no answer in 400 ms", |_, _| Lie::Silence, true),
    ("no answer in 400 ms", |_, _| Lie::After(TIMEOUT * 3 / 2), true),
    ("no whole answer in 400 ms", |ask, _| Lie::Trickle(tcp_frame(ask, &[4; 200])), false),
    ("closed the connection", |_, right| Lie::Leave(right[..9].to_vec()), false),
    ("not Modbus TCP", |_, _| Lie::Flood, false),
];

/// A client with this timeout.
async fn tcp(script: &Script, patience: Duration) -> ModbusClient<TcpConnection> {
    let address = listen(script);
    let settings = client(LinkSettings::Tcp(tcp_link(address)));
    let mut client = ModbusClient::new(&settings, tcp_to(address, patience));
    client.connect().await.unwrap();
    client
}

#[tokio::test]
async fn every_wrong_answer_over_tcp_is_a_passing_error() {
    for (words, answer, is_kept) in TCP_LIES {
        let script = honest();
        let mut client = tcp(&script, patience(words)).await;
        recovers(&mut client, words).await;
        let trouble = told(&mut client, &script, words, answer).await;
        let reason = &trouble.reason;
        assert!(reason.starts_with("reading input 0..1 of unit 1: "), "{words}: {reason}");
        assert!(reason.contains(words), "{words}: {reason}");
        assert_eq!(trouble.is_disconnected, !is_kept, "{words}");
        if !is_kept {
            client.disconnect();
            client.connect().await.unwrap();
        }
        recovers(&mut client, words).await;
    }
}

/// The client's trouble after a lie. On a busy machine even the first bytes of an answer may be
/// late: then the peer repeats the lie.
async fn told(
    client: &mut ModbusClient<TcpConnection>,
    script: &Script,
    words: &str,
    answer: Answer,
) -> ExchangeFailure {
    for _ in 0..20 {
        lie(script, answer);
        let trouble = exchange(client).await.unwrap_err();
        if !words.contains("no whole answer") || !trouble.reason.contains(": no answer in") {
            return trouble;
        }
        client.disconnect();
        client.connect().await.unwrap();
    }
    panic!("{words}: no beginning of an answer in time");
}

#[tokio::test]
async fn a_wrongly_confirmed_write_is_repeated() {
    let script = honest();
    let mut client = tcp(&script, PATIENT).await;
    assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
    client.connect().await.unwrap();
    lie(&script, |_, right| Lie::Say(with(right, 9, right[9] + 1)));
    let trouble = exchange(&mut client).await.unwrap_err();
    let words = "writing coil 0 of unit 1: the answer confirms a different write";
    assert_eq!(trouble.reason, words);
    client.connect().await.unwrap();
    let written = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&written);
    lie(&script, move |request, _| {
        seen.lock().unwrap().extend_from_slice(&request[7..]);
        Lie::None
    });
    assert!(exchange(&mut client).await.is_ok());
    assert_eq!(*written.lock().unwrap(), [5, 0, 0, 0xff, 0]);
}

#[tokio::test]
async fn a_silent_unit_does_not_block_outputs_of_others() {
    let script = honest();
    let address = listen(&script);
    let mut settings = client(LinkSettings::Tcp(tcp_link(address)));
    settings.outputs[0].unit = 2;
    let mut client = ModbusClient::new(&settings, tcp_to(address, PATIENT));
    client.connect().await.unwrap();
    let asked = Arc::new(Mutex::new(Vec::new()));
    for _ in 0..100 {
        let seen = Arc::clone(&asked);
        lie(&script, move |request, _| {
            seen.lock().unwrap().push((request[6], request[7..].to_vec()));
            if request[6] == 1 { exception(request, 11) } else { Lie::None }
        });
    }
    let mut inputs = [None; 2];
    for on in [1, 0, 1, 1] {
        let trouble = client.exchange(poll(&[on], &mut inputs)).await.unwrap_err();
        assert!(trouble.reason.ends_with("(the gateway's device does not answer)"), "{trouble}");
        assert!(!trouble.is_disconnected);
    }
    let asked = asked.lock().unwrap();
    let of = |unit| asked.iter().filter(move |(of, _)| *of == unit).map(|(_, pdu)| pdu[3]);
    assert_eq!(of(2).collect::<Vec<_>>(), [0xff, 0, 0xff], "each change once");
    assert!(of(1).count() >= 2, "it is asked again");
}

/// The results of four polls by a client with these two inputs. Its peer reacts to every request by
/// `answer`.
async fn polled(
    inputs: [(u8, u16); 2],
    patience: Duration,
    answer: impl Fn(&[u8]) -> Lie + Clone + Send + 'static,
) -> Vec<(Result<(), ExchangeFailure>, [Option<i32>; 2])> {
    let script = honest();
    let address = listen(&script);
    let mut settings = client(LinkSettings::Tcp(tcp_link(address)));
    for (input, (unit, at)) in settings.inputs.iter_mut().zip(inputs) {
        (input.unit, input.at) = (unit, at);
    }
    let mut client = ModbusClient::new(&settings, tcp_to(address, patience));
    client.connect().await.unwrap();
    for _ in 0..100 {
        let answer = answer.clone();
        lie(&script, move |request, _| answer(request));
    }
    let mut polled = Vec::new();
    for _ in 0..4 {
        let mut inputs = [None; 2];
        let done = timeout(liars::BOUND, client.exchange(poll(&[1], &mut inputs))).await.unwrap();
        polled.push((done.map(|_| ()), inputs));
    }
    polled
}

#[tokio::test]
async fn an_exception_of_one_point_does_not_block_others() {
    let refuses = |request: &[u8]| match request[9] {
        10 => exception(request, 2),
        _ => Lie::None,
    };
    for (done, inputs) in polled([(1, 0), (1, 10)], PATIENT, refuses).await {
        let words = "reading input 10 of unit 1: exception 2 (illegal data address)";
        assert_eq!(done, Err(ExchangeFailure::kept(words)));
        assert_eq!(inputs, [Some(1000), None]);
    }
    for (_, inputs) in polled([(1, 10), (1, 20)], PATIENT, refuses).await {
        assert_eq!(inputs, [None, Some(1020)], "also one that is read behind it");
    }
}

#[tokio::test]
async fn a_dead_unit_behind_a_gateway_does_not_block_others() {
    let says = |request: &[u8]| match request[6] {
        2 => exception(request, 11),
        _ => Lie::None,
    };
    let is_silent = |request: &[u8]| match request[6] {
        2 => Lie::Silence,
        _ => Lie::None,
    };
    let inputs = [(2, 0), (3, 5)];
    let slow = TIMEOUT * 5;
    let both = [polled(inputs, PATIENT, says).await, polled(inputs, slow, is_silent).await];
    let words = ["exception 11 (the gateway's device does not answer)", "no answer in 2000 ms"];
    for (polled, words) in both.into_iter().zip(words) {
        for (done, inputs) in polled {
            let trouble = done.unwrap_err();
            let says = format!("reading input 0 of unit 2: {words}");
            assert!(trouble.reason.starts_with(&says), "{trouble}");
            assert!(!trouble.is_disconnected, "{words}");
            assert_eq!(inputs, [None, Some(1005)], "{words}");
        }
    }
}

#[tokio::test]
async fn a_gateway_without_any_answering_unit_is_lost() {
    let script = honest();
    let address = listen(&script);
    let mut settings = client(LinkSettings::Tcp(tcp_link(address)));
    for (input, (unit, at)) in settings.inputs.iter_mut().zip([(2, 0), (3, 5)]) {
        (input.unit, input.at) = (unit, at);
    }
    let mut client = ModbusClient::new(&settings, tcp_to(address, TIMEOUT));
    client.connect().await.unwrap();
    let mut inputs = [None; 2];
    while client.exchange(poll(&[1], &mut inputs)).await.is_err() {}
    for _ in 0..9 {
        lie(&script, |_, _| Lie::Silence);
    }
    let ended = async {
        loop {
            let mut inputs = [None; 2];
            let trouble = client.exchange(poll(&[1], &mut inputs)).await.unwrap_err();
            assert_eq!(inputs, [None, None]);
            if trouble.is_disconnected {
                break;
            }
            tokio::task::yield_now().await;
        }
    };
    timeout(liars::BOUND, ended).await.expect("silence of all ends the connection");
}

/// Outputs that the peer may have lost with the connection are written again.
#[tokio::test]
async fn an_idle_connection_closed_by_the_peer_fails_no_exchange() {
    let script = honest();
    let mut client = tcp(&script, PATIENT).await;
    assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
    let asked = Arc::new(Mutex::new(Vec::new()));
    for at in 0..9 {
        let seen = Arc::clone(&asked);
        lie(&script, move |request, _| {
            seen.lock().unwrap().push(request[7]);
            if at % 3 == 0 { Lie::Leave(Vec::new()) } else { Lie::None }
        });
    }
    for _ in 0..3 {
        assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
    }
    assert_eq!(*asked.lock().unwrap(), [4, 5, 4, 4, 5, 4, 4, 5, 4]);
    for _ in 0..2 {
        lie(&script, |_, _| Lie::Leave(Vec::new()));
    }
    let trouble = exchange(&mut client).await.unwrap_err();
    assert!(trouble.is_disconnected, "one that closes the new connection too is in trouble");
}

#[tokio::test]
async fn a_peer_that_refuses_connections_is_an_error() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    drop(listener);
    let mut link = tcp_to(address, PATIENT);
    let trouble = rungd_io::modbus_client::PeerLink::connect(&mut link).await.unwrap_err();
    assert!(trouble.reason.starts_with("no connection: Connection refused"), "{trouble}");
    assert!(trouble.is_disconnected);
}

#[tokio::test]
async fn a_thousand_connections_leak_no_resources() {
    let script = honest();
    let address = listen(&script);
    let settings = client(LinkSettings::Tcp(tcp_link(address)));
    let mut client = ModbusClient::new(&settings, tcp_to(address, PATIENT));
    client.connect().await.unwrap();
    assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
    for _ in 0..1000 {
        lie(&script, |_, _| Lie::Leave(Vec::new()));
        assert_eq!(exchange(&mut client).await, Ok([1000, 1001]), "over a connection made anew");
    }
    // The last sockets are closed when their tasks get a turn.
    let begin = std::time::Instant::now();
    while sockets_to(address.port()) != 1 {
        assert!(begin.elapsed() < PATIENCE, "{} are left", sockets_to(address.port()));
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

/// The number of sockets held by a process that are connected to this port of this machine.
fn sockets_to(port: u16) -> usize {
    let table = std::fs::read_to_string("/proc/self/net/tcp").unwrap();
    let is_held = |line: &&str| {
        let columns: Vec<&str> = line.split_whitespace().collect();
        columns[2].ends_with(&format!(":{port:04X}")) && columns[9] != "0"
    };
    table.lines().skip(1).filter(is_held).count()
}

#[test]
fn any_bytes_as_an_answer_cause_at_most_an_error() {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let script = honest();
    let mut client = runtime.block_on(tcp(&script, PATIENT));
    let mut runner = TestRunner::new(proptest::test_runner::Config::with_cases(300));
    let client = &mut client;
    let client = std::cell::RefCell::new(client);
    let bytes = proptest::collection::vec(proptest::num::u8::ANY, 0..64);
    let run = |bytes: Vec<u8>| {
        let mut client = client.borrow_mut();
        runtime.block_on(async {
            // Half of the answers have a valid header before the bytes.
            lie(&script, move |request, _| match bytes.first() {
                Some(1..128) => Lie::Leave(tcp_frame(request, &bytes)),
                _ => Lie::Leave(bytes.clone()),
            });
            let _ = exchange(&mut client).await;
            client.disconnect();
            client.connect().await.unwrap();
            assert_eq!(exchange(&mut client).await, Ok([1000, 1001]));
        });
        Ok(())
    };
    runner.run(&bytes, run).unwrap();
}

#[test]
fn a_device_with_wrong_answers_disturbs_no_other_and_does_not_flood_the_log() {
    let (liar, honest) = (honest(), honest());
    for _ in 0..100 {
        TCP_LIES.iter().filter(|(.., is_kept)| *is_kept).for_each(|(_, told, _)| lie(&liar, told));
        TCP_LIES.iter().for_each(|(_, told, _)| lie(&liar, told));
    }
    // The honest device may be late on a busy machine.
    let patient = "timeout = \"10s\"\nloss-after = \"30s\"\n";
    let device = |name: &str, script: &Script, input: u32| {
        let address = listen(script);
        let more = if name == "honest" { patient } else { "" };
        format!(
            "[[device]]\nname = \"{name}\"\ndriver = \"modbus-tcp\"\naddress = \"{address}\"\n{more}\
             map = [{{ from = \"input 0..1\", to = \"D{input}..D{}\" }}]\n",
            input + 1
        )
    };
    let devices = device("liar", &liar, 0) + &device("honest", &honest, 2);
    let ladder = "[[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = [\"D2 == 1000\"]\n\
                  do = [\"OUT Y0\"]\n";
    let plant = process::Plant::new(ladder, &devices);
    let mut rungd = process::Running::new(&mut plant.command::<&str>(&[]));
    rungd.line("liar: ");
    rungd.line("honest exchanges");
    std::thread::sleep(Duration::from_secs(3));
    let lines = rungd.stop();
    process::no_scan_missed(&lines, Duration::from_millis(10), Duration::from_secs(3));
    let told =
        |words: &str| lines.iter().filter(|line| process::message(line).starts_with(words)).count();
    // Beside the first line an outage has at most three, each with a key that was not named yet.
    let keys: Vec<_> = lines
        .iter()
        .map(process::message)
        .filter(|told| told.starts_with("liar: "))
        .map(|told| told.split('`').nth(1).map(str::to_owned))
        .collect();
    let different: BTreeSet<_> = keys.iter().collect();
    let is_new = keys.iter().all(Option::is_some) && different.len() == keys.len();
    assert!(keys.len() <= 3 && is_new, "whatever the lies: {lines:#?}");
    assert_eq!(told("honest is lost") + told("honest: "), 0, "{lines:#?}");
}
