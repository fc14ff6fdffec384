//! The settings of a session. `connect`, `session` and `wire` read them; `edge` and `fleet` make
//! them from their own settings.

use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;
use std::{fmt, io};

use rungd_base::regular_file::read_small_text;
use rungd_base::whole_file::judge_secret;

/// The default of the longest packet that is taken from a broker.
const PACKET_BYTES_MAX: u32 = 1 << 20;

/// The default of the bytes that may wait to be sent.
const QUEUE_BYTES_MAX: usize = 1 << 20;

/// The settings of a session.
#[derive(Clone, Debug)]
pub struct BrokerSettings {
    /// The addresses of the brokers. The caller chooses one of them for a session.
    pub addresses: Vec<BrokerAddress>,
    /// The version of the protocol.
    pub version: MqttVersion,
    /// The name of this client at the broker. Two clients with the same name end each other's
    /// sessions.
    pub client_id: String,
    /// The longest silence: of the broker after a PINGREQ, and of a link that takes no byte.
    pub keepalive: Duration,
    /// The user, if the broker requires one.
    pub login: Option<BrokerLogin>,
    /// Files for TLS, only for `mqtts://` addresses. `None`: the system's authorities, and no
    /// certificate of our own.
    pub tls: Option<TlsFiles>,
    /// The longest packet that is taken from the broker. A longer message is left out; anything
    /// else that is longer ends the session.
    pub packet_bytes_max: u32,
    /// The bytes that may wait to be sent, or to be read by the caller. A single message may be
    /// longer than this.
    pub queue_bytes_max: usize,
    /// The longest wait for the broker's answer: to a connection (TCP, TLS and CONNACK together),
    /// to a subscription, to a message if too many messages have no answer.
    pub answer_max: Duration,
}

impl BrokerSettings {
    /// The defaults: MQTT 3.1.1, a keepalive of 30 s, no login, the system's authorities.
    pub fn new(addresses: Vec<BrokerAddress>, client_id: &str) -> BrokerSettings {
        BrokerSettings {
            addresses,
            version: MqttVersion::V3,
            client_id: client_id.to_owned(),
            keepalive: Duration::from_secs(30),
            login: None,
            tls: None,
            packet_bytes_max: PACKET_BYTES_MAX,
            queue_bytes_max: QUEUE_BYTES_MAX,
            answer_max: Duration::from_secs(10),
        }
    }
}

/// The version of the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MqttVersion {
    /// MQTT 3.1.1: every broker has it, and NATS has no other version.
    V3,
    /// MQTT 5: the broker sends reasons.
    V5,
}

/// How often a message arrives. (Exactly once, QoS 2, is not offered: nothing here needs it.)
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Qos {
    /// QoS 0: once, or never.
    AtMostOnce,
    /// QoS 1: once, or more often; the broker acknowledges it.
    AtLeastOnce,
}

/// A user of a broker.
#[derive(Clone)]
pub struct BrokerLogin {
    /// The user's name.
    pub user: String,
    /// The password.
    pub password: String,
}

impl BrokerLogin {
    /// A user whose password is the first line of a file.
    ///
    /// # Errors
    /// The file cannot be read, or others may read it.
    pub fn of_file(user: &str, password: &Path) -> io::Result<BrokerLogin> {
        judge_secret(password, "the password")?;
        let text = read_small_text(password)?;
        let password = text.lines().next().unwrap_or_default().to_owned();
        Ok(BrokerLogin { user: user.to_owned(), password })
    }
}

impl fmt::Debug for BrokerLogin {
    /// Prints the login without the password.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BrokerLogin").field("user", &self.user).finish_non_exhaustive()
    }
}

/// Files in PEM.
#[derive(Clone, Debug, Default)]
pub struct TlsFiles {
    /// The authorities that may have signed the broker's certificate. `None`: those of the system.
    pub ca: Option<PathBuf>,
    /// Our own certificate, with the intermediate certificates.
    pub certificate: Option<PathBuf>,
    /// The key of our certificate.
    pub key: Option<PathBuf>,
}

