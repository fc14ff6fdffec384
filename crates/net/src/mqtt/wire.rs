//! The protocol of a session, without sockets and time: it encodes the caller's requests and
//! decodes the broker's bytes. `session` moves the bytes; fuzzing uses `conversation`.
//!
//! `mqtt-protocol-core` encodes and decodes packets, and keeps the numbers of packets without an
//! answer. It would accept some packets at the wrong time (a second CONNACK): `heard` refuses them.
//! Messages that are too long do not reach it (`skip`). After a failure, nothing more may be passed
//! to it.

use std::collections::VecDeque;
use std::time::Duration;

use mqtt_protocol_core::mqtt::common::Cursor;
use mqtt_protocol_core::mqtt::connection::{ConnectionOptions, Event};
use mqtt_protocol_core::mqtt::packet::{
    self, GenericPacketTrait as _, Packet, Property, v3_1_1, v5_0,
};
use mqtt_protocol_core::mqtt::result_code::{ConnectReasonCode, MqttError};
use mqtt_protocol_core::mqtt::{Connection, Version, role};

use super::failure::MqttCause;
use super::packets::{self, OutMessage};
use super::settings::{BrokerSettings, LastWill, MqttVersion, Qos};
use super::skip::{LongMessage, PacketSieve, SiftedBytes};

/// The maximum number of messages of QoS 1 without an acknowledgement; a broker of MQTT 5 may allow
/// fewer.
const IN_FLIGHT_MAX: u16 = 256;

/// The maximum number of filters of a subscription.
const FILTERS_MAX: usize = 64;

const NO_CONNACK: &str = "its first packet is not a CONNACK";

/// An event that a session returns to its caller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MqttEvent {
    /// A message of a topic that was subscribed to.
    Message {
        /// The topic.
        topic: String,
        /// The payload.
        payload: Vec<u8>,
        /// Whether the broker had retained it: it is older than the subscription.
        retained: bool,
        /// How often it may arrive.
        qos: Qos,
    },
    /// A message that is longer than `packet_bytes_max` was read and discarded.
    LeftOut(LongMessage),
    /// The broker has taken the message with this number, which `publish` returned.
    Acknowledged(u16),
    /// The broker has read everything that was sent before the ping with this number, which `ping`
    /// returned. Numbers rise by one; the session's own pings have numbers too.
    Pong(u64),
}

/// A decoded packet of the broker.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum BrokerPacket {
    /// The session begins; the broker may require a shorter keepalive.
    Welcome(Option<Duration>),
    /// The broker has accepted the subscription with this number.
    Subscribed(u16),
    /// An event for the caller.
    Event(MqttEvent),
}

impl BrokerPacket {
    /// The bytes that it takes in memory.
    pub fn bytes(&self) -> usize {
        let beside = size_of::<BrokerPacket>();
        match self {
            BrokerPacket::Event(MqttEvent::Message { topic, payload, .. }) => {
                beside + topic.len() + payload.len()
            }
            BrokerPacket::Event(MqttEvent::LeftOut(message)) => beside + message.topic.len(),
            BrokerPacket::Event(MqttEvent::Acknowledged(_) | MqttEvent::Pong(_))
            | BrokerPacket::Welcome(_)
            | BrokerPacket::Subscribed(_) => beside,
        }
    }
}

/// The protocol of a session.
pub(super) struct SessionProtocol {
    core: Connection<role::Client>,
    sieve: PacketSieve,
    version: MqttVersion,
    packet_bytes_max: u32,
    is_welcome: bool,
    /// The first bytes from the broker: they show whether it refuses the version.
    beginning: Vec<u8>,
    /// Subscriptions without an answer.
    asked: Vec<(u16, Vec<String>)>,
    in_flight: u16,
    in_flight_max: u16,
    pings: u64,
    pongs: u64,
    out: VecDeque<u8>,
}

impl SessionProtocol {
    /// The protocol of a new session, with its CONNECT queued.
    ///
    /// # Errors
    /// The settings or the will do not fit into a CONNECT.
    pub fn new(
        settings: &BrokerSettings,
        will: Option<&LastWill>,
    ) -> Result<SessionProtocol, MqttCause> {
        let options = ConnectionOptions::new().maximum_packet_size_recv(settings.packet_bytes_max);
        let version = match settings.version {
            MqttVersion::V3 => Version::V3_1_1,
            MqttVersion::V5 => Version::V5_0,
        };
        let core = Connection::with_options(version, options);
        let mut wire = SessionProtocol {
            core,
            sieve: PacketSieve::new(settings.packet_bytes_max),
            version: settings.version,
            packet_bytes_max: settings.packet_bytes_max,
            is_welcome: false,
            beginning: Vec::new(),
            asked: Vec::new(),
            in_flight: 0,
            in_flight_max: IN_FLIGHT_MAX,
            pings: 0,
            pongs: 0,
            out: VecDeque::new(),
        };
        let packet = packets::connect(settings, will);
        let packet = packet.map_err(|error| {
            MqttCause::NotSendable(format!("client id, login or last will ({error})"))
        })?;
        wire.send(Ok(packet), "the CONNECT")?;
        Ok(wire)
    }

