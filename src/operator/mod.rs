//! The operator's commands, for both ends: the protocol, the names, the client.
//!
//! `cli` sends requests through [`client`]; `daemon::operator` answers them. `docs/operator.md`
//! describes the protocol for authors of other clients. No tokio and no log here.

mod alarm;
pub mod client;
mod groups;
mod metric;
pub mod names;
mod offer;
pub(crate) mod operand;
pub mod protocol;
#[cfg(test)]
mod protocol_tests;
mod state;
mod value;

use std::path::PathBuf;

/// The socket of the service.
pub(crate) const SOCKET_DEFAULT: &str = "/run/rungd/rungd.sock";

/// The socket's name beside a controller file of `rungd init`.
pub(crate) const SOCKET_NAME: &str = "rungd.sock";

/// The environment variable that says where the socket is.
pub(crate) const SOCKET_VARIABLE: &str = "RUNGD_SOCKET";

/// The socket that [`SOCKET_VARIABLE`] names; an empty one names none.
pub(crate) fn socket_of_environment() -> Option<PathBuf> {
    std::env::var_os(SOCKET_VARIABLE).filter(|path| !path.is_empty()).map(PathBuf::from)
}
