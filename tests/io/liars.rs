//! Modbus peers that lie (answer wrongly), in the test's own process, and a client for them.

use std::fs::File;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread::{sleep, spawn};
use std::time::Duration;

use crate::io::line::pty;
use rungd_io::device::{Driver, Exchange, ExchangeFailure, ExchangeReason};
use rungd_io::modbus::number::{NumberOrder, RegisterNumberType};
use rungd_io::modbus_client::settings;
use rungd_io::modbus_client::{ModbusClient, PeerLink, RtuLines, RtuLink, TcpConnection, rtu};
use rungd_io::scaling::Scaling;
use settings::{
    ConnectionUse, ModbusPoint, ModbusTable, NumberPart, PeerHabits, PointForm, RegisterNumber,
    RtuLine, RtuPort, TcpLink, TcpPeer, Transaction, WriteFunctions,
};
use tokio::time::timeout;

/// The client's timeout in tests that wait until it expires.
pub const TIMEOUT: Duration = Duration::from_millis(400);

/// The client's timeout in tests in which every answer comes, late only on a busy machine.
pub const PATIENT: Duration = Duration::from_secs(30);

/// The longest time that a lie may delay a client, with much room for a busy machine.
pub const BOUND: Duration = Duration::from_secs(20);

/// A peer's reaction to a request.
#[derive(Clone, Debug)]
pub enum Lie {
    /// The right answer.
    None,
    /// These bytes as the answer.
    Say(Vec<u8>),
    /// These bytes, one after another, slowly.
    Trickle(Vec<u8>),
    /// No answer.
    Silence,
    /// The right answer, but only after this time.
    After(Duration),
    /// These bytes, and the end of the connection.
    Leave(Vec<u8>),
    /// Endless bytes.
    Flood,
}

/// The lies for the next requests. Each function receives the request and the right answer.
pub type Script = Arc<Mutex<Vec<Box<dyn Fn(&[u8], &[u8]) -> Lie + Send>>>>;

/// The settings of a client: `input 0..1` of unit 1 as two numbers, `coil 0` of unit 1 written.
pub fn client(link: settings::LinkSettings) -> settings::ClientSettings {
    let scaling = Scaling::none(false);
    let (order, part) = (NumberOrder::default(), NumberPart::Whole);
    let number = RegisterNumber { kind: RegisterNumberType::U16, order, part, scaling };
    let input = |at| ModbusPoint {
        unit: 1,
        table: ModbusTable::InputRegisters,
        at,
        form: PointForm::Number(number),
    };
    let coil = ModbusPoint { unit: 1, table: ModbusTable::Coils, at: 0, form: PointForm::Bit };
    settings::ClientSettings {
        link,
        timeout_ms: 400,
        habits: PeerHabits::default(),
        write_every_ms: 0,
        writes: WriteFunctions::Fitting,
        gap: 0,
        watchdog: None,
        inputs: vec![input(0), input(1)],
        outputs: vec![coil],
    }
}

/// A peer at this address, over one connection.
pub fn peer(address: SocketAddr) -> TcpPeer {
    TcpPeer { address, connect_timeout_ms: 30_000, connection: ConnectionUse::Kept }
}

/// The way to a peer by Modbus TCP.
pub fn tcp_link(address: SocketAddr) -> TcpLink {
    TcpLink { peer: peer(address), transaction: Transaction::Check }
}

/// A link to a peer without habits by Modbus TCP.
pub fn tcp_to(address: SocketAddr, patience: Duration) -> TcpConnection {
    TcpConnection::new(tcp_link(address), PeerHabits::default(), patience)
}

/// The right answer's PDU: registers count up from 1000.
pub fn right(pdu: &[u8]) -> Vec<u8> {
    match pdu {
        [function @ 1..=4, _, first, _, count] => {
            let words = (0..*count).flat_map(|n| (1000 + u16::from(first + n)).to_be_bytes());
            [&[*function, count * 2][..], &words.collect::<Vec<u8>>()].concat()
        }
        _ => pdu[..5].to_vec(),
    }
}

/// A PDU as a frame of Modbus TCP that answers a request.
pub fn tcp_frame(request: &[u8], pdu: &[u8]) -> Vec<u8> {
    let length = (pdu.len() as u16 + 1).to_be_bytes();
    [&request[..2], &[0, 0], &length, &request[6..7], pdu].concat()
}

/// Serves one connection of a TCP peer: answers requests by the script, and rightly after its end.
fn serve_tcp(mut stream: TcpStream, script: &Script) {
    let mut bytes = [0; 260];
    loop {
        let mut filled = 0;
        while filled < 6 || filled < 6 + usize::from(bytes[5]) {
            match stream.read(&mut bytes[filled..]) {
                Ok(0) | Err(_) => return,
                Ok(count) => filled += count,
            }
        }
        let request = &bytes[..filled];
        let answer = tcp_frame(request, &right(&request[7..]));
        let lie = next(script, request, &answer);
        if !act(&mut stream, lie, &answer) {
            return;
        }
    }
}

/// Accepts connections for ever; returns the address.
pub fn listen(script: &Script) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let script = Arc::clone(script);
    spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            let script = Arc::clone(&script);
            spawn(move || serve_tcp(stream, &script));
        }
    });
    address
}