    /// The bytes that wait to be sent.
    pub fn out(&mut self) -> &mut VecDeque<u8> {
        &mut self.out
    }

    /// The number of pings without an answer.
    pub fn unanswered(&self) -> u64 {
        self.pings - self.pongs
    }

    /// The message that is too long and is still coming.
    pub fn too_long(&self) -> Option<LongMessage> {
        self.sieve.under_way()
    }

    /// Whether a message of QoS 1 may be sent now.
    pub fn has_place(&self) -> bool {
        self.in_flight < self.in_flight_max
    }

    /// Queues a message. With QoS 1, returns its number.
    ///
    /// # Errors
    /// The message cannot be sent.
    pub fn publish(&mut self, message: &OutMessage<'_>) -> Result<Option<u16>, MqttCause> {
        let what = format!("{} bytes for `{}`", message.payload.len(), message.topic);
        let number = match message.qos {
            Qos::AtMostOnce => None,
            Qos::AtLeastOnce => Some(self.number()?),
        };
        let sent = self.send(packets::publish(self.version, message, number), &what);
        if let (Err(_), Some(number)) = (&sent, number) {
            self.core.release_packet_id(number);
        }
        sent?;
        self.in_flight += u16::from(number.is_some());
        Ok(number)
    }

    /// Queues a subscription, and returns its number.
    ///
    /// # Errors
    /// A filter is not valid, or there are none or too many.
    pub fn subscribe(&mut self, filters: &[(&str, Qos)]) -> Result<u16, MqttCause> {
        if filters.is_empty() || filters.len() > FILTERS_MAX {
            let why =
                format!("a subscription of {} filters, not 1 to {FILTERS_MAX}", filters.len());
            return Err(MqttCause::NotSendable(why));
        }
        let entry = |(filter, qos): &(&str, Qos)| {
            let entry = packets::entry(filter, *qos);
            entry.map_err(|error| MqttCause::NotSendable(format!("filter `{filter}` ({error})")))
        };
        let entries = filters.iter().map(entry).collect::<Result<Vec<_>, _>>()?;
        let number = self.number()?;
        self.send(packets::subscribe(self.version, entries, number), "a subscription")?;
        let filters = filters.iter().map(|(filter, _)| (*filter).to_owned()).collect();
        self.asked.push((number, filters));
        Ok(number)
    }

    /// Queues a ping, and returns its number.
    ///
    /// # Errors
    /// The session has not begun.
    pub fn ping(&mut self) -> Result<u64, MqttCause> {
        self.send(packets::ping(self.version), "a PINGREQ")?;
        self.pings += 1;
        Ok(self.pings)
    }

    /// Queues a DISCONNECT.
    ///
    /// # Errors
    /// The session has not begun.
    pub fn disconnect(&mut self, with_will: bool) -> Result<(), MqttCause> {
        self.send(packets::disconnect(self.version, with_will), "a DISCONNECT")
    }

    fn number(&mut self) -> Result<u16, MqttCause> {
        let number = self.core.acquire_packet_id();
        number.map_err(|error| {
            MqttCause::NotSendable(format!("too many unacknowledged packets ({error})"))
        })
    }

    fn send(&mut self, packet: Result<Packet, MqttError>, what: &str) -> Result<(), MqttCause> {
        let wrong = |error| MqttCause::NotSendable(format!("{what} ({error})"));
        for event in self.core.send(packet.map_err(wrong)?) {
            match event {
                Event::RequestSendPacket { packet, .. } => {
                    self.out.extend(packet.to_continuous_buffer());
                }
                Event::NotifyError(error) => return Err(wrong(error)),
                // `RequestClose` follows a DISCONNECT.
                Event::RequestClose
                | Event::NotifyPacketReceived(_)
                | Event::NotifyPacketIdReleased(_)
                | Event::RequestTimerReset { .. }
                | Event::RequestTimerCancel(_) => {}
            }
        }
        Ok(())
    }

