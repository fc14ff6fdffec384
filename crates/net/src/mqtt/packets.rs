//! The packets of a client, in both versions of the protocol. `wire` sends them.

use std::time::Duration;

use mqtt_protocol_core::mqtt::packet::{self, Packet, SubEntry, SubOpts, v3_1_1, v5_0};
use mqtt_protocol_core::mqtt::result_code::{DisconnectReasonCode, MqttError};

use super::settings::{BrokerSettings, LastWill, MqttVersion, Qos};

/// CONNECT, with a clean session: no earlier session is continued.
pub(super) fn connect(
    settings: &BrokerSettings,
    will: Option<&LastWill>,
) -> Result<Packet, MqttError> {
    let id = settings.client_id.as_str();
    let seconds = seconds(settings.keepalive);
    // Both builders have the same methods, but no common trait.
    macro_rules! built {
        ($builder:expr) => {{
            let mut packet = $builder.client_id(id)?.clean_start(true).keep_alive(seconds);
            if let Some(LastWill { topic, payload, qos, retain }) = will {
                let topic = topic.as_str();
                packet = packet.will_message(topic, payload, level(*qos), *retain)?;
            }
            if let Some(login) = &settings.login {
                packet = packet.user_name(login.user.as_str())?;
                packet = packet.password(login.password.as_str())?;
            }
            packet.build().map(Packet::from)
        }};
    }
    match settings.version {
        MqttVersion::V3 => built!(v3_1_1::Connect::builder()),
        MqttVersion::V5 => built!(v5_0::Connect::builder()),
    }
}

/// The keepalive for MQTT: a whole number of seconds, at least 1, because 0 means no keepalive.
fn seconds(keepalive: Duration) -> u16 {
    let whole = keepalive.as_secs() + u64::from(keepalive.subsec_nanos() > 0);
    u16::try_from(whole).unwrap_or(u16::MAX).max(1)
}

/// A message to send.
pub(super) struct OutMessage<'m> {
    pub topic: &'m str,
    pub payload: &'m [u8],
    pub qos: Qos,
    pub retain: bool,
}

/// PUBLISH. With QoS 1, it has a number.
pub(super) fn publish(
    version: MqttVersion,
    message: &OutMessage<'_>,
    number: Option<u16>,
) -> Result<Packet, MqttError> {
    let OutMessage { topic, payload, qos, retain } = *message;
    if topic.contains('\0') {
        return Err(MqttError::TopicNameInvalid);
    }
    let qos = level(qos);
    match version {
        MqttVersion::V3 => {
            let packet = v3_1_1::Publish::builder().topic_name(topic)?.qos(qos).retain(retain);
            packet.packet_id(number).payload(payload).build().map(Packet::from)
        }
        MqttVersion::V5 => {
            let packet = v5_0::Publish::builder().topic_name(topic)?.qos(qos).retain(retain);
            packet.packet_id(number).payload(payload).build().map(Packet::from)
        }
    }
}

/// One filter of a subscription.
pub(super) fn entry(filter: &str, qos: Qos) -> Result<SubEntry, MqttError> {
    if filter.is_empty() || filter.contains('\0') {
        return Err(MqttError::TopicFilterInvalid);
    }
    SubEntry::new(filter, SubOpts::new().set_qos(level(qos)))
}

/// SUBSCRIBE.
pub(super) fn subscribe(
    version: MqttVersion,
    entries: Vec<SubEntry>,
    number: u16,
) -> Result<Packet, MqttError> {
    match version {
        MqttVersion::V3 => {
            let packet = v3_1_1::Subscribe::builder().packet_id(number).entries(entries);
            packet.build().map(Packet::from)
        }
        MqttVersion::V5 => {
            let packet = v5_0::Subscribe::builder().packet_id(number).entries(entries);
            packet.build().map(Packet::from)
        }
    }
}

/// PUBACK: the answer to a message of QoS 1. Number 0 is not valid.
pub(super) fn acknowledgement(version: MqttVersion, number: u16) -> Result<Packet, MqttError> {
    match version {
        MqttVersion::V3 => v3_1_1::Puback::builder().packet_id(number).build().map(Packet::from),
        MqttVersion::V5 => v5_0::Puback::builder().packet_id(number).build().map(Packet::from),
    }
}

/// PINGREQ.
pub(super) fn ping(version: MqttVersion) -> Result<Packet, MqttError> {
    match version {
        MqttVersion::V3 => v3_1_1::Pingreq::builder().build().map(Packet::from),
        MqttVersion::V5 => v5_0::Pingreq::builder().build().map(Packet::from),
    }
}

/// DISCONNECT. `with_will`: the broker publishes the last will, which only MQTT 5 can request.
pub(super) fn disconnect(version: MqttVersion, with_will: bool) -> Result<Packet, MqttError> {
    match version {
        MqttVersion::V3 => v3_1_1::Disconnect::builder().build().map(Packet::from),
        MqttVersion::V5 => {
            let packet = v5_0::Disconnect::builder();
            let packet = packet.reason_code(match with_will {
                true => DisconnectReasonCode::DisconnectWithWillMessage,
                false => DisconnectReasonCode::NormalDisconnection,
            });
            packet.build().map(Packet::from)
        }
    }
}

fn level(qos: Qos) -> packet::Qos {
    match qos {
        Qos::AtMostOnce => packet::Qos::AtMostOnce,
        Qos::AtLeastOnce => packet::Qos::AtLeastOnce,
    }
}
