//! The protocols of networks, without anything of controllers: a connection of HTTP/1 within limits
//! ([`http`]), an MQTT client ([`mqtt`]), Sparkplug B ([`sparkplug`]).
//!
//! Everything that comes from a network is limited before it is kept.

#[cfg(feature = "http")]
pub mod http;
#[cfg(feature = "broker")]
pub mod mqtt;
#[cfg(feature = "broker")]
pub mod sparkplug;