/// The message that the broker publishes for us when the session ends without `disconnect`.
#[derive(Clone, Debug)]
pub struct LastWill {
    /// The topic.
    pub topic: String,
    /// The payload.
    pub payload: Vec<u8>,
    /// How often it arrives.
    pub qos: Qos,
    /// Whether the broker retains it for later subscribers.
    pub retain: bool,
}

/// The address of a broker: `mqtt://host:port`, or `mqtts://host:port` with TLS.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct BrokerAddress {
    /// A name or an IP address; an IPv6 address has no brackets here.
    pub host: String,
    /// The TCP port.
    pub port: u16,
    /// Whether the connection uses TLS.
    pub tls: bool,
}

impl BrokerAddress {
    /// Whether everybody on the way to the broker can read what is sent, a password too: no TLS,
    /// and a broker that is not on this machine.
    pub fn is_in_clear(&self) -> bool {
        let is_local = match self.host.parse::<IpAddr>() {
            Ok(ip) => ip.is_loopback(),
            Err(_) => self.host == "localhost",
        };
        !self.tls && !is_local
    }

    /// Reads an address. The default port is 1883, or 8883 with TLS.
    ///
    /// # Errors
    /// The reason why the text is no address, as a sentence without its end.
    pub fn parse(text: &str) -> Result<BrokerAddress, String> {
        let scheme = |name: &str| text.strip_prefix(name);
        let (rest, tls) = match (scheme("mqtt://"), scheme("mqtts://")) {
            (Some(rest), _) => (rest, false),
            (None, Some(rest)) => (rest, true),
            (None, None) => {
                return Err(format!(
                    "`{text}` begins neither with `mqtt://` nor with `mqtts://` (with TLS)"
                ));
            }
        };
        let rest = rest.strip_suffix('/').unwrap_or(rest);
        if let Some(wrong) = rest.chars().find(|c| "/@?#".contains(*c) || c.is_whitespace()) {
            return Err(format!(
                "`{text}` has `{wrong}`: a broker's address is a scheme, a host and a port; user, \
                 password and files have keys of their own"
            ));
        }
        let (host, port) = split(text, rest)?;
        if host.is_empty() {
            return Err(format!("`{text}` names no host"));
        }
        let port = match port {
            None if tls => 8883,
            None => 1883,
            Some(digits) => match digits.parse() {
                Ok(port) if port > 0 && !digits.starts_with('+') => port,
                _ => return Err(format!("`{digits}` in `{text}` is no port: 1 to 65535")),
            },
        };
        Ok(BrokerAddress { host: host.to_owned(), port, tls })
    }
}

/// The host and the port in the text after the scheme.
fn split<'t>(text: &str, rest: &'t str) -> Result<(&'t str, Option<&'t str>), String> {
    if let Some(inner) = rest.strip_prefix('[') {
        let closed = inner.split_once(']').filter(|(host, _)| host.contains(':'));
        let Some((host, behind)) = closed else {
            return Err(format!("`{text}` has no IPv6 address within its brackets"));
        };
        return match behind.strip_prefix(':') {
            Some(port) => Ok((host, Some(port))),
            None if behind.is_empty() => Ok((host, None)),
            None => Err(format!("`{behind}` in `{text}` is no port: `:1883`")),
        };
    }
    match rest.split_once(':') {
        Some((_, port)) if port.contains(':') => {
            Err(format!("`{text}` has an IPv6 address without brackets: `mqtt://[::1]:1883`"))
        }
        Some((host, port)) => Ok((host, Some(port))),
        None => Ok((rest, None)),
    }
}

impl fmt::Display for BrokerAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = if self.tls { "mqtts" } else { "mqtt" };
        if self.host.contains(':') {
            write!(f, "{scheme}://[{}]:{}", self.host, self.port)
        } else {
            write!(f, "{scheme}://{}:{}", self.host, self.port)
        }
    }
}
