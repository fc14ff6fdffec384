//! The link over TCP: one connection, one question at a time.
//!
//! A frame that does not answer the present question ends the connection, even if it is a late
//! answer to an earlier question: a new connection contains no old frames. Many peers close a
//! connection that was idle for some time. The link detects this only at the next question, and
//! reports it as [`LinkFailure::Closed`]. The link stores one frame at most.

use std::io;
use std::io::ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionReset, UnexpectedEof};
use std::net::SocketAddr;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::link::{Link, LinkFailure};
use crate::io::device::Trouble;
use crate::io::modbus::frame::{self, FRAME_BYTES_MAX, Header, Split};

/// A peer's address, and the connection to it.
pub struct Tcp {
    address: SocketAddr,
    connect_timeout: Duration,
    timeout: Duration,
    stream: Option<TcpStream>,
    /// Whether a question was answered over this connection.
    is_proven: bool,
    transaction: u16,
    received: [u8; FRAME_BYTES_MAX],
}

impl Tcp {
    /// A link that is not connected yet.
    pub fn new(address: SocketAddr, connect_timeout: Duration, timeout: Duration) -> Tcp {
        let received = [0; FRAME_BYTES_MAX];
        let (stream, is_proven, transaction) = (None, false, 0);
        Tcp { address, connect_timeout, timeout, stream, is_proven, transaction, received }
    }
}

impl Link for Tcp {
    const STARTS_ANEW: bool = false;

    async fn connect(&mut self) -> Result<(), Trouble> {
        let refused = |reason: String| Trouble::disconnected(format!("no connection: {reason}"));
        let stream = match timeout(self.connect_timeout, TcpStream::connect(self.address)).await {
            Err(_) => {
                return Err(refused(format!("none in {} ms", self.connect_timeout.as_millis())));
            }
            Ok(Err(error)) => return Err(refused(error.to_string())),
            Ok(Ok(stream)) => stream,
        };
        // Questions are sent without delay: each is one small packet, and the client waits for its
        // answer.
        let _ = stream.set_nodelay(true);
        (self.stream, self.is_proven) = (Some(stream), false);
        Ok(())
    }

    async fn ask(
        &mut self,
        unit: u8,
        request: &[u8],
        answer: &mut Vec<u8>,
    ) -> Result<(), LinkFailure> {
        let Some(stream) = &mut self.stream else {
            return Err(LinkFailure::Broken("there is no connection".to_owned()));
        };
        self.transaction = self.transaction.wrapping_add(1);
        let header = Header { transaction: self.transaction, unit };
        let question = frame::around(header, |frame| frame.extend_from_slice(request));
        let mut filled = 0;
        let talk = async {
            stream.write_all(&question).await?;
            receive(stream, &mut self.received, &mut filled).await
        };
        let limit = self.timeout.as_millis();
        match timeout(self.timeout, talk).await {
            Err(_) if filled == 0 => Err(LinkFailure::Silent(format!("no answer in {limit} ms"))),
            Err(_) => Err(LinkFailure::Broken(format!("no whole answer in {limit} ms"))),
            Ok(Err(error)) if filled == 0 && self.is_proven && is_closed(&error) => {
                Err(LinkFailure::Closed(error.to_string()))
            }
            Ok(Err(error)) => Err(LinkFailure::Broken(error.to_string())),
            Ok(Ok(())) => {
                check(&self.received[..filled], header, answer).map_err(LinkFailure::Broken)?;
                self.is_proven = true;
                Ok(())
            }
        }
    }

    fn close(&mut self) {
        self.stream = None;
    }
}

/// Receives until the bytes are a whole frame, or cannot become one.
async fn receive(stream: &mut TcpStream, bytes: &mut [u8], filled: &mut usize) -> io::Result<()> {
    loop {
        // The buffer has room for the longest frame.
        match stream.read(&mut bytes[*filled..]).await? {
            0 => return Err(io::Error::new(UnexpectedEof, "the peer has closed the connection")),
            count => *filled += count,
        }
        if frame::split(&bytes[..*filled]) != Split::More {
            return Ok(());
        }
    }
}

/// Whether the peer has closed the connection, properly or not.
fn is_closed(error: &io::Error) -> bool {
    matches!(error.kind(), UnexpectedEof | ConnectionReset | ConnectionAborted | BrokenPipe)
}

/// Takes the answer's PDU out of the received bytes.
fn check(received: &[u8], asked: Header, answer: &mut Vec<u8>) -> Result<(), String> {
    match frame::split(received) {
        Split::More => Err("no whole answer".to_owned()),
        Split::Broken(broken) => Err(broken.to_string()),
        Split::Frame { header, .. } if header.transaction != asked.transaction => {
            Err("the answer is to a different question (transaction)".to_owned())
        }
        Split::Frame { header, .. } if header.unit != asked.unit => {
            Err(format!("the answer is unit {}'s, not unit {}'s", header.unit, asked.unit))
        }
        Split::Frame { bytes, .. } if bytes < received.len() => {
            Err("there are more bytes after the answer".to_owned())
        }
        Split::Frame { pdu, .. } => {
            answer.clear();
            answer.extend_from_slice(pdu);
            Ok(())
        }
    }
}
