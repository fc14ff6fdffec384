//! The operator's commands at the running controller: the sockets, their clients, the permissions.
//!
//! The shell makes [`SocketClaim`]s before it opens any other file, binds the [`OperatorServer`]s
//! before the first scan, and runs them among the drivers. `socket` manages a socket's file, `peer`
//! identifies the user at the other end, `io::seats` and `pace` have the limits, `session` serves
//! one client, `answer` has its requests carried out: by `service`, writes by `write`, bits that a
//! page holds by `hold`, acknowledgements by `alarms`, shelves by `shelves`. `read_set` has the
//! values that can be written back, `logged_change` and `logged_writes` log changes of
//! operands, `ack_bits` shows acknowledgements to the ladder, `status` reports the state of the
//! controller. Nothing here can make a scan wait.

mod accounts;
mod ack_bits;
mod alarms;
mod answer;
mod hold;
mod known_hold;
mod logged_change;
mod logged_writes;
mod memory;
mod outputs;
mod pace;
mod page_rights;
mod peer;
mod read_set;
mod record;
mod refused;
mod server;
mod service;
mod session;
mod set_mistakes;
mod shelves;
mod socket;
mod status;
mod write;

pub(super) use server::{OperatorServer, claim};
pub(super) use service::OperatorService;
pub(super) use socket::SocketClaim;
pub(super) use status::{ProgramView, StatusSources};
