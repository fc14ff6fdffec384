//! `rungd web`: a running controller in a browser.
//!
//! A process of its own, and a client of the operator's socket: the daemon never parses HTTP. One
//! thread follows the controller (`follow`). Requests come in through `server`, pass `guard`
//! (hosts, origins) and `sessions` (users), and are answered by `api`, of what was followed;
//! `stream` sends each viewer the power of one scan, five times a second. It reads, unless the
//! controller file's `[web] write` names what a signed-in user may write. Called by `cli::web`.

mod api;
mod body;
mod follow;
mod guard;
mod journal;
mod listen;
mod options;
mod query;
mod reply;
mod route;
mod server;
mod sessions;
mod site;
mod stream;
mod users;

pub use options::{ListenAt, WebOptions};
pub use server::{conversation, serve};
pub use users::{UserFailure, set_password};
