//! The frames of OPC UA over TCP (OPC 10000-6, 7.1) as far as the gate judges them: the kind, the
//! length, the policy of a channel, the service of a message that is not encrypted.
//!
//! Called by `gate` with the bytes of a connection in any pieces. Keeps the beginning of a frame
//! alone, never a frame, and decodes no message.

use std::fmt;

/// The longest frame of a peer, bytes: what the server offers as its buffer.
const FRAME_BYTES_MAX: u32 = 65_535;
/// The longest frame of a peer that nobody knows yet, bytes.
const STRANGER_BYTES_MAX: u32 = 16_384;
/// The longest message of a peer, bytes: 4 MiB, with what encryption adds to its frames.
const MESSAGE_BYTES_MAX: u32 = 5 << 20;
/// The length of the header of a frame: kind, chunk, size.
const HEADER_BYTES: usize = 8;
/// How much of a frame is kept: the header, and of an OPN the channel and its policy.
const PREFIX_BYTES_MAX: usize = HEADER_BYTES + 8 + 255;
/// The policy of channels without encryption.
const POLICY_NONE: &[u8] = b"http://opcfoundation.org/UA/SecurityPolicy#None";
/// What everybody may ask: FindServers, GetEndpoints, FindServersOnNetwork, by the ids of their
/// binary encodings.
const DISCOVERY: [u16; 3] = [422, 428, 12208];

/// What a frame is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameKind {
    /// HEL: a client begins.
    Hello,
    /// ACK: the server's answer to it.
    Acknowledge,
    /// OPN: a secure channel, and its renewal.
    Open,
    /// MSG: a message or a part of one.
    Message,
    /// CLO: the end of the channel.
    Close,
    /// ERR: why the server ends the connection.
    Error,
}

/// The beginning of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameStart<'a> {
    /// What it is.
    pub kind: FrameKind,
    /// `F`: the last part of a message, `C`: more follow, `A`: the message is given up.
    pub chunk: u8,
    /// The length of the frame, bytes.
    pub size: u32,
    /// The bytes behind the header, at most as many as the gate needs.
    pub body: &'a [u8],
}

/// Why a connection is closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameRefusal {
    /// The bytes are no frame.
    NotOpcUa,
    /// The frame, or the message with its earlier frames, is too long.
    TooLong,
    /// The frame does not belong here.
    OutOfOrder,
    /// Without encryption nothing but discovery is answered.
    NotEncrypted,
}

impl fmt::Display for FrameRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            FrameRefusal::NotOpcUa => "its bytes are no OPC UA",
            FrameRefusal::TooLong => "its message is too long",
            FrameRefusal::OutOfOrder => "its messages come in a wrong order",
            FrameRefusal::NotEncrypted => "it asks for more than endpoints without encryption",
        })
    }
}

/// Finds the frames in the bytes of one direction.
#[derive(Debug, Default)]
pub struct FrameScanner {
    /// The beginning of the present frame.
    prefix: Vec<u8>,
    /// How many bytes of it are still to come behind what is kept.
    left: usize,
}

impl FrameScanner {
    /// Takes the next bytes. Calls `judge` for each frame as soon as its beginning is complete.
    ///
    /// # Errors
    /// The bytes are no frames, or `judge` refuses one.
    pub fn take(
        &mut self,
        mut bytes: &[u8],
        mut judge: impl FnMut(FrameStart<'_>) -> Result<(), FrameRefusal>,
    ) -> Result<(), FrameRefusal> {
        while !bytes.is_empty() {
            if self.left > 0 {
                let skipped = self.left.min(bytes.len());
                self.left -= skipped;
                bytes = &bytes[skipped..];
                continue;
            }
            let wanted = match self.header()? {
                None => HEADER_BYTES,
                Some((.., size)) => PREFIX_BYTES_MAX.min(size as usize),
            };
            let taken = (wanted - self.prefix.len()).min(bytes.len());
            self.prefix.extend_from_slice(&bytes[..taken]);
            bytes = &bytes[taken..];
            let Some((kind, chunk, size)) = self.header()? else { continue };
            let kept = PREFIX_BYTES_MAX.min(size as usize);
            if self.prefix.len() == kept {
                judge(FrameStart { kind, chunk, size, body: &self.prefix[HEADER_BYTES..] })?;
                self.left = size as usize - kept;
                self.prefix.clear();
            }
        }
        Ok(())
    }

    /// The header of the present frame; `None`: it is not complete.
    fn header(&self) -> Result<Option<(FrameKind, u8, u32)>, FrameRefusal> {
        let [a, b, c, chunk, sizes @ ..] = &self.prefix[..] else { return Ok(None) };
        let Some(size) = sizes.first_chunk() else { return Ok(None) };
        let kind = match [*a, *b, *c] {
            [b'H', b'E', b'L'] => FrameKind::Hello,
            [b'A', b'C', b'K'] => FrameKind::Acknowledge,
            [b'O', b'P', b'N'] => FrameKind::Open,
            [b'M', b'S', b'G'] => FrameKind::Message,
            [b'C', b'L', b'O'] => FrameKind::Close,
            [b'E', b'R', b'R'] => FrameKind::Error,
            _ => return Err(FrameRefusal::NotOpcUa),
        };
        if !b"FCA".contains(chunk) {
            return Err(FrameRefusal::NotOpcUa);
        }
        match u32::from_le_bytes(*size) {
            size if size < HEADER_BYTES as u32 => Err(FrameRefusal::NotOpcUa),
            size if size > FRAME_BYTES_MAX => Err(FrameRefusal::TooLong),
            size => Ok(Some((kind, *chunk, size))),
        }
    }
}

/// The channel that a client asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AskedChannel {
    /// None yet.
    Missing,
    /// Without encryption, where only discovery is answered.
    Discovery,
    /// One in which sessions are possible.
    Usable,
}

