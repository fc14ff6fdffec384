//! `rungd edge`: the Sparkplug B edge node of a controller.
//!
//! It is a separate process and a client of the operator's socket: the daemon opens no connection
//! to a broker. `keys` reads EDGE.toml. `node` decides what is published, without I/O and without a
//! clock. `log_thread` reads the scan log and the status, `shell` talks to the broker, `cursor`
//! stores the log position up to which a broker has everything. Called by `cli::edge`.

mod commands;
mod cursor;
mod facts;
mod history;
mod journal;
mod keys;
mod log_thread;
mod node;
#[cfg(test)]
mod node_tests;
mod primary;
mod settings;
mod shell;
mod tags;
mod throttle;

pub use keys::{read_edge, shape};
pub use node::{EdgeNode, NodeAction};
pub use settings::{BrokerKeys, EdgeSettings, PublishRule};
pub use shell::run;
pub use tags::{chooser, number};
