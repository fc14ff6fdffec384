//! A Modbus device with the habits of devices in public bug reports, in the test's own process.
//!
//! Register n holds n + 1000 until it is written. Its habits depend on requests and connections,
//! not on time, so that a busy machine changes nothing; only [`HabitPeer::gap`] and [`HabitPeer::split_gap`] are times.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

use crate::io::liars::{rtu_frame, tcp_frame};

/// The habits of a device. The default is a device without any.
#[derive(Clone, Copy, Default)]
pub struct HabitPeer {
    /// Its frames are those of Modbus RTU.
    pub rtu: bool,
    /// The requests that it loses after each connecting.
    pub lost: usize,
    /// A request that comes within this time after an answer is lost.
    pub gap: Duration,
    /// The most registers or bits of a request, if there is a limit.
    pub most: Option<u16>,
    /// The answer to a longer request: an exception, or 0 for fewer elements.
    pub refusal: u8,
    /// The transaction of its answers, if it is not the request's.
    pub transaction: Option<fn(u16) -> u16>,
    /// It closes the connection after each answer.
    pub closes: bool,
    /// It sends each answer in two parts.
    pub splits: bool,
    /// The time between the two parts.
    pub split_gap: Duration,
    /// The unit that its answers name, if it is not the request's.
    pub unit: Option<u8>,
}

/// What a device has seen.
#[derive(Default)]
pub struct SeenRequests {
    /// The number of connections.
    pub connections: usize,
    /// The unit and the PDU of each request, also of a lost one.
    pub requests: Vec<(u8, Vec<u8>)>,
    /// The registers that were written.
    pub registers: BTreeMap<u16, u16>,
}

impl HabitPeer {
    /// Serves for ever; returns the address.
    pub fn start(self) -> (SocketAddr, Arc<Mutex<SeenRequests>>) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (address, seen) = (listener.local_addr().unwrap(), Arc::default());
        let told = Arc::clone(&seen);
        spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let seen = Arc::clone(&told);
                spawn(move || self.serve(stream, &seen));
            }
        });
        (address, seen)
    }

    fn serve(self, mut stream: TcpStream, seen: &Mutex<SeenRequests>) {
        seen.lock().unwrap().connections += 1;
        let _ = stream.set_nodelay(true);
        let (mut requests, mut answered) = (0, None::<Instant>);
        while let Some(frame) = self.receive(&mut stream) {
            let (unit, pdu) = self.parts(&frame);
            seen.lock().unwrap().requests.push((unit, pdu.to_vec()));
            requests += 1;
            let is_early = answered.is_some_and(|at| at.elapsed() < self.gap);
            let pdu = self.answer(pdu, &mut seen.lock().unwrap());
            if requests <= self.lost || is_early || (self.rtu && unit == 0) {
                continue;
            }
            answered = Some(Instant::now());
            let frame = self.frame(&frame, self.unit.unwrap_or(unit), &pdu);
            let (first, second) = frame.split_at(if self.splits { 4 } else { 0 });
            let sent = stream.write_all(first).and_then(|()| {
                sleep(self.split_gap);
                stream.write_all(second)
            });
            if sent.is_err() || self.closes {
                return;
            }
        }
    }

    /// The bytes of a whole request.
    fn receive(self, stream: &mut TcpStream) -> Option<Vec<u8>> {
        let mut frame = vec![0; if self.rtu { 8 } else { 6 }];
        stream.read_exact(&mut frame).ok()?;
        let more = match self.rtu {
            false => usize::from(frame[5]),
            true if matches!(frame[1], 15 | 16) => 1 + usize::from(frame[6]),
            true => 0,
        };
        let begun = frame.len();
        frame.resize(begun + more, 0);
        stream.read_exact(&mut frame[begun..]).ok()?;
        Some(frame)
    }

    fn parts(self, frame: &[u8]) -> (u8, &[u8]) {
        match self.rtu {
            true => (frame[0], &frame[1..frame.len() - 2]),
            false => (frame[6], &frame[7..]),
        }
    }

    fn frame(self, request: &[u8], unit: u8, pdu: &[u8]) -> Vec<u8> {
        if self.rtu {
            return rtu_frame(unit, pdu);
        }
        let mut frame = tcp_frame(request, pdu);
        frame[6] = unit;
        if let Some(other) = self.transaction {
            let transaction = other(u16::from_be_bytes([request[0], request[1]]));
            frame[..2].copy_from_slice(&transaction.to_be_bytes());
        }
        frame
    }

    fn answer(self, pdu: &[u8], seen: &mut SeenRequests) -> Vec<u8> {
        let word = |at: usize| u16::from_be_bytes([pdu[at], pdu[at + 1]]);
        let (function, first) = (pdu[0], word(1));
        let count = if matches!(function, 5 | 6) { 1 } else { word(3) };
        let most = self.most.unwrap_or(count).min(count);
        if most < count && (self.refusal != 0 || function > 4) {
            return vec![function | 0x80, self.refusal];
        }
        let content = |n: u16| seen.registers.get(&n).copied().unwrap_or(n.wrapping_add(1000));
        match function {
            1 | 2 => {
                let bytes = usize::from(most.div_ceil(8));
                [&[function, bytes as u8][..], &vec![0xff; bytes]].concat()
            }
            3 | 4 => {
                let words = (first..first + most).flat_map(|n| content(n).to_be_bytes());
                [&[function, (most * 2) as u8][..], &words.collect::<Vec<_>>()].concat()
            }
            6 => {
                seen.registers.insert(first, word(3));
                pdu.to_vec()
            }
            16 => {
                for n in 0..count {
                    seen.registers.insert(first + n, word(6 + 2 * usize::from(n)));
                }
                pdu[..5].to_vec()
            }
            _ => pdu[..5].to_vec(),
        }
    }
}