/// What a client may send.
#[derive(Debug)]
pub struct ClientRules {
    /// Whether sessions without encryption are possible.
    insecure: bool,
    greeted: bool,
    channel: AskedChannel,
    /// The length of the present message so far, bytes.
    message: u32,
}

impl ClientRules {
    /// The rules for a new connection. `insecure`: sessions without encryption are possible.
    pub fn new(insecure: bool) -> ClientRules {
        ClientRules { insecure, greeted: false, channel: AskedChannel::Missing, message: 0 }
    }

    /// Whether the channel that the client asked for last is one for sessions.
    pub fn wants_session(&self) -> bool {
        self.channel == AskedChannel::Usable
    }

    /// Judges a frame of the client.
    ///
    /// # Errors
    /// The connection must end.
    pub fn judge(&mut self, frame: FrameStart<'_>) -> Result<(), FrameRefusal> {
        let is_first = !std::mem::replace(&mut self.greeted, true);
        if is_first != (frame.kind == FrameKind::Hello) {
            return Err(FrameRefusal::OutOfOrder);
        }
        match frame.kind {
            FrameKind::Hello => short(&frame),
            FrameKind::Open => {
                short(&frame)?;
                let is_none = policy(frame.body)? == POLICY_NONE;
                self.channel = match is_none && !self.insecure {
                    true => AskedChannel::Discovery,
                    false => AskedChannel::Usable,
                };
                Ok(())
            }
            FrameKind::Message => self.message(&frame),
            FrameKind::Close => Ok(()),
            FrameKind::Acknowledge | FrameKind::Error => Err(FrameRefusal::OutOfOrder),
        }
    }

    fn message(&mut self, frame: &FrameStart<'_>) -> Result<(), FrameRefusal> {
        match self.channel {
            AskedChannel::Missing => Err(FrameRefusal::OutOfOrder),
            AskedChannel::Discovery => {
                short(frame)?;
                match service(frame.body) {
                    Some(service) if DISCOVERY.contains(&service) => Ok(()),
                    Some(_) | None => Err(FrameRefusal::NotEncrypted),
                }
            }
            AskedChannel::Usable => {
                self.message = self.message.saturating_add(frame.size);
                if self.message > MESSAGE_BYTES_MAX {
                    return Err(FrameRefusal::TooLong);
                }
                if frame.chunk != b'C' {
                    self.message = 0;
                }
                Ok(())
            }
        }
    }
}

/// Checks a frame of a peer that nobody knows yet: a whole message of moderate length.
fn short(frame: &FrameStart<'_>) -> Result<(), FrameRefusal> {
    if frame.size > STRANGER_BYTES_MAX {
        Err(FrameRefusal::TooLong)
    } else if frame.chunk != b'F' {
        Err(FrameRefusal::NotOpcUa)
    } else {
        Ok(())
    }
}

/// The policy in the body of an OPN: behind the channel's number, as a string.
fn policy(body: &[u8]) -> Result<&[u8], FrameRefusal> {
    let text = body.get(4..).and_then(|rest| rest.split_first_chunk());
    let (length, text) = text.ok_or(FrameRefusal::NotOpcUa)?;
    let length = usize::try_from(u32::from_le_bytes(*length)).unwrap_or(usize::MAX);
    text.get(..length).ok_or(FrameRefusal::NotOpcUa)
}

