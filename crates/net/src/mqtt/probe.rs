//! The entry point for fuzzing: passes the bytes of a hostile broker to the protocol of a session,
//! without a socket. Called by `fuzz/`.

use std::collections::VecDeque;

use super::packets::OutMessage;
use super::settings::{BrokerSettings, LastWill, MqttVersion, Qos};
use super::wire::{BrokerPacket, SessionProtocol};

/// The maximum packet length in this conversation: so short that many messages are longer.
const PACKET_BYTES_MAX: u32 = 200;

/// A conversation with a broker that sends these bytes. The first byte selects the version, the
/// size of the parts, and whether the session has already begun, with a subscription, a message and
/// a ping under way.
///
/// # Panics
/// More is kept than the bytes can account for: fuzzing searches for this.
pub fn conversation(bytes: &[u8]) {
    let Some((choice, bytes)) = bytes.split_first() else { return };
    let mut settings = BrokerSettings::new(Vec::new(), "fuzz");
    settings.packet_bytes_max = PACKET_BYTES_MAX;
    let mut welcome: &[u8] = &[0x20, 2, 0, 0];
    if choice & 1 != 0 {
        settings.version = MqttVersion::V5;
        welcome = &[0x20, 3, 0, 0, 0];
    }
    let (topic, qos) = ("t/0", Qos::AtLeastOnce);
    let will = LastWill { topic: topic.to_owned(), payload: vec![1], qos, retain: false };
    let mut wire = SessionProtocol::new(&settings, Some(&will)).expect("they fit");
    let mut heard = VecDeque::new();
    if choice & 2 != 0 {
        wire.receive(welcome, &mut heard).expect("it is a CONNACK");
        wire.subscribe(&[("t/#", qos), ("u", Qos::AtMostOnce)]).expect("they are filters");
        let message = OutMessage { topic, payload: &[1, 2], qos, retain: false };
        wire.publish(&message).expect("it is a message");
        wire.ping().expect("the session has begun");
    }
    let sent = wire.out().len();
    // The bytes come in parts of 1 to 64 bytes, so that frames are cut anywhere.
    for part in bytes.chunks(usize::from(choice >> 2) + 1) {
        if wire.receive(part, &mut heard).is_err() {
            break;
        }
    }
    let kept: usize = heard.iter().map(BrokerPacket::bytes).sum();
    assert!(kept <= 128 * (bytes.len() + 16), "{kept} bytes of {}", bytes.len());
    let answers = wire.out().len() - sent;
    assert!(answers <= bytes.len() + 64, "{answers} bytes answer {}", bytes.len());
}
