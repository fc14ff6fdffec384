//! The failure of a session, at its beginning or later: the broker, the cause and a remedy, as
//! texts for people. Callers print these texts, and decide whether to connect again.

use std::error::Error;
use std::fmt;
use std::io;
use std::path::PathBuf;
use std::time::Duration;

use super::reason::{of_version_3, of_version_5};
use super::settings::{BrokerAddress, MqttVersion};
use super::skip::LongMessage;

/// The failure of a session, at its beginning or later. After a failure, a session returns nothing
/// else.
#[derive(Clone, Debug)]
pub struct MqttFailure {
    /// The broker.
    pub broker: BrokerAddress,
    /// The cause.
    pub cause: MqttCause,
}

/// The cause of a failure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MqttCause {
    /// No TCP connection.
    Unreachable(String),
    /// No session within this time.
    Late(Duration),
    /// A file for TLS cannot be used.
    File(PathBuf, String),
    /// The settings contradict themselves.
    Settings(&'static str),
    /// TLS failed: a wrong certificate, a wrong name, or a broker without TLS.
    Insecure(String),
    /// The broker refuses the session.
    Refused(MqttVersion, u8),
    /// The broker refuses a subscription.
    FilterRefused(MqttVersion, u8, String),
    /// The broker refuses a message (MQTT 5).
    MessageRefused(u8, u16),
    /// The broker ends the session, with a reason (MQTT 5).
    Ended(u8),
    /// The connection was closed without a reason.
    Closed,
    /// The connection broke.
    Broken(String),
    /// Nothing comes, or nothing can be sent, for too long.
    Silent(LinkSilence, Duration),
    /// Like `Silent`, but a message that is too long was still coming.
    Blocked(LongMessage, LinkSilence, Duration),
    /// The received bytes are not MQTT, or not allowed at this time.
    Garbage(String),
    /// A packet that is no message is longer than this many bytes.
    TooLong(u32),
    /// The caller's data cannot be sent.
    NotSendable(String),
}

/// The kind of silence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkSilence {
    /// No byte comes after a PINGREQ.
    NoByte,
    /// Bytes come, but no PINGRESP.
    NoPong,
    /// The broker or the link takes no byte.
    NoProgress,
    /// The broker or the link takes bytes, but too slowly for the queued data.
    NoRoom,
    /// The broker does not answer a subscription.
    NoSubscription,
    /// Too many messages are without the broker's acknowledgement.
    NoAcknowledgement,
}

/// The name by which rustls refuses an authority's certificate as the broker's.
const AUTHORITY_AS_BROKER: &str = "CaUsedAsEndEntity";

impl MqttFailure {
    /// Whether the broker was silent, rather than gone.
    pub fn is_silent(&self) -> bool {
        matches!(self.cause, MqttCause::Silent(..) | MqttCause::Blocked(..))
    }
}

impl Error for MqttFailure {}

impl fmt::Display for MqttFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "broker {}: {}", self.broker, self.cause)
    }
}

impl fmt::Display for MqttCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MqttCause::Unreachable(why) => {
                write!(f, "no connection ({why}): is it running, and are host and port right?")
            }
            MqttCause::Late(longest) => {
                write!(f, "no session within {longest:?}: the broker or the link answers too late")
            }
            MqttCause::File(path, why) => write!(f, "{}: {why}", path.display()),
            MqttCause::Settings(what) => f.write_str(what),
            MqttCause::Insecure(why) if why.contains(AUTHORITY_AS_BROKER) => write!(
                f,
                "TLS failed ({why}): the broker shows the certificate of an authority (`CA:TRUE`) \
                 as its own, which no client may accept: let the authority sign one for the broker \
                 (`basicConstraints = CA:FALSE`, `subjectAltName` with its host), and keep the \
                 authority's as `ca`"
            ),
            MqttCause::Insecure(why) => write!(
                f,
                "TLS failed ({why}): compare `ca`, `certificate` and `key` with the broker's, and \
                 the address with the names in its certificate"
            ),
            MqttCause::Refused(..)
            | MqttCause::FilterRefused(..)
            | MqttCause::MessageRefused(..)
            | MqttCause::Ended(_) => self.said_by_the_broker(f),
            MqttCause::Closed => f.write_str(
                "the connection was closed without a reason: the broker ended, another client \
                 connected with the same client id, or the broker rejected a packet; see its log",
            ),
            MqttCause::Broken(why) => write!(f, "the connection broke: {why}"),
            MqttCause::Silent(what, longest) => {
                write!(f, "{what} for {longest:?}: the broker or the link hangs")
            }
            MqttCause::Blocked(message, what, longest) => {
                write!(f, "{what} for {longest:?}: the link is still busy with {message}")
            }
            MqttCause::Garbage(what) => write!(
                f,
                "the broker sent an invalid packet ({what}): is it an MQTT broker, and of \
                 this version?"
            ),
            MqttCause::TooLong(max) => write!(
                f,
                "the broker sends a packet of more than {max} bytes, the longest that is allowed"
            ),
            MqttCause::NotSendable(why) => write!(f, "cannot be sent: {why}"),
        }
    }
}

impl MqttCause {
    /// The cause of an error on an open connection.
    pub(super) fn of_socket(error: &io::Error) -> MqttCause {
        if error.kind() == io::ErrorKind::UnexpectedEof {
            MqttCause::Closed
        } else if error.kind() == io::ErrorKind::InvalidData {
            MqttCause::Insecure(error.to_string())
        } else {
            MqttCause::Broken(error.to_string())
        }
    }

    fn said_by_the_broker(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = |version: &MqttVersion, code: u8| match version {
            MqttVersion::V3 => of_version_3(code),
            MqttVersion::V5 => of_version_5(code),
        };
        if let MqttCause::Refused(version, code) = self {
            // In a refused session, this code is about the login, not about a single action.
            let (why, remedy) = if *code == 0x87 { of_version_3(5) } else { words(version, *code) };
            write!(f, "the session is refused: {why} (code {code}): {remedy}")
        } else if let MqttCause::FilterRefused(version, code, filter) = self {
            let (why, remedy) = words(version, *code);
            write!(f, "subscription `{filter}` is refused: {why} (code {code}): {remedy}")
        } else if let MqttCause::MessageRefused(code, packet) = self {
            let (why, remedy) = of_version_5(*code);
            write!(f, "message {packet} is refused: {why} (code {code}): {remedy}")
        } else if let MqttCause::Ended(code) = self {
            let (why, remedy) = match code {
                0 => ("without a reason", "see the broker's log"),
                code => of_version_5(*code),
            };
            write!(f, "the broker ends the session: {why} (code {code}): {remedy}")
        } else {
            Ok(())
        }
    }
}

impl fmt::Display for LinkSilence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            LinkSilence::NoByte => "no byte was received",
            LinkSilence::NoPong => "a PINGREQ had no answer",
            LinkSilence::NoProgress => "no byte could be sent",
            LinkSilence::NoRoom => "the send queue was full",
            LinkSilence::NoSubscription => "a subscription had no answer",
            LinkSilence::NoAcknowledgement => "messages had no acknowledgement",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_authority_used_as_a_broker_certificate_is_explained() {
        let refused = "invalid peer certificate: Other(OtherError(CaUsedAsEndEntity))";
        let told = MqttCause::Insecure(refused.to_owned()).to_string();
        assert!(told.contains("`basicConstraints = CA:FALSE`"), "{told}");
    }
}
