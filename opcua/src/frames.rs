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
/// How much of a frame is kept: the header and the ids of a message.
const PREFIX_BYTES_MAX: usize = HEADER_BYTES + 20;
/// The same of an OPN: the channel, its policy and its certificates.
const OPEN_BYTES_MAX: usize = 8192;
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
                Some((kind, _, size)) => kept(kind, size),
            };
            let taken = (wanted - self.prefix.len()).min(bytes.len());
            self.prefix.extend_from_slice(&bytes[..taken]);
            bytes = &bytes[taken..];
            let Some((kind, chunk, size)) = self.header()? else { continue };
            let kept = kept(kind, size);
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

/// How much of a frame is kept, bytes.
fn kept(kind: FrameKind, size: u32) -> usize {
    let most = match kind {
        FrameKind::Open => OPEN_BYTES_MAX,
        FrameKind::Hello
        | FrameKind::Acknowledge
        | FrameKind::Message
        | FrameKind::Close
        | FrameKind::Error => PREFIX_BYTES_MAX,
    };
    most.min(size as usize)
}

/// The channel of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ClientChannel {
    /// None is asked for yet.
    Missing,
    /// Not opened by the server yet, or without encryption: only discovery is answered.
    Discovery,
    /// Opened by the server, with a certificate that nobody trusts: the library looks for that
    /// only when a session begins.
    Untrusted,
    /// Opened by the server for somebody who may have a session.
    Usable,
}

/// What a client may send.
#[derive(Debug)]
pub struct ClientRules {
    /// Whether sessions without encryption are possible.
    insecure: bool,
    greeted: bool,
    channel: ClientChannel,
    /// Whether the channel that the client asked for last is one for discovery alone.
    asks_discovery: bool,
    /// The length of the present message so far, bytes.
    message: u32,
}

impl ClientRules {
    /// The rules for a new connection. `insecure`: sessions without encryption are possible.
    pub fn new(insecure: bool) -> ClientRules {
        let channel = ClientChannel::Missing;
        ClientRules { insecure, greeted: false, channel, asks_discovery: true, message: 0 }
    }