    /// Reads bytes from the broker. Decoded packets are added to `heard`, even if a failure
    /// follows.
    ///
    /// # Errors
    /// The bytes are not valid, or end the session.
    pub fn receive(
        &mut self,
        mut bytes: &[u8],
        heard: &mut VecDeque<BrokerPacket>,
    ) -> Result<(), MqttCause> {
        if !self.is_welcome {
            let missing = 4 - self.beginning.len().min(4);
            self.beginning.extend(bytes.iter().take(missing));
            // A server that is no broker often sends less than the packet that its first bytes
            // announce.
            if self.beginning.first().is_some_and(|first| *first != 0x20) {
                return Err(MqttCause::Garbage(NO_CONNACK.to_owned()));
            }
        }
        let garbage = |what: &str| MqttCause::Garbage(what.to_owned());
        loop {
            match self.sieve.next(&mut bytes).map_err(garbage)? {
                Some(SiftedBytes::Head(head, count)) => self.read(&head[..count], heard)?,
                Some(SiftedBytes::Body(body)) => self.read(body, heard)?,
                Some(SiftedBytes::LeftOut(message, number)) => {
                    // Otherwise the broker would send it again.
                    self.acknowledge(number)?;
                    heard.push_back(BrokerPacket::Event(MqttEvent::LeftOut(message)));
                }
                None => return Ok(()),
            }
        }
    }

    /// Passes bytes to the library.
    fn read(&mut self, bytes: &[u8], heard: &mut VecDeque<BrokerPacket>) -> Result<(), MqttCause> {
        let mut cursor = Cursor::new(bytes);
        while cursor.position() < bytes.len() as u64 {
            for event in self.core.recv(&mut cursor) {
                match event {
                    Event::NotifyPacketReceived(packet) => heard.extend(self.heard(packet)?),
                    Event::RequestSendPacket { packet, .. } => {
                        self.out.extend(packet.to_continuous_buffer());
                    }
                    Event::NotifyError(error) => return Err(self.out_of_order(error)),
                    // An error follows `RequestClose`.
                    Event::RequestClose
                    | Event::NotifyPacketIdReleased(_)
                    | Event::RequestTimerReset { .. }
                    | Event::RequestTimerCancel(_) => {}
                }
            }
        }
        Ok(())
    }

    fn out_of_order(&self, error: MqttError) -> MqttCause {
        // This is how a broker with only MQTT 3.1.1 refuses MQTT 5.
        if !self.is_welcome && self.beginning == [0x20, 2, 0, 1] {
            return MqttCause::Refused(MqttVersion::V5, 0x84);
        }
        if error == MqttError::PacketTooLarge {
            return MqttCause::TooLong(self.packet_bytes_max);
        }
        MqttCause::Garbage(error.to_string())
    }

    fn heard(&mut self, packet: Packet) -> Result<Option<BrokerPacket>, MqttCause> {
        let is_connack = matches!(packet, Packet::V3_1_1Connack(_) | Packet::V5_0Connack(_));
        if is_connack == self.is_welcome {
            let what = if is_connack { "a second CONNACK" } else { NO_CONNACK };
            return Err(MqttCause::Garbage(what.to_owned()));
        }
        match packet {
            Packet::V3_1_1Connack(packet) => self.welcome_3(&packet),
            Packet::V5_0Connack(packet) => self.welcome_5(&packet),
            Packet::V3_1_1Publish(packet) => {
                let (topic, payload) = (packet.topic_name(), packet.payload().as_slice());
                let word = message(topic, payload, packet.qos(), packet.retain())?;
                self.acknowledge(packet.packet_id())?;
                Ok(Some(word))
            }
            Packet::V5_0Publish(packet) => {
                let (topic, payload) = (packet.topic_name(), packet.payload().as_slice());
                let word = message(topic, payload, packet.qos(), packet.retain())?;
                self.acknowledge(packet.packet_id())?;
                Ok(Some(word))
            }
            Packet::V3_1_1Puback(packet) => self.acknowledged(packet.packet_id(), 0),
            Packet::V5_0Puback(packet) => {
                let code = packet.reason_code().map_or(0, |code| code as u8);
                self.acknowledged(packet.packet_id(), code)
            }
            Packet::V3_1_1Suback(packet) => {
                let codes = packet.return_codes().iter().map(|code| *code as u8).collect();
                self.subscribed(packet.packet_id(), codes)
            }
            Packet::V5_0Suback(packet) => {
                let codes = packet.reason_codes().iter().map(|code| *code as u8).collect();
                self.subscribed(packet.packet_id(), codes)
            }
            Packet::V3_1_1Pingresp(_) | Packet::V5_0Pingresp(_) => self.pong(),
            Packet::V5_0Disconnect(packet) => {
                Err(MqttCause::Ended(packet.reason_code().map_or(0, |code| code as u8)))
            }
            Packet::V3_1_1Connect(_)
            | Packet::V3_1_1Subscribe(_)
            | Packet::V3_1_1Unsubscribe(_)
            | Packet::V3_1_1Unsuback(_)
            | Packet::V3_1_1Pubrec(_)
            | Packet::V3_1_1Pubrel(_)
            | Packet::V3_1_1Pubcomp(_)
            | Packet::V3_1_1Disconnect(_)
            | Packet::V3_1_1Pingreq(_)
            | Packet::V5_0Connect(_)
            | Packet::V5_0Subscribe(_)
            | Packet::V5_0Unsubscribe(_)
            | Packet::V5_0Unsuback(_)
            | Packet::V5_0Pubrec(_)
            | Packet::V5_0Pubrel(_)
            | Packet::V5_0Pubcomp(_)
            | Packet::V5_0Pingreq(_)
            | Packet::V5_0Auth(_) => {
                Err(MqttCause::Garbage("one that is not expected in this session".to_owned()))
            }
        }
    }

