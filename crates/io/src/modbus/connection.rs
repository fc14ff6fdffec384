//! One client's connection: it receives requests and sends replies, one request at a time, within
//! limits of time and memory.
//!
//! The server starts one task per connection. A connection holds one frame in each direction;
//! requests that a client sends ahead wait in the kernel's buffers. `frame` finds the frames and
//! `answer` decides on requests. The connection reaches the scan only through the port. A read is
//! answered from one snapshot; a write waits until a complete scan has seen it.

use std::net::SocketAddr;
use std::sync::Arc;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{Instant, timeout, timeout_at};

use super::answer::{self, Answer};
use super::closed::Closed;
use super::frame::{self, Broken, FRAME_BYTES_MAX, Header, Split};
use super::map::Asker;
use super::refusal::ModbusRefusal;
use super::shared::ServerState;
use crate::seats::Seat;
use rungd_runtime::Origin;
use rungd_runtime::exchange::Write;
use rungd_runtime::say::say;

/// One client's connection.
pub(super) struct Connection {
    stream: TcpStream,
    client: SocketAddr,
    shared: Arc<ServerState>,
    seat: Arc<Seat>,
    received: [u8; FRAME_BYTES_MAX],
    filled: usize,
    /// The end of the present wait for bytes.
    deadline: Instant,
}

impl Connection {
    /// A connection that keeps its seat after its first answer.
    pub fn new(
        stream: TcpStream,
        client: SocketAddr,
        shared: Arc<ServerState>,
        seat: Arc<Seat>,
    ) -> Connection {
        let (received, deadline) = ([0; FRAME_BYTES_MAX], seat.idle_until());
        Connection { stream, client, shared, seat, received, filled: 0, deadline }
    }

    /// Answers requests until the connection ends, and logs its beginning and its end.
    pub async fn serve(mut self) {
        let (client, seat) = (self.client, Arc::clone(&self.seat));
        say!(MODBUS_CONNECTED, %client, "Modbus client connected");
        let why = tokio::select! {
            why = self.answer_all() => why,
            () = seat.asked_to_leave() => Closed::MadeRoom,
        };
        if why.is_usual() {
            say!(MODBUS_GONE, %client, "Modbus client gone: {why}");
        } else {
            say!(MODBUS_CLOSED, %client, "Modbus client closed: {why}");
        }
    }

    async fn answer_all(&mut self) -> Closed {
        // Replies are sent without delay: the client waits for its reply, which is one small
        // packet.
        let _ = self.stream.set_nodelay(true);
        loop {
            let closed = match self.next_frame() {
                Next::Frame { header, pdu } => self.answer(header, &pdu).await.err(),
                Next::More => self.receive().await.err(),
                Next::Broken(broken) => Some(Closed::Broken(broken)),
            };
            if let Some(closed) = closed {
                return closed;
            }
        }
    }

    /// Takes the first frame out of the received bytes.
    fn next_frame(&mut self) -> Next {
        let (header, pdu, bytes) = match frame::split(&self.received[..self.filled]) {
            Split::More => return Next::More,
            Split::Broken(broken) => return Next::Broken(broken),
            Split::Frame { header, pdu, bytes } => (header, pdu.to_vec(), bytes),
        };
        self.received.copy_within(bytes..self.filled, 0);
        self.filled -= bytes;
        Next::Frame { header, pdu }
    }

    /// Waits for further bytes of the frame, or for the first byte of the next frame.
    async fn receive(&mut self) -> Result<(), Closed> {
        let free = &mut self.received[self.filled..];
        let limits = &self.shared;
        match timeout_at(self.deadline, self.stream.read(free)).await {
            Err(_) if self.filled == 0 => Err(Closed::Idle(self.seat.idle_max())),
            Err(_) => Err(Closed::Unfinished(limits.frame_timeout())),
            Ok(Err(error)) => Err(Closed::Failed(error)),
            Ok(Ok(0)) if self.filled == 0 => Err(Closed::ByClient),
            Ok(Ok(0)) => Err(Closed::WithinFrame),
            Ok(Ok(count)) => {
                if self.filled == 0 {
                    self.deadline = Instant::now() + limits.frame_timeout();
                }
                self.filled += count;
                Ok(())
            }
        }
    }

    /// Answers one request, and starts the wait for the next.
    async fn answer(&mut self, header: Header, pdu: &[u8]) -> Result<(), Closed> {
        let busy = self.seat.busy();
        let reply = self.reply(header.unit, pdu).await;
        let frame = frame::around(header, |bytes| bytes.extend_from_slice(&reply));
        let limits = &self.shared;
        match timeout(limits.frame_timeout(), self.stream.write_all(&frame)).await {
            Err(_) => return Err(Closed::NotTaken(limits.frame_timeout())),
            Ok(Err(error)) => return Err(Closed::Failed(error)),
            Ok(Ok(())) => self.seat.keep(),
        }
        drop(busy);
        self.deadline = match self.filled {
            0 => self.seat.idle_until(),
            _ => Instant::now() + limits.frame_timeout(),
        };
        Ok(())
    }

    /// The reply's PDU.
    async fn reply(&self, unit: u8, pdu: &[u8]) -> Vec<u8> {
        let asker = Asker { unit, client: self.client.ip() };
        let (latest, map) = self.shared.latest();
        let (request, done) = match answer::answer(&map, asker, pdu, &latest) {
            Answer::Reply(reply) => return reply,
            Answer::Refused(request, refusal) => (request, Err(refusal)),
            Answer::Write(request, batch) => {
                let done = self.write(latest.generation, batch).await.and_then(|()| {
                    let (latest, map) = self.shared.latest();
                    answer::written(&map, unit, (pdu, &request), &latest)
                });
                (request, done)
            }
        };
        done.unwrap_or_else(|refusal| {
            let (place, said) = (map.place(unit, &request), refusal.say(|what| map.called(what)));
            self.shared.log_refusal(self.client, (&place, &said), &request, refusal);
            answer::refused(pdu, refusal)
        })
    }

    /// Hands in a write as one batch, and waits until a complete scan has seen it. A reload in
    /// between can only move operands that have a name; the write follows them to their new cells.
    async fn write(&self, generation: u32, batch: Vec<Write>) -> Result<(), ModbusRefusal> {
        let port = &self.shared.port;
        let ticket = port
            .submit_to(generation, batch)
            .map_err(|refused| ModbusRefusal::of_batch(refused, port.latest().mode))?;
        port.sign(Origin::Batch(ticket), format!("Modbus client {}", self.client));
        let wait = self.shared.write_wait.max(self.shared.port.patience());
        match timeout(wait, port.done(ticket)).await {
            Err(_) => Err(ModbusRefusal::NotSeen),
            Ok(done) => {
                done.map_err(|refused| ModbusRefusal::of_batch(refused, port.latest().mode))
            }
        }
    }
}

/// The next step, which depends on the received bytes.
enum Next {
    More,
    Frame { header: Header, pdu: Vec<u8> },
    Broken(Broken),
}
