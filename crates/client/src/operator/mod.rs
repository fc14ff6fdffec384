//! The operator's commands, for both ends: the protocol, the names, the client.
//!
//! `cli` sends requests through [`client`], to the controller that `search` finds;
//! `daemon::operator_server` answers them, and puts its socket on the list of `running`. Programs
//! that ask again and again find the controller and pace their requests with [`poller`].
//! `docs/operator.md` describes the protocol for authors of other clients. This module uses
//! neither tokio nor the log.

mod alarm;
mod answers;
pub mod client;
pub mod deadline;
mod deploy;
mod groups;
mod hold;
mod metric;
pub mod names;
mod offer;
pub mod operand;
pub mod poller;
mod present;
pub mod protocol;
#[cfg(test)]
mod protocol_tests;
mod recording;
pub mod running;
pub mod search;
pub mod search_failure;
mod shelf;
pub mod socket_place;
mod state;
mod value;
pub mod value_set;
pub mod writable;

use std::path::{Path, PathBuf};

/// The socket of the service.
pub(crate) const SOCKET_DEFAULT: &str = "/run/rungd/rungd.sock";

/// The socket's name beside a controller file of `rungd init`.
pub(crate) const SOCKET_NAME: &str = "rungd.sock";

/// What the name of a view socket adds to that of its operator's socket.
const VIEW: &str = "-view";

/// The view socket beside an operator's socket: `rungd-view.sock` beside `rungd.sock`.
pub(crate) fn view_socket_beside(operator: &Path) -> PathBuf {
    let mut name = operator.file_stem().unwrap_or_default().to_owned();
    name.push(VIEW);
    if let Some(ending) = operator.extension() {
        name.push(".");
        name.push(ending);
    }
    operator.with_file_name(name)
}

/// The environment variable for the path of the socket.
pub const SOCKET_VARIABLE: &str = "RUNGD_SOCKET";

/// The environment variable for the group of the view socket, if the controller file names none.
pub(crate) const VIEW_GROUP_VARIABLE: &str = "RUNGD_VIEW_GROUP";

/// The socket that [`SOCKET_VARIABLE`] names; `None` if the variable is empty.
pub fn socket_of_environment() -> Option<PathBuf> {
    std::env::var_os(SOCKET_VARIABLE).filter(|path| !path.is_empty()).map(PathBuf::from)
}