    /// Acknowledges a message with a number, that is, of QoS 1. The library could do it itself, but
    /// would panic at number 0.
    fn acknowledge(&mut self, number: Option<u16>) -> Result<(), MqttCause> {
        let Some(number) = number else { return Ok(()) };
        let packet = packets::acknowledgement(self.version, number);
        self.send(packet, "an acknowledgement")
            .map_err(|_| MqttCause::Garbage("a message with the number 0".to_owned()))
    }

    fn welcome_3(&mut self, packet: &v3_1_1::Connack) -> Result<Option<BrokerPacket>, MqttCause> {
        match packet.return_code() as u8 {
            0 => {
                self.is_welcome = true;
                Ok(Some(BrokerPacket::Welcome(None)))
            }
            code => Err(MqttCause::Refused(self.version, code)),
        }
    }

    fn welcome_5(&mut self, packet: &v5_0::Connack) -> Result<Option<BrokerPacket>, MqttCause> {
        if packet.reason_code() != ConnectReasonCode::Success {
            return Err(MqttCause::Refused(self.version, packet.reason_code() as u8));
        }
        let mut keepalive = None;
        for property in packet.props() {
            if let Property::ServerKeepAlive(seconds) = property {
                let seconds = Duration::from_secs(u64::from(seconds.val()));
                keepalive = Some(seconds).filter(|seconds| !seconds.is_zero());
            } else if let Property::ReceiveMaximum(count) = property {
                self.in_flight_max = count.val().min(IN_FLIGHT_MAX);
            }
        }
        self.is_welcome = true;
        Ok(Some(BrokerPacket::Welcome(keepalive)))
    }

    fn acknowledged(&mut self, number: u16, code: u8) -> Result<Option<BrokerPacket>, MqttCause> {
        self.in_flight = self.in_flight.saturating_sub(1);
        if code >= 0x80 {
            return Err(MqttCause::MessageRefused(code, number));
        }
        Ok(Some(BrokerPacket::Event(MqttEvent::Acknowledged(number))))
    }

    fn subscribed(
        &mut self,
        number: u16,
        codes: Vec<u8>,
    ) -> Result<Option<BrokerPacket>, MqttCause> {
        let at = self.asked.iter().position(|(asked, _)| *asked == number);
        let filters = at.map(|at| self.asked.swap_remove(at).1).unwrap_or_default();
        if filters.len() != codes.len() {
            let what = format!("a SUBACK of {} for {} filters", codes.len(), filters.len());
            return Err(MqttCause::Garbage(what));
        }
        for (filter, code) in filters.into_iter().zip(codes) {
            if code >= 0x80 {
                return Err(MqttCause::FilterRefused(self.version, code, filter));
            }
        }
        Ok(Some(BrokerPacket::Subscribed(number)))
    }

    fn pong(&mut self) -> Result<Option<BrokerPacket>, MqttCause> {
        if self.unanswered() == 0 {
            return Err(MqttCause::Garbage("a PINGRESP without a PINGREQ".to_owned()));
        }
        self.pongs += 1;
        Ok(Some(BrokerPacket::Event(MqttEvent::Pong(self.pongs))))
    }
}

fn message(
    topic: &str,
    payload: &[u8],
    qos: packet::Qos,
    retained: bool,
) -> Result<BrokerPacket, MqttCause> {
    let qos = match qos {
        packet::Qos::AtMostOnce => Qos::AtMostOnce,
        packet::Qos::AtLeastOnce => Qos::AtLeastOnce,
        packet::Qos::ExactlyOnce => {
            return Err(MqttCause::Garbage("a message of QoS 2".to_owned()));
        }
    };
    if topic.is_empty() || topic.contains(['+', '#', '\0']) {
        return Err(MqttCause::Garbage("a message without a proper topic".to_owned()));
    }
    let (topic, payload) = (topic.to_owned(), payload.to_vec());
    Ok(BrokerPacket::Event(MqttEvent::Message { topic, payload, retained, qos }))
}
