//! An operator's commands, as both ends see them: the protocol, the names, the client.
//!
//! `cli` asks through [`client`]; `daemon::operator` serves. `docs/operator.md` is the page for who
//! writes a client of his own. No tokio and no log here.

pub mod client;
pub mod names;
pub mod protocol;
#[cfg(test)]
mod protocol_tests;

/// Where the socket is, if nothing else is said.
pub const SOCKET_DEFAULT: &str = "/run/rungd/rungd.sock";

/// The environment variable that says where the socket is.
pub const SOCKET_VARIABLE: &str = "RUNGD_SOCKET";