    /// Takes the OPN with which the server opens a channel or renews it: what the client asks for
    /// alone makes nobody known. `trusts` is given the thumbprint of the client's certificate.
    /// Returns whether the client may have a session.
    ///
    /// # Errors
    /// The body is not that of an OPN.
    pub fn opened(
        &mut self,
        body: &[u8],
        trusts: impl FnOnce(&[u8]) -> bool,
    ) -> Result<bool, FrameRefusal> {
        let (policy, rest) = policy(body)?;
        self.channel = if self.asks_discovery || (policy == POLICY_NONE && !self.insecure) {
            ClientChannel::Discovery
        } else if policy == POLICY_NONE || self.channel == ClientChannel::Usable {
            ClientChannel::Usable
        } else {
            let (_, rest) = byte_string(rest)?;
            let (thumbprint, _) = byte_string(rest)?;
            if trusts(thumbprint) { ClientChannel::Usable } else { ClientChannel::Untrusted }
        };
        Ok(self.channel == ClientChannel::Usable)
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
                self.asks_discovery = policy(frame.body)?.0 == POLICY_NONE && !self.insecure;
                if self.asks_discovery || self.channel == ClientChannel::Missing {
                    self.channel = ClientChannel::Discovery;
                }
                Ok(())
            }
            FrameKind::Message => self.message(&frame),
            FrameKind::Close => Ok(()),
            FrameKind::Acknowledge | FrameKind::Error => Err(FrameRefusal::OutOfOrder),
        }
    }

    fn message(&mut self, frame: &FrameStart<'_>) -> Result<(), FrameRefusal> {
        match self.channel {
            ClientChannel::Missing => Err(FrameRefusal::OutOfOrder),
            ClientChannel::Discovery => {
                short(frame)?;
                match service(frame.body) {
                    Some(service) if DISCOVERY.contains(&service) => Ok(()),
                    Some(_) | None => Err(FrameRefusal::NotEncrypted),
                }
            }
            ClientChannel::Untrusted => short(frame),
            ClientChannel::Usable => {
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

/// The policy in the body of an OPN, which stands behind the channel's number, and what follows.
fn policy(body: &[u8]) -> Result<(&[u8], &[u8]), FrameRefusal> {
    byte_string(body.get(4..).ok_or(FrameRefusal::NotOpcUa)?)
}

/// A string at the beginning of bytes, and what follows.
fn byte_string(bytes: &[u8]) -> Result<(&[u8], &[u8]), FrameRefusal> {
    let (length, text) = bytes.split_first_chunk().ok_or(FrameRefusal::NotOpcUa)?;
    let length = usize::try_from(u32::from_le_bytes(*length)).unwrap_or(usize::MAX);
    text.split_at_checked(length).ok_or(FrameRefusal::NotOpcUa)
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
        opened_for(policy, TRUSTED)
    }

    /// The OPN with which a server answers somebody with this thumbprint.
    fn opened_for(policy: &[u8], thumbprint: &[u8]) -> Vec<u8> {
        let string = |text: &[u8]| [&(text.len() as u32).to_le_bytes(), text].concat();
        let body = [&[0; 4][..], &string(policy), &string(&[7; 1200]), &string(thumbprint)];
        let body = body.concat();
        frame("OPNF", 8 + body.len() as u32 + 20, &body)
    }

    fn message(kind: &str, size: u32, service: u16) -> Vec<u8> {
        let body = [&[0; 16][..], &[1, 0], &service.to_le_bytes()].concat();
        frame(kind, size, &body)
    }

    /// Judges a frame; a channel that is asked for is opened by the server as it is asked for.
    fn answered(rules: &mut ClientRules, frame: FrameStart<'_>) -> Result<(), FrameRefusal> {
        rules.judge(frame)?;
        if frame.kind == FrameKind::Open {
            rules.opened(frame.body, |thumbprint| thumbprint == TRUSTED)?;
        }
        Ok(())
    }

    /// The answer to frames, in pieces of each length.
    fn judged(insecure: bool, frames: &[Vec<u8>]) -> Result<(), FrameRefusal> {
        let bytes = frames.concat();
        let in_pieces = |length: usize| {
            let (mut scanner, mut rules) = (FrameScanner::default(), ClientRules::new(insecure));
            let mut pieces = bytes.chunks(length);
            pieces.try_for_each(|piece| scanner.take(piece, |frame| answered(&mut rules, frame)))
        };
        let whole = in_pieces(bytes.len());
        for length in [1, 7, 8, 9, 270, 4096] {
            assert_eq!(in_pieces(length), whole, "in pieces of {length}");
        }
        whole
    }

    const TRUSTED: &[u8] = &[1; 20];
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
    fn a_channel_is_usable_when_the_server_has_opened_it_and_not_when_it_is_asked_for() {
        let mut rules = ClientRules::new(false);
        let asks = |rules: &mut ClientRules, bytes: &[u8]| {
            FrameScanner::default().take(bytes, |frame| rules.judge(frame))
        };
        let opens = |rules: &mut ClientRules, policy: &[u8], thumbprint: &[u8]| {
            rules.opened(&opened_for(policy, thumbprint)[8..], |known| known == TRUSTED)
        };
        let session = message("MSGF", 100, 461);
        // In one write: a channel without encryption, and the begin of a request for one with it.
        let attack = [hello(), open(POLICY_NONE), open(SECURE)].concat();
        assert_eq!(asks(&mut rules, &attack), Ok(()));
        assert_eq!(opens(&mut rules, POLICY_NONE, &[]), Ok(false));
        assert_eq!(asks(&mut rules, &session), Err(FrameRefusal::NotEncrypted));
        // With a certificate that nobody trusts a session may be asked for, in a short message.
        assert_eq!(opens(&mut rules, SECURE, &[2; 20]), Ok(false));
        assert_eq!(asks(&mut rules, &session), Ok(()));
        let long = message("MSGF", 20_000, 461);
        assert_eq!(asks(&mut rules, &long), Err(FrameRefusal::TooLong));
        assert_eq!(opens(&mut rules, SECURE, TRUSTED), Ok(true));
        assert_eq!(asks(&mut rules, &long), Ok(()));
        // A renewal keeps it; a late answer does not bring it back if discovery is asked for.
        assert_eq!(asks(&mut rules, &open(SECURE)), Ok(()));
        assert_eq!(asks(&mut rules, &long), Ok(()));
        assert_eq!(asks(&mut rules, &open(POLICY_NONE)), Ok(()));
        assert_eq!(opens(&mut rules, SECURE, TRUSTED), Ok(false));
        assert_eq!(asks(&mut rules, &session), Err(FrameRefusal::NotEncrypted));
        let broken = &open(SECURE)[8..200];
        assert_eq!(asks(&mut rules, &open(SECURE)), Ok(()));
        assert_eq!(rules.opened(broken, |_| true), Err(FrameRefusal::NotOpcUa));
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
