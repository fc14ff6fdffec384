//! Reads and writes the MQTT packets that a recording broker needs. Written from the standard's
//! text, without the library that `crates/net/src/mqtt` uses.

use std::io::{Error, ErrorKind, Read, Result, Write};

use super::story::{Connect, Published};

/// A packet from a client.
#[derive(Debug)]
pub enum Packet {
    Connect(Connect),
    /// With the packet's number if the client requests an acknowledgement.
    Publish(Published, Option<u16>),
    Subscribe(u16, Vec<(String, u8)>),
    /// An acknowledgement of the client.
    Acknowledged,
    Ping,
    Disconnect(u8),
}

/// The bytes of a packet after its fixed header.
struct Body<'b> {
    bytes: &'b [u8],
    version: u8,
}

fn wrong(what: &str) -> Error {
    Error::new(ErrorKind::InvalidData, what.to_owned())
}

impl<'b> Body<'b> {
    fn take(&mut self, count: usize) -> Result<&'b [u8]> {
        if self.bytes.len() < count {
            return Err(wrong("the packet is too short"));
        }
        let (taken, rest) = self.bytes.split_at(count);
        self.bytes = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8> {
        Ok(self.take(1)?[0])
    }

    fn number(&mut self) -> Result<u16> {
        let bytes = self.take(2)?;
        Ok(u16::from_be_bytes([bytes[0], bytes[1]]))
    }

    fn binary(&mut self) -> Result<Vec<u8>> {
        let count = self.number()?;
        Ok(self.take(count.into())?.to_vec())
    }

    fn text(&mut self) -> Result<String> {
        String::from_utf8(self.binary()?).map_err(|_| wrong("a text is not UTF-8"))
    }

    fn varint(&mut self) -> Result<usize> {
        let mut value = 0;
        for place in 0..4 {
            let byte = self.byte()?;
            value |= usize::from(byte & 0x7f) << (7 * place);
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(wrong("a length has more than four bytes"))
    }

    /// The properties of MQTT 5; empty in older versions.
    fn properties(&mut self) -> Result<&'b [u8]> {
        if self.version < 5 {
            return Ok(&[]);
        }
        let count = self.varint()?;
        self.take(count)
    }
}

/// The session expiry among the properties of CONNECT. Clients here send no other property of four
/// bytes except the packet size; the order does not matter.
fn session_expiry_s(mut properties: &[u8]) -> Result<u32> {
    while let Some((id, rest)) = properties.split_first() {
        let size = match id {
            0x11 | 0x27 => 4,
            0x21 | 0x22 => 2,
            0x17 | 0x19 => 1,
            _ => return Err(wrong("a property of CONNECT that is not known here")),
        };
        if rest.len() < size {
            return Err(wrong("a property is too short"));
        }
        if *id == 0x11 {
            return Ok(u32::from_be_bytes([rest[0], rest[1], rest[2], rest[3]]));
        }
        properties = &rest[size..];
    }
    Ok(0)
}

/// Reads a packet; `None` at the end of the connection. `version` is the connection's, 0 before
/// CONNECT.
pub fn read(stream: &mut impl Read, version: u8, now_ms: u64) -> Result<Option<Packet>> {
    let mut head = [0];
    if stream.read(&mut head)? == 0 {
        return Ok(None);
    }
    let (mut length, mut place) = (0_usize, 0);
    loop {
        let mut byte = [0];
        stream.read_exact(&mut byte)?;
        length |= usize::from(byte[0] & 0x7f) << (7 * place);
        place += 1;
        if byte[0] & 0x80 == 0 {
            break;
        }
        if place == 4 {
            return Err(wrong("a length has more than four bytes"));
        }
    }
    let mut bytes = vec![0; length];
    stream.read_exact(&mut bytes)?;
    let body = Body { bytes: &bytes, version };
    let (kind, flags) = (head[0] >> 4, head[0] & 15);
    Ok(Some(match kind {
        1 => connect(body, now_ms)?,
        3 => publish(body, flags, now_ms)?,
        4..=7 => Packet::Acknowledged,
        8 => subscribe(body)?,
        12 => Packet::Ping,
        14 => Packet::Disconnect(bytes.first().copied().unwrap_or(0)),
        _ => return Err(wrong("a packet that no client sends")),
    }))
}

