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

use super::answer::{self, AnsweredRequest, RequestDecision};
use super::closed::ConnectionEnd;
use super::frame::{self, FRAME_BYTES_MAX, FrameError, FrameHeader, FrameSplit};
use super::map::RequestSource;
use super::refusal::ModbusRefusal;
use super::shared::{RefusalText, ServerState};
use crate::seats::TakenSeat;
use rungd_runtime::Origin;
use rungd_runtime::exchange::OperandWrite;
use rungd_runtime::say::say;

/// One client's connection.
pub(super) struct ClientConnection {
    stream: TcpStream,
    client: SocketAddr,
    shared: Arc<ServerState>,
    seat: Arc<TakenSeat>,
    received: [u8; FRAME_BYTES_MAX],
    filled: usize,
    /// The end of the present wait for bytes.
    deadline: Instant,
}

impl ClientConnection {
    /// A connection that keeps its seat after its first answer.
    pub fn new(
        stream: TcpStream,
        client: SocketAddr,
        shared: Arc<ServerState>,
        seat: Arc<TakenSeat>,
    ) -> ClientConnection {
        let (received, deadline) = ([0; FRAME_BYTES_MAX], seat.idle_until());
        ClientConnection { stream, client, shared, seat, received, filled: 0, deadline }
    }

    /// Answers requests until the connection ends, and logs its beginning and its end.
    pub async fn serve(mut self) {
        let (client, seat) = (self.client, Arc::clone(&self.seat));
        say!(MODBUS_CONNECTED, %client, "Modbus client connected");
        let why = tokio::select! {
            why = self.answer_all() => why,
            () = seat.asked_to_leave() => ConnectionEnd::MadeRoom,
        };
        if why.is_usual() {
            say!(MODBUS_GONE, %client, "Modbus client gone: {why}");
        } else {
            say!(MODBUS_CLOSED, %client, "Modbus client closed: {why}");
        }
    }

    async fn answer_all(&mut self) -> ConnectionEnd {
        // Replies are sent without delay: the client waits for its reply, which is one small
        // packet.
        let _ = self.stream.set_nodelay(true);
        loop {
            let closed = match self.next_frame() {
                NextStep::Frame { header, pdu } => self.answer(header, &pdu).await.err(),
                NextStep::More => self.receive().await.err(),
                NextStep::Broken(broken) => Some(ConnectionEnd::Broken(broken)),
            };
            if let Some(closed) = closed {
                return closed;
            }
        }
    }

    /// Takes the first frame out of the received bytes.
    fn next_frame(&mut self) -> NextStep {
        let (header, pdu, bytes) = match frame::split(&self.received[..self.filled]) {
            FrameSplit::More => return NextStep::More,
            FrameSplit::Broken(broken) => return NextStep::Broken(broken),
            FrameSplit::Frame { header, pdu, bytes } => (header, pdu.to_vec(), bytes),
        };
        self.received.copy_within(bytes..self.filled, 0);
        self.filled -= bytes;
        NextStep::Frame { header, pdu }
    }

    /// Waits for further bytes of the frame, or for the first byte of the next frame.
    async fn receive(&mut self) -> Result<(), ConnectionEnd> {
        let free = &mut self.received[self.filled..];
        let limits = &self.shared;
        match timeout_at(self.deadline, self.stream.read(free)).await {
            Err(_) if self.filled == 0 => Err(ConnectionEnd::Idle(self.seat.idle_max())),
            Err(_) => Err(ConnectionEnd::Unfinished(limits.frame_timeout())),
            Ok(Err(error)) => Err(ConnectionEnd::Failed(error)),
            Ok(Ok(0)) if self.filled == 0 => Err(ConnectionEnd::ByClient),
            Ok(Ok(0)) => Err(ConnectionEnd::WithinFrame),
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
    async fn answer(&mut self, header: FrameHeader, pdu: &[u8]) -> Result<(), ConnectionEnd> {
        let busy = self.seat.busy();
        let reply = self.reply(header.unit, pdu).await;
        let frame = frame::around(header, |bytes| bytes.extend_from_slice(&reply));
        let limits = &self.shared;
        match timeout(limits.frame_timeout(), self.stream.write_all(&frame)).await {
            Err(_) => return Err(ConnectionEnd::NotTaken(limits.frame_timeout())),
            Ok(Err(error)) => return Err(ConnectionEnd::Failed(error)),
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
        let asker = RequestSource { unit, client: self.client.ip() };
        let (latest, map) = self.shared.latest();
        let (request, done) = match answer::answer(&map, asker, pdu, &latest) {
            RequestDecision::Reply(reply) => return reply,
            RequestDecision::Refused(request, refusal) => (request, Err(refusal)),
            RequestDecision::Write(request, batch) => {
                let done = self.write(latest.generation, batch).await.and_then(|()| {
                    let (latest, map) = self.shared.latest();
                    let request = AnsweredRequest { pdu, request: &request };
                    answer::written(&map, unit, request, &latest)
                });
                (request, done)
            }
        };
        done.unwrap_or_else(|refusal| {
            let (place, why) =
                (map.place(unit, &request), refusal.log_text(|what| map.called(what)));
            let text = RefusalText { place: &place, why: &why };
            self.shared.log_refusal(self.client, text, &request, refusal);
            answer::refused(pdu, refusal)
        })
    }

    /// Hands in a write as one batch, and waits until a complete scan has seen it. A reload in
    /// between can only move operands that have a name; the write follows them to their new cells.
    async fn write(&self, generation: u32, batch: Vec<OperandWrite>) -> Result<(), ModbusRefusal> {
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
enum NextStep {
    More,
    Frame { header: FrameHeader, pdu: Vec<u8> },
    Broken(FrameError),
}
