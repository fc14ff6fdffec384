//! `rungd-opcua`: a running controller as an OPC UA server; `main` has its command line.
//!
//! A program of its own, because the OPC UA library is large, and a client of the operator's
//! socket: the daemon opens no port for it. `follow` reads the scan log on a thread; `publish` puts
//! the changes into the address space and tells the subscriptions; `manager` answers writes and
//! reads of the past, `gate` lets clients in. OPCUA.toml is read by `rungd_fleet::opcua`.
//!
//! A library, so that `fuzz` can call what reads the bytes of strangers.
//!
//! ```text
//!  operator's socket ─► follow (ChangeFollower, status) ─► publish ─► address space
//!        ▲                                     events ◄─ alarms ┴─► subscriptions
//!        └─ write-set ◄── manager ◄── gate ◄── clients; history ◄── scan log (ChangeHistory)
//! ```

mod aggregate;
mod alarms;
pub mod certificates;
mod conditions;
mod follow;
pub mod frames;
mod fresh_items;
mod gate;
mod history;
pub mod journal;
mod manager;
mod pages;
mod publish;
mod reasons;
mod rights;
pub mod server;
mod shelving;
mod shown;
mod space;
mod status;
pub mod strangers;
mod tags;
mod types;
mod under_way;
mod users;
mod values;