/// Answers requests on the peer's end of a pty until a lie ends the connection.
pub fn serve_rtu(mut line: File, script: &Script) {
    let mut bytes = [0; 8];
    loop {
        let mut filled = 0;
        // Requests that read, or that write one value, have eight bytes. Other bytes are the rest
        // of a frame that the client has discarded.
        while filled < 8 || rtu_frame(bytes[0], &bytes[1..6]) != bytes[..8] {
            if filled == 8 {
                bytes.copy_within(1..8, 0);
                filled = 7;
            }
            match line.read(&mut bytes[filled..8]) {
                Ok(0) => return,
                Ok(count) => filled += count,
                // Nobody has the other end open.
                Err(_) => sleep(Duration::from_millis(1)),
            }
        }
        let request = &bytes;
        let answer = rtu_frame(request[0], &right(&request[1..6]));
        let lie = next(script, request, &answer);
        if !act(&mut line, lie, &answer) {
            return;
        }
    }
}

/// The settings of a serial line; `echo`: whether its adapter sends requests back.
pub fn serial(path: String, echo: bool) -> RtuLine {
    let parity = settings::Parity::None;
    let serial = settings::SerialSettings { path, baud: 115_200, parity, stop_bits: 1 };
    RtuLine { port: RtuPort::Serial(serial), echo }
}

/// A client that has opened a line to a peer with this script; `alter` changes its settings.
pub async fn rtu_client(
    script: Script,
    echo: bool,
    patience: Duration,
    alter: impl FnOnce(&mut settings::ClientSettings),
) -> ModbusClient<RtuLink> {
    let (master, port) = pty();
    spawn(move || serve_rtu(master, &script));
    let serial = serial(port, echo);
    let mut settings = client(settings::LinkSettings::Rtu(serial.clone()));
    alter(&mut settings);
    let link = RtuLines::default().link(&serial, settings.habits, patience);
    let mut client = ModbusClient::new(&settings, link);
    client.connect().await.unwrap();
    client
}

/// A PDU as a frame of Modbus RTU.
pub fn rtu_frame(unit: u8, pdu: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    rtu::frame(&mut bytes, unit, pdu);
    bytes
}

fn next(script: &Script, request: &[u8], answer: &[u8]) -> Lie {
    let mut script = script.lock().unwrap();
    match script.is_empty() {
        true => Lie::None,
        false => script.remove(0)(request, answer),
    }
}

/// Carries out a lie; false if it ends the connection.
fn act(stream: &mut (impl Read + Write), lie: Lie, answer: &[u8]) -> bool {
    match lie {
        Lie::None => stream.write_all(answer).is_ok(),
        Lie::Say(bytes) => stream.write_all(&bytes).is_ok(),
        Lie::Trickle(bytes) => bytes.iter().all(|byte| {
            sleep(TIMEOUT / 3);
            stream.write_all(&[*byte]).is_ok()
        }),
        Lie::Silence => true,
        Lie::After(time) => {
            sleep(time);
            stream.write_all(answer).is_ok()
        }
        Lie::Leave(bytes) => {
            let _ = stream.write_all(&bytes);
            false
        }
        Lie::Flood => {
            while stream.write_all(&[0x55; 64]).is_ok() {}
            false
        }
    }
}

/// One exchange. It must end within [`BOUND`], whatever the peer does.
pub async fn exchange<L: PeerLink>(
    client: &mut ModbusClient<L>,
) -> Result<[i32; 2], ExchangeFailure> {
    let mut inputs = [None; 2];
    let exchange = poll(&[1], &mut inputs);
    let done = timeout(BOUND, client.exchange(exchange)).await.expect("bounded time");
    done.map(|_| inputs.map(|input| input.expect("a good exchange reads all")))
}

/// A poll's exchange in which nothing is urgent.
pub fn poll<'a>(outputs: &'a [i32], inputs: &'a mut [Option<i32>]) -> Exchange<'a> {
    Exchange { occasion: ExchangeReason::Poll, outputs, inputs, is_urgent: &|| false }
}

pub type Answer = fn(&[u8], &[u8]) -> Lie;

/// The right answer with a byte changed.
pub fn with(answer: &[u8], at: usize, byte: u8) -> Vec<u8> {
    let mut bytes = answer.to_vec();
    bytes[at] = byte;
    bytes
}

pub fn honest() -> Script {
    Arc::new(Mutex::new(Vec::new()))
}

pub fn lie(script: &Script, lie: impl Fn(&[u8], &[u8]) -> Lie + Send + 'static) {
    script.lock().unwrap().push(Box::new(lie));
}

/// The timeout of a client for a lie with these words.
pub fn patience(words: &str) -> Duration {
    if words.contains("in 400 ms") { TIMEOUT } else { PATIENT }
}

/// Exchanges with a peer that answers rightly again. Only a client with the short timeout may need
/// a second attempt, on a busy machine.
pub async fn recovers<L: rungd_io::modbus_client::PeerLink>(
    client: &mut ModbusClient<L>,
    words: &str,
) {
    loop {
        match exchange(client).await {
            Ok(inputs) => return assert_eq!(inputs, [1000, 1001], "{words}"),
            Err(trouble) => {
                let is_late = trouble.reason.contains("in 400 ms");
                assert!(is_late && patience(words) == TIMEOUT, "{words}: {trouble}");
            }
        }
        client.connect().await.unwrap();
    }
}
