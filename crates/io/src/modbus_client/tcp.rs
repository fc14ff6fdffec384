//! The link by Modbus TCP: one connection, one question at a time.
//!
//! A late answer to an earlier question is known by its transaction, and skipped: a silence does
//! not end the connection at once (see `pace`). Any other frame that does not answer the present
//! question does: a new connection contains no old frames. If a peer's transactions say nothing, a
//! silence ends the connection too. Many peers close a connection that was idle for some time. The
//! link detects this only at the next question, and reports it as [`LinkFailure::Closed`]. The
//! link stores one frame at most.

use std::io;
use std::io::ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionReset, UnexpectedEof};
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{Instant, sleep_until, timeout};

use super::link::{LinkFailure, PeerLink};
use super::pace::{RequestPace, SilenceHint};
use super::rtu;
use super::settings::{ConnectionUse, PeerHabits, TcpLink, TcpPeer, Transaction};
use crate::device::ExchangeFailure;
use crate::modbus::frame::{self, FRAME_BYTES_MAX, FrameHeader, FrameSplit};

/// A peer, and the connection to it.
pub struct TcpConnection {
    settings: TcpLink,
    habits: PeerHabits,
    timeout: Duration,
    stream: Option<TcpStream>,
    pace: RequestPace,
    transaction: u16,
    /// The number of the questions before the present one that were not answered.
    lost: u16,
    received: [u8; FRAME_BYTES_MAX],
}

impl TcpConnection {
    /// A link that is not connected yet, for answers that are complete within `timeout`.
    pub fn new(settings: TcpLink, habits: PeerHabits, timeout: Duration) -> TcpConnection {
        TcpConnection {
            settings,
            habits,
            timeout,
            stream: None,
            pace: RequestPace::new(),
            transaction: 0,
            lost: 0,
            received: [0; FRAME_BYTES_MAX],
        }
    }

    async fn open(&mut self) -> Result<(), String> {
        self.stream = Some(connect(&self.settings.peer).await?);
        self.lost = 0;
        self.pace.open();
        Ok(())
    }

    /// Sends a question and receives its answer; `Ok(None)` if no byte of it came in time.
    async fn exchange(&mut self, header: FrameHeader, request: &[u8]) -> Result<usize, Unanswered> {
        let ready_at = self.pace.ready_at(&self.habits, Duration::ZERO);
        if ready_at > Instant::now() {
            sleep_until(ready_at).await;
        }
        let Some(stream) = &mut self.stream else {
            return Err(Unanswered::Broken("there is no connection".to_owned()));
        };
        self.pace.ask();
        let question = frame::around(header, |frame| frame.extend_from_slice(request));
        let lost = if self.settings.transaction == Transaction::Check { self.lost } else { 0 };
        let open = OpenTransactions { present: header.transaction, lost };
        let (mut filled, mut is_sent) = (0, false);
        let talk = async {
            stream.write_all(&question).await?;
            is_sent = true;
            receive(stream, &mut self.received, &mut filled, open).await
        };
        let limit = self.timeout.as_millis();
        match timeout(self.timeout, talk).await {
            Err(_) if filled == 0 && is_sent => Err(Unanswered::Silent),
            Err(_) if filled == 0 => {
                Err(Unanswered::Broken(format!("the request could not be sent in {limit} ms")))
            }
            Err(_) => {
                Err(Unanswered::Broken(format!("no whole answer in {limit} ms{REST_IS_LATE}")))
            }
            Ok(Err(error)) if filled == 0 && is_closed(&error) => {
                Err(Unanswered::Closed(error.to_string()))
            }
            Ok(Err(error)) => Err(Unanswered::Broken(error.to_string())),
            Ok(Ok(())) => Ok(filled),
        }
    }

    /// Handles a silence: decides whether the connection stays.
    fn miss(&mut self) -> String {
        self.lost = self.lost.saturating_add(1);
        self.pace.miss();
        let hint = match self.pace.hint() {
            SilenceHint::SinceOpening => NONE_SINCE_CONNECTING,
            SilenceHint::AfterAnswer => NONE_AFTER_ANSWER,
            SilenceHint::None => "",
        };
        // Without transactions, a late answer would be taken for the next one.
        if self.settings.transaction == Transaction::Ignore || self.pace.is_over(&self.habits) {
            self.stream = None;
        }
        format!("no answer in {} ms{hint}", self.timeout.as_millis())
    }
}

/// Why a question has no answer.
enum Unanswered {
    Silent,
    Closed(String),
    Broken(String),
}

/// What may help a peer that has not answered since connecting.
const NONE_SINCE_CONNECTING: &str = ", and none since connecting: try `connect-delay`, a longer \
     `timeout`, another `unit`; for a serial server, `driver = \"modbus-rtu\"` with \
     `port = \"tcp://…\"`";
/// What may help a peer that answers a request, but not the next one.
pub(super) const NONE_AFTER_ANSWER: &str =
    ", though the request before it was answered: try `pause`, or a longer `timeout`";

/// What may help if only the beginning of an answer came.
pub(super) const REST_IS_LATE: &str = "; if the rest was only late, set a longer `timeout`";

impl PeerLink for TcpConnection {
    const STARTS_ANEW: bool = false;

    async fn connect(&mut self) -> Result<(), ExchangeFailure> {
        self.open().await.map_err(ExchangeFailure::disconnected)
    }

