//! A running controller, seen from outside: the operator's protocol and its client ([`operator`]),
//! and a controller that is followed scan by scan ([`live`]).
//!
//! The server of the protocol is the daemon's. Nothing here changes a controller but by a request
//! of the protocol.

pub mod live;
pub mod operator;