/// The service in the body of a MSG without encryption: behind the numbers of channel, token,
/// sequence and request, as an id of four bytes.
fn service(body: &[u8]) -> Option<u16> {
    match body.get(16..20)? {
        [1, 0, low, high] => Some(u16::from_le_bytes([*low, *high])),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(kind: &str, size: u32, body: &[u8]) -> Vec<u8> {
        let mut bytes = kind.as_bytes().to_vec();
        bytes.extend(size.to_le_bytes());
        bytes.extend(body);
        bytes.resize(bytes.len().max(size.min(100_000) as usize), 0);
        bytes
    }

    fn hello() -> Vec<u8> {
        frame("HELF", 60, &[])
    }

    fn open(policy: &[u8]) -> Vec<u8> {
        let length = policy.len() as u32;
        let body = [&[0; 4][..], &length.to_le_bytes(), policy].concat();
        frame("OPNF", 8 + body.len() as u32 + 20, &body)
    }

    fn message(kind: &str, size: u32, service: u16) -> Vec<u8> {
        let body = [&[0; 16][..], &[1, 0], &service.to_le_bytes()].concat();
        frame(kind, size, &body)
    }

    /// The answer to frames, in pieces of each length.
    fn judged(insecure: bool, frames: &[Vec<u8>]) -> Result<(), FrameRefusal> {
        let bytes = frames.concat();
        let in_pieces = |length: usize| {
            let (mut scanner, mut rules) = (FrameScanner::default(), ClientRules::new(insecure));
            let mut pieces = bytes.chunks(length);
            pieces.try_for_each(|piece| scanner.take(piece, |frame| rules.judge(frame)))
        };
        let whole = in_pieces(bytes.len());
        for length in [1, 7, 8, 9, 270, 4096] {
            assert_eq!(in_pieces(length), whole, "in pieces of {length}");
        }
        whole
    }

    const SECURE: &[u8] = b"http://opcfoundation.org/UA/SecurityPolicy#Basic256Sha256";

    #[test]
    fn without_encryption_only_discovery_is_let_in() {
        for service in [422, 428, 12208] {
            let asks = message("MSGF", 100, service);
            assert_eq!(judged(false, &[hello(), open(POLICY_NONE), asks]), Ok(()));
        }
        // CreateSession, a part of a message, an id in another form.
        let refused = Err(FrameRefusal::NotEncrypted);
        for (asks, answer) in [
            (message("MSGF", 100, 461), refused),
            (message("MSGC", 100, 428), Err(FrameRefusal::NotOpcUa)),
            (frame("MSGF", 100, &[0; 50]), refused),
            (message("MSGF", 20, 428), refused),
        ] {
            assert_eq!(judged(false, &[hello(), open(POLICY_NONE), asks]), answer);
        }
        let session = message("MSGF", 100, 461);
        assert_eq!(judged(true, &[hello(), open(POLICY_NONE), session.clone()]), Ok(()));
        let back = [hello(), open(SECURE), session.clone(), open(POLICY_NONE), session];
        assert_eq!(judged(false, &back), refused);
    }

    #[test]
    fn no_length_of_a_stranger_is_believed() {
        for size in [0, 7, 65_536, 1 << 31, u32::MAX] {
            let refusal = if size < 8 { FrameRefusal::NotOpcUa } else { FrameRefusal::TooLong };
            for kind in ["HELF", "OPNF", "MSGF"] {
                assert_eq!(judged(false, &[frame(kind, size, &[])]), Err(refusal), "{kind} {size}");
            }
        }
        let long = frame("HELF", 20_000, &[]);
        assert_eq!(judged(false, &[long]), Err(FrameRefusal::TooLong));
        let liar = frame("OPNF", 100, &[0, 0, 0, 0, 255, 255, 255, 255, 1]);
        assert_eq!(judged(false, &[hello(), liar]), Err(FrameRefusal::NotOpcUa));
        let part = message("MSGC", 65_535, 461);
        let many = |count: usize| {
            let parts = std::iter::repeat_n(part.clone(), count);
            [hello(), open(SECURE)].into_iter().chain(parts).collect::<Vec<_>>()
        };
        assert_eq!(judged(false, &many(80)), Ok(()));
        assert_eq!(judged(false, &many(81)), Err(FrameRefusal::TooLong));
        let ended = [many(60), vec![message("MSGF", 65_535, 1)], many(60)[2..].to_vec()].concat();
        assert_eq!(judged(false, &ended), Ok(()));
    }

    #[test]
    fn frames_come_in_their_order() {
        let outside = Err(FrameRefusal::OutOfOrder);
        assert_eq!(judged(false, &[open(SECURE)]), outside);
        assert_eq!(judged(false, &[hello(), hello()]), outside);
        assert_eq!(judged(false, &[hello(), message("MSGF", 100, 428)]), outside);
        assert_eq!(judged(false, &[hello(), frame("ACKF", 20, &[])]), outside);
        assert_eq!(judged(false, &[hello(), frame("CLOF", 20, &[])]), Ok(()));
        assert_eq!(judged(false, &[b"GET / HTTP/1.1\r\n".to_vec()]), Err(FrameRefusal::NotOpcUa));
    }
}