fn connect(mut body: Body, now_ms: u64) -> Result<Packet> {
    if body.text()? != "MQTT" {
        return Err(wrong("no MQTT"));
    }
    body.version = body.byte()?;
    let flags = body.byte()?;
    body.number()?;
    let session_expiry_s = session_expiry_s(body.properties()?)?;
    body.text()?;
    let will = if flags & 4 == 0 {
        None
    } else {
        body.properties()?;
        let (topic, payload) = (body.text()?, body.binary()?);
        let (qos, retain) = (flags >> 3 & 3, flags & 0x20 != 0);
        Some(Published { topic, payload, qos, retain, at_ms: now_ms })
    };
    let clean = flags & 2 != 0;
    Ok(Packet::Connect(Connect {
        version: body.version,
        clean,
        session_expiry_s,
        will,
        at_ms: now_ms,
    }))
}

fn publish(mut body: Body, flags: u8, now_ms: u64) -> Result<Packet> {
    let topic = body.text()?;
    let qos = flags >> 1 & 3;
    let number = if qos > 0 { Some(body.number()?) } else { None };
    body.properties()?;
    let (payload, retain) = (body.bytes.to_vec(), flags & 1 != 0);
    Ok(Packet::Publish(Published { topic, payload, qos, retain, at_ms: now_ms }, number))
}

fn subscribe(mut body: Body) -> Result<Packet> {
    let number = body.number()?;
    body.properties()?;
    let mut filters = Vec::new();
    while !body.bytes.is_empty() {
        filters.push((body.text()?, body.byte()? & 3));
    }
    Ok(Packet::Subscribe(number, filters))
}

/// Writes a packet.
fn write(stream: &mut impl Write, head: u8, body: &[u8]) -> Result<()> {
    let mut bytes = vec![head];
    let mut length = body.len();
    loop {
        let more = if length > 127 { 0x80 } else { 0 };
        bytes.push((length & 0x7f) as u8 | more);
        length >>= 7;
        if length == 0 {
            break;
        }
    }
    bytes.extend_from_slice(body);
    stream.write_all(&bytes)
}

/// Writes CONNACK: the session begins.
pub fn welcome(stream: &mut impl Write, version: u8) -> Result<()> {
    let body: &[u8] = if version == 5 { &[0, 0, 0] } else { &[0, 0] };
    write(stream, 0x20, body)
}

/// Writes PUBACK.
pub fn acknowledge(stream: &mut impl Write, number: u16) -> Result<()> {
    write(stream, 0x40, &number.to_be_bytes())
}

/// Writes SUBACK: each filter with the requested QoS.
pub fn accept(
    stream: &mut impl Write,
    version: u8,
    number: u16,
    filters: &[(String, u8)],
) -> Result<()> {
    let mut body = number.to_be_bytes().to_vec();
    if version == 5 {
        body.push(0);
    }
    body.extend(filters.iter().map(|(_, qos)| *qos));
    write(stream, 0x90, &body)
}

/// Writes PINGRESP.
pub fn pong(stream: &mut impl Write) -> Result<()> {
    write(stream, 0xd0, &[])
}

/// Writes PUBLISH with QoS 1 and a number.
pub fn deliver(
    stream: &mut impl Write,
    version: u8,
    number: u16,
    message: &Published,
) -> Result<()> {
    let topic = message.topic.as_bytes();
    let mut body = (topic.len() as u16).to_be_bytes().to_vec();
    body.extend_from_slice(topic);
    body.extend_from_slice(&number.to_be_bytes());
    if version == 5 {
        body.push(0);
    }
    body.extend_from_slice(&message.payload);
    write(stream, 0x32 | u8::from(message.retain), &body)
}
