//! `rungd web`: a running controller in a browser.
//!
//! A separate process, and a client of the operator's socket: the daemon never parses HTTP. One
//! thread follows the controller (`follow`). `server` receives requests; `guard` checks their hosts
//! and origins, and `sessions` their users. `api` answers from the data of `follow`; `stream` sends
//! each viewer the power of one scan, five times a second. The pages are read-only, except for the
//! tags that the controller file's `[web] write` lists for signed-in users, and alarms, which they
//! may acknowledge. Called by `cli::web`.

mod api;
mod body;
mod follow;
mod guard;
mod hasher;
mod journal;
mod listen;
mod options;
mod patience;
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