    async fn ask(
        &mut self,
        unit: u8,
        request: &[u8],
        answer: &mut Vec<u8>,
    ) -> Result<(), LinkFailure> {
        let is_per_request = self.settings.peer.connection == ConnectionUse::PerRequest;
        if self.stream.is_none() && is_per_request {
            self.open().await.map_err(LinkFailure::Broken)?;
        }
        self.transaction = self.transaction.wrapping_add(1);
        let header = FrameHeader { transaction: self.transaction, unit };
        let done = self.exchange(header, request).await;
        self.pace.end(&self.habits);
        let done = match done {
            Ok(filled) => {
                let received = &self.received[..filled];
                let question = SentQuestion { header, request };
                let checked = check(received, question, self.settings.transaction, answer);
                checked.map_err(LinkFailure::Broken)
            }
            Err(Unanswered::Silent) => Err(LinkFailure::Silent(self.miss())),
            Err(Unanswered::Closed(reason)) if self.pace.is_proven() => {
                Err(LinkFailure::Closed(reason))
            }
            Err(Unanswered::Closed(reason) | Unanswered::Broken(reason)) => {
                Err(LinkFailure::Broken(reason))
            }
        };
        if done.is_ok() {
            self.lost = 0;
            self.pace.answer();
        }
        if is_per_request {
            self.stream = None;
        }
        done
    }

    fn is_broadcast(&self, _: u8) -> bool {
        // By Modbus TCP, unit 0 is the peer itself, which answers.
        false
    }

    async fn broadcast(&mut self, _: &[u8]) -> Result<(), LinkFailure> {
        Err(LinkFailure::Broken("Modbus TCP has no broadcasts".to_owned()))
    }

    fn is_usable(&self) -> bool {
        self.stream.is_some() || self.settings.peer.connection == ConnectionUse::PerRequest
    }

    fn close(&mut self) {
        self.stream = None;
    }
}

/// A new connection to a peer, or the reason for the log.
pub(super) async fn connect(peer: &TcpPeer) -> Result<TcpStream, String> {
    let limit = Duration::from_millis(peer.connect_timeout_ms.into());
    let stream = match timeout(limit, TcpStream::connect(peer.address)).await {
        Err(_) => return Err(format!("no connection: none in {} ms", limit.as_millis())),
        Ok(Err(error)) => return Err(format!("no connection: {error}")),
        Ok(Ok(stream)) => stream,
    };
    // Questions are sent without delay: each is one small packet, and the client waits for its
    // answer.
    let _ = stream.set_nodelay(true);
    Ok(stream)
}

/// The transactions whose answers may come.
#[derive(Clone, Copy)]
struct OpenTransactions {
    /// The present one.
    present: u16,
    /// The number of those directly before it that had no answer in time.
    lost: u16,
}

/// Receives until the bytes are a whole frame, or cannot become one. Skips the answers to lost
/// transactions.
async fn receive(
    stream: &mut TcpStream,
    bytes: &mut [u8],
    filled: &mut usize,
    OpenTransactions { present, lost }: OpenTransactions,
) -> io::Result<()> {
    loop {
        // The buffer has room for the longest frame.
        match stream.read(&mut bytes[*filled..]).await? {
            0 => return Err(closed()),
            count => *filled += count,
        }
        loop {
            match frame::split(&bytes[..*filled]) {
                FrameSplit::More => break,
                FrameSplit::Frame { header, bytes: end, .. }
                    if (1..=lost).contains(&present.wrapping_sub(header.transaction)) =>
                {
                    bytes.copy_within(end..*filled, 0);
                    *filled -= end;
                }
                FrameSplit::Frame { .. } | FrameSplit::Broken(_) => return Ok(()),
            }
        }
    }
}

/// The end of a connection, as an error.
pub(super) fn closed() -> io::Error {
    io::Error::new(UnexpectedEof, "the peer has closed the connection")
}

/// Whether the peer has closed the connection, properly or not.
pub(super) fn is_closed(error: &io::Error) -> bool {
    matches!(error.kind(), UnexpectedEof | ConnectionReset | ConnectionAborted | BrokenPipe)
}

/// A question that was sent.
struct SentQuestion<'a> {
    header: FrameHeader,
    /// Its PDU.
    request: &'a [u8],
}

/// Takes the answer's PDU out of the received bytes.
fn check(
    received: &[u8],
    SentQuestion { header: asked, request }: SentQuestion,
    transaction: Transaction,
    answer: &mut Vec<u8>,
) -> Result<(), String> {
    let is_other = |header: FrameHeader| {
        transaction == Transaction::Check && header.transaction != asked.transaction
    };
    match frame::split(received) {
        FrameSplit::More => Err("no whole answer".to_owned()),
        FrameSplit::Broken(_) if rtu::find(received, asked.unit, request).is_some() => {
            Err("the answer is a frame of Modbus RTU: `driver = \"modbus-rtu\"` with \
                 `port = \"tcp://…\"` reads it"
                .to_owned())
        }
        FrameSplit::Broken(broken) => Err(broken.to_string()),
        FrameSplit::Frame { header, .. } if is_other(header) => {
            Err("the answer is to a different question (transaction): for a device that always \
                 answers so, set `transaction = \"ignore\"`"
                .to_owned())
        }
        FrameSplit::Frame { header, .. } if header.unit != asked.unit => {
            let (unit, wanted) = (header.unit, asked.unit);
            Err(format!("the answer is unit {unit}'s, not unit {wanted}'s: try `unit = {unit}`"))
        }
        FrameSplit::Frame { bytes, .. } if bytes < received.len() => {
            Err("there are more bytes after the answer".to_owned())
        }
        FrameSplit::Frame { pdu, .. } => {
            answer.clear();
            answer.extend_from_slice(pdu);
            Ok(())
        }
    }
}
