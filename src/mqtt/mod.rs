//! An MQTT client for `rungd edge` and `rungd fleet`: one session with one broker, by MQTT 3.1.1
//! or 5, over TCP or TLS.
//!
//! Silence is not health: a session asks the broker for a word (PINGREQ) when it has sent nothing
//! for half of its keepalive, and fails when nothing comes for a keepalive, or when the broker or
//! the link takes no byte for a keepalive. Whatever is queued has a limit of bytes; a message
//! beyond it is read, thrown away and told.
//!
//! `settings` says to whom and how; `connect` opens TCP and TLS (`tls`); `session` is what callers
//! use, with its deadlines in `pulse`; `wire` is the protocol without sockets and time (its packets
//! in `packets`; `skip` keeps giants from it), `probe` the part of fuzzing; `failure` says what
//! went wrong in words for people, with `reason` for the broker's numbers.
//!
//! It connects once, logs nothing and has no thread: callers connect again, choose among addresses
//! and say what happened. (A host's name is looked up by tokio's pool of blocking calls.)

mod connect;
mod failure;
mod packets;
mod probe;
mod pulse;
mod reason;
mod session;
mod settings;
mod skip;
mod tls;
mod wire;

#[cfg(test)]
mod tests;

pub use failure::{LinkSilence, MqttCause, MqttFailure};
pub use probe::conversation;
pub use session::MqttSession;
pub use settings::{
    BrokerAddress, BrokerLogin, BrokerSettings, LastWill, MqttVersion, Qos, TlsFiles,
};
pub use skip::LongMessage;
pub use wire::MqttEvent;
