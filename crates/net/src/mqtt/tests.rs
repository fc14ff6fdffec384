//! Tests of sessions with a scripted broker, in virtual time.

mod giants;
mod settings;
mod silence;
mod strangers;
mod talk;

use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _, DuplexStream, duplex};

use super::failure::{MqttCause, MqttFailure};
use super::{BrokerAddress, BrokerSettings, MqttEvent, MqttSession, MqttVersion, Qos};

const VERSIONS: [MqttVersion; 2] = [MqttVersion::V3, MqttVersion::V5];

/// The keepalive of these sessions.
const KEEPALIVE: Duration = Duration::from_secs(10);

const CONNACK_3: &[u8] = &[0x20, 2, 0, 0];
const CONNACK_5: &[u8] = &[0x20, 3, 0, 0, 0];
const PINGREQ: &[u8] = &[0xc0, 0];
const PINGRESP: &[u8] = &[0xd0, 0];

fn connack(version: MqttVersion) -> &'static [u8] {
    match version {
        MqttVersion::V3 => CONNACK_3,
        MqttVersion::V5 => CONNACK_5,
    }
}

fn settings(version: MqttVersion) -> BrokerSettings {
    let mut settings = BrokerSettings::new(vec![address()], "me");
    settings.version = version;
    settings.keepalive = KEEPALIVE;
    settings.packet_bytes_max = 1000;
    settings
}

fn address() -> BrokerAddress {
    BrokerAddress::parse("mqtt://plant:1").unwrap()
}

/// Runs a test in virtual time, which advances while everything waits.
fn run(body: impl Future<Output = ()>) {
    let mut runtime = tokio::runtime::Builder::new_current_thread();
    let runtime = runtime.enable_time().start_paused(true).build().unwrap();
    let body = async { tokio::time::timeout(1000 * KEEPALIVE, body).await };
    runtime.block_on(body).expect("it ends");
}

/// The broker's end of a connection whose buffers have a limit.
struct Broker(DuplexStream);

impl Broker {
    async fn says(&mut self, bytes: &[u8]) {
        self.0.write_all(bytes).await.unwrap();
    }

    /// The next packet of the client: its first byte, and the bytes after its length.
    async fn packet(&mut self) -> (u8, Vec<u8>) {
        let first = self.0.read_u8().await.unwrap();
        let (mut length, mut shift) = (0, 0);
        loop {
            let byte = self.0.read_u8().await.unwrap();
            length |= usize::from(byte & 0x7f) << shift;
            shift += 7;
            if byte < 0x80 {
                break;
            }
        }
        let mut body = vec![0; length];
        self.0.read_exact(&mut body).await.unwrap();
        (first, body)
    }
}

/// A session that has begun. `bytes`: the limit of the connection's buffers.
async fn begun(settings: &BrokerSettings, connack: &[u8], bytes: usize) -> (MqttSession, Broker) {
    let (ours, theirs) = duplex(bytes);
    let mut broker = Broker(theirs);
    let address = address();
    let begin = MqttSession::begin(Box::new(ours), settings, &address, None);
    let welcome = async {
        assert_eq!(broker.packet().await.0, 0x10, "CONNECT");
        broker.says(connack).await;
    };
    let (session, ()) = tokio::join!(begin, welcome);
    (session.unwrap(), broker)
}

async fn session(version: MqttVersion) -> (MqttSession, Broker) {
    begun(&settings(version), connack(version), 1 << 16).await
}

/// How a broker delivers a message.
#[derive(Clone, Copy)]
struct Delivery {
    qos: Qos,
    retained: bool,
}

/// A PUBLISH of QoS 0 or 1, as a broker sends it.
fn publish(
    version: MqttVersion,
    topic: &str,
    payload: &[u8],
    Delivery { qos, retained }: Delivery,
) -> Vec<u8> {
    let mut body = vec![0, topic.len() as u8];
    body.extend_from_slice(topic.as_bytes());
    if qos == Qos::AtLeastOnce {
        body.extend([0, 7]);
    }
    if version == MqttVersion::V5 {
        body.push(0);
    }
    body.extend_from_slice(payload);
    let flags = u8::from(retained) | u8::from(qos == Qos::AtLeastOnce) << 1;
    let length = [(body.len() & 0x7f) as u8 | 0x80, (body.len() >> 7) as u8];
    [&[0x30 | flags], &length[..], &body].concat()
}

/// The cause of the session's end after this number of events.
async fn end(session: &mut MqttSession, events: usize) -> MqttCause {
    for _ in 0..events {
        session.next().await.unwrap();
    }
    session.next().await.unwrap_err().cause
}

fn message(topic: &str, payload: &[u8], Delivery { qos, retained }: Delivery) -> MqttEvent {
    MqttEvent::Message { topic: topic.to_owned(), payload: payload.to_vec(), retained, qos }
}
