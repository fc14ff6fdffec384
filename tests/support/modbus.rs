//! A raw Modbus TCP client for tests of the real program. It shares no code with rungd.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use crate::metronome;
use crate::patience::PATIENCE;

/// A frame around a PDU.
pub fn frame(transaction: u16, unit: u8, pdu: &[u8]) -> Vec<u8> {
    let length = (pdu.len() + 1) as u16;
    let head = [transaction.to_be_bytes(), [0, 0], length.to_be_bytes()].concat();
    [&head[..], &[unit], pdu].concat()
}

/// A connected client.
pub struct Client {
    stream: TcpStream,
    transaction: u16,
}

impl Client {
    pub fn connect(address: &str) -> Client {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_nodelay(true).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Client { stream, transaction: 0 }
    }

    /// The reply to a PDU; `None` if the connection is closed.
    pub fn try_ask(&mut self, unit: u8, pdu: &[u8]) -> Option<Vec<u8>> {
        self.transaction = self.transaction.wrapping_add(1);
        self.stream.write_all(&frame(self.transaction, unit, pdu)).ok()?;
        let mut header = [0; 7];
        self.stream.read_exact(&mut header).ok()?;
        let [number @ .., 0, 0, high, low, from] = header else { panic!("{header:?}") };
        assert_eq!((u16::from_be_bytes(number), from), (self.transaction, unit));
        let mut reply = vec![0; usize::from(u16::from_be_bytes([high, low])) - 1];
        self.stream.read_exact(&mut reply).ok()?;
        Some(reply)
    }

    /// The reply to a PDU.
    pub fn ask(&mut self, unit: u8, pdu: &[u8]) -> Vec<u8> {
        self.try_ask(unit, pdu).expect("a reply")
    }
}

/// The number of times that threads must run between a connection and its first reply: the threads
/// that accept, read, look up and write, and the test's own thread.
const WAKE_UPS: u32 = 10;

/// The time from connecting a new client to its first reply. Fails if it is 2 s or more, after
/// subtracting possible delays by the machine. Each run of a thread may have been delayed for as
/// long as the metronome's thread.
pub fn served_within(address: &str) -> Duration {
    let began = Instant::now();
    let reply = Client::connect(address).ask(1, &[3, 0, 0, 0, 1]);
    assert_eq!(reply.len(), 4);
    let took = began.elapsed();
    let held_up = metronome::held_up_within(took);
    let told = format!("served after {took:?}, a thread beside it was held up for {held_up:?}");
    assert!(took < Duration::from_secs(2) + WAKE_UPS * held_up, "{told}");
    took
}
