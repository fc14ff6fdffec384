//! `rungd web`: a running controller in a browser.
//!
//! A separate process, and a client of the operator's socket: the daemon never parses HTTP. One
//! thread follows the controller (`follow`). `server` receives requests; `guard` checks their hosts
//! and origins, and `sessions` their users. `api` answers from the data of `follow`; `stream` sends
//! each viewer the power of one scan, five times a second. The pages are read-only, except for the
//! tags that the controller file's `[web] write` lists for the roles of users (`rights`), and
//! alarms, which they may acknowledge. Called by `cli::web`.
//!
//! # The way of a page
//!
//! ```text
//!  browser ◄─► web::server ─► route ─► guard (host, origin) ─► sessions ─► api ─► answer
//!                 │                                                         │ ▲
//!                 │ events: stream, for each viewer            spawn_blocking: why, trends
//!                 └──────────────◄── LiveView ◄── web::follow (one thread) ─┘ │
//!                                                    │  live::Follower ─► observe::PowerRun
//!                                                    ▼
//!                        operator's socket: recording from_section=N, status; write
//! ```
//!
//! The daemon's only part in this is the socket. A `LiveView` shows one moment, and all viewers
//! share it; a viewer that pauses keeps its own. The scan is executed again while the whole program
//! is observed rung by rung (`observe/power.rs`), starting from the previous scan; a page gets a
//! character for each wire (`draw/live_svg.rs`).

mod alarms;
mod api;
mod body;
mod changes;
mod follow;
mod guard;
mod hasher;
mod journal;
mod listen;
mod mimic;
mod mimic_xml;
mod options;
mod panels;
mod patience;
mod press;
mod query;
mod recipe;
mod reply;
mod rights;
mod route;
mod routes;
#[cfg(feature = "prove")]
mod search;
mod sender;
mod server;
mod sessions;
mod site;
mod stream;
mod trend_line;
mod trend_store;
mod tries;
mod users;
mod views;

pub use options::{ListenAt, WebOptions};
pub use routes::{PageChange, PageQuestion};
pub use server::{conversation, serve};
pub use tries::PasswordTries;
pub use users::{Secret, UserDirectory, UserFailure, set_password};
