//! Leaves out messages that are longer than allowed, before the library reads them.
//!
//! `wire` passes in every byte from the broker, and gets back the bytes for the library, packet by
//! packet. Of a PUBLISH that is too long, only the number and the beginning of the topic are kept.
//! Such a message must not end the session: if it is retained, the broker sends it to each new
//! session, and each session would fail. Any other packet passes, whatever its length: the library
//! refuses it if it is too long.
//!
//! This module sends no answers and has no clock: `wire` acknowledges the left-out messages, and
//! `session` limits their time.

use std::fmt;

/// The longest head of a packet: its first byte and a length of up to four bytes.
const HEAD_MAX: usize = 5;

/// The bytes of a topic that are kept.
const TOPIC_MAX: usize = 200;

/// A message that is too long.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LongMessage {
    /// Its topic, or the beginning of it.
    pub topic: String,
    /// The length of its whole packet.
    pub bytes: u32,
    /// The maximum length.
    pub bytes_max: u32,
    /// Whether the broker retains it, and sends it to each new session.
    pub retained: bool,
}

impl fmt::Display for LongMessage {
    /// A description of the message and of its removal, as a part of a sentence.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LongMessage { topic, bytes, bytes_max, retained } = self;
        write!(f, "a message of {bytes} bytes for `{topic}`, above the maximum of {bytes_max}")?;
        if *retained {
            f.write_str(
                " (the broker keeps it and sends it at each connection; an empty retained message \
                 for this topic removes it)",
            )?;
        }
        Ok(())
    }
}

/// A part of the sieve's output.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum SiftedBytes<'b> {
    /// The head of a packet, for the library: the bytes, and how many of them count.
    Head([u8; HEAD_MAX], usize),
    /// Further bytes of this packet.
    Body(&'b [u8]),
    /// The end of a message that was left out. With QoS 1, it has a number.
    LeftOut(LongMessage, Option<u16>),
}

/// The position in the broker's stream of packets.
#[derive(Debug)]
pub(super) struct PacketSieve {
    bytes_max: u32,
    head: [u8; HEAD_MAX],
    /// The number of bytes of the head that have come.
    has: usize,
    /// The number of bytes after the head that are still to come.
    left: usize,
    long: Option<SkippedPacket>,
}

impl PacketSieve {
    /// A sieve at the beginning of a packet.
    pub fn new(bytes_max: u32) -> PacketSieve {
        PacketSieve { bytes_max, head: [0; HEAD_MAX], has: 0, left: 0, long: None }
    }

    /// The message that is being left out.
    pub fn under_way(&self) -> Option<LongMessage> {
        self.long.as_ref().map(|long| long.message(self.bytes_max))
    }

    /// Removes the next part from these bytes and returns it. `None`: no bytes are left.
    ///
    /// # Errors
    /// A too long message is malformed. The text describes the fault.
    pub fn next<'b>(
        &mut self,
        bytes: &mut &'b [u8],
    ) -> Result<Option<SiftedBytes<'b>>, &'static str> {
        while let Some((first, rest)) = bytes.split_first() {
            if self.left == 0 {
                *bytes = rest;
                if let Some((head, has)) = self.begin(*first)? {
                    return Ok(Some(SiftedBytes::Head(head, has)));
                }
                continue;
            }
            let (now, rest) = bytes.split_at(self.left.min(bytes.len()));
            (*bytes, self.left) = (rest, self.left - now.len());
            let Some(long) = &mut self.long else { return Ok(Some(SiftedBytes::Body(now))) };
            long.read(now)?;
            if self.left == 0
                && let Some(long) = self.long.take()
            {
                let number = long.number();
                return Ok(Some(SiftedBytes::LeftOut(long.message(self.bytes_max), number)));
            }
        }
        Ok(None)
    }

    /// Takes a byte of a head. Returns the head if it is complete and the packet is to be read.
    fn begin(&mut self, byte: u8) -> Result<Option<([u8; HEAD_MAX], usize)>, &'static str> {
        self.head[self.has] = byte;
        self.has += 1;
        let is_last = self.has > 1 && byte < 0x80;
        if !is_last && self.has < HEAD_MAX {
            return Ok(None);
        }
        let (head, has) = (self.head, std::mem::take(&mut self.has));
        if !is_last {
            // The library refuses this length.
            return Ok(Some((head, has)));
        }
        let digits = head[1..has].iter().rev();
        self.left = digits.fold(0, |length, digit| length << 7 | usize::from(digit & 0x7f));
        let is_message = head[0] & 0xf0 == 0x30;
        if !is_message || has + self.left <= self.bytes_max as usize {
            return Ok(Some((head, has)));
        }
        self.long = Some(SkippedPacket::new(head[0], has, self.left)?);
        Ok(None)
    }
}

/// The known parts of a message while it is discarded.
#[derive(Debug)]
struct SkippedPacket {
    retained: bool,
    /// Whether it has a number: its QoS is 1.
    numbered: bool,
    /// The lengths of the packet: with its head, and without it.
    bytes: usize,
    length: usize,
    /// The number of bytes after the head that have been read.
    at: usize,
    topic_length: usize,
    topic: Vec<u8>,
    number: u16,
}

impl SkippedPacket {
    fn new(first: u8, head: usize, length: usize) -> Result<SkippedPacket, &'static str> {
        if first & 0b100 != 0 {
            return Err("a message of QoS 2");
        }
        if length < 3 {
            return Err("a message without a topic");
        }
        Ok(SkippedPacket {
            retained: first & 1 != 0,
            numbered: first & 0b10 != 0,
            bytes: head + length,
            length,
            at: 0,
            topic_length: 0,
            topic: Vec::new(),
            number: 0,
        })
    }

    /// Reads further bytes. The topic and the number are at the beginning of the message.
    fn read(&mut self, bytes: &[u8]) -> Result<(), &'static str> {
        for byte in bytes {
            match self.at {
                0 => self.topic_length = usize::from(*byte) << 8,
                1 => {
                    self.topic_length |= usize::from(*byte);
                    self.judge()?;
                }
                at if at < 2 + self.topic_length => {
                    if self.topic.len() < TOPIC_MAX {
                        self.topic.push(*byte);
                    }
                }
                at if at < 4 + self.topic_length => {
                    self.number = self.number << 8 | u16::from(*byte);
                    if at == 3 + self.topic_length && self.number() == Some(0) {
                        return Err("a message with the number 0");
                    }
                }
                _ => return Ok(()),
            }
            self.at += 1;
        }
        Ok(())
    }

    fn judge(&self) -> Result<(), &'static str> {
        let number = if self.numbered { 2 } else { 0 };
        if self.topic_length == 0 {
            return Err("a message without a topic");
        }
        if 2 + self.topic_length + number > self.length {
            return Err("a message that is shorter than its topic");
        }
        Ok(())
    }

    fn number(&self) -> Option<u16> {
        self.numbered.then_some(self.number)
    }

    fn message(&self, bytes_max: u32) -> LongMessage {
        let mut topic = String::from_utf8_lossy(&self.topic).into_owned();
        if self.topic.len() < self.topic_length {
            topic.push('…');
        }
        // A length of MQTT has 28 bits.
        let bytes = u32::try_from(self.bytes).unwrap_or(u32::MAX);
        LongMessage { topic, bytes, bytes_max, retained: self.retained }
    }
}
