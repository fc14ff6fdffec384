//! An MQTT client for `rungd edge` and `rungd fleet`: one session with one broker, with MQTT 3.1.1
//! or 5, over TCP or TLS.
//!
//! A session detects silence. It sends a PINGREQ if it has sent or received nothing for half of its
//! keepalive. It fails if nothing comes for a keepalive after that, or if the broker or the link
//! takes no byte for a keepalive. All queues are limited in bytes. A message that is too long is
//! read, discarded and reported.
//!
//! `settings` has the brokers and options; `connect` opens TCP and TLS (`tls`); `session` is the
//! interface for callers, with its deadlines in `pulse`; `wire` is the protocol without sockets and
//! time (its packets are in `packets`; `skip` keeps oversized messages from it); `probe` is the
//! entry point for fuzzing; `failure` describes failures for people, with the broker's codes in
//! `reason`.
//!
//! The client connects once, logs nothing and has no thread: callers connect again, choose among
//! addresses and log events. (A host's name is looked up by tokio's pool of blocking calls.)

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
