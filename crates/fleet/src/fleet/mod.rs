//! `rungd fleet`: the controllers behind a broker, as their edge nodes report them.
//!
//! A [`FleetView`] is a state machine without a clock or a socket: it receives messages and the
//! time, keeps each node's birth, values and alarms, and detects missing messages. `listen` is the
//! thin shell around it, a client of `mqtt`; `report` is what commands print; `expect` compares the
//! running ladders with those of a folder. This module only reads: it writes no value anywhere. It
//! sends two kinds of message, and only on demand: requests for births, and the state of a host.
//! Called by `cli::fleet`.

mod alarms;
mod ask;
mod expect;
mod heard;
mod host;
mod limits;
pub mod listen;
mod metrics;
mod news;
mod node;
pub mod report;
mod stop;
mod view;
mod watched;

#[cfg(test)]
mod tests;

pub use alarms::{CutAlarms, FleetAlarmList};
pub use expect::{ExpectedLadders, LadderVerdict};
pub use heard::{NodeName, ReceivedMessage};
pub use limits::FleetLimits;
pub use listen::{FleetEvent, FleetOptions, FleetResult, listen};
pub use news::shown;
pub use news::{FleetChange, FleetNews};
pub use report::FleetReport;
pub use report::NodeReport;
pub use view::FleetView;
pub use watched::WatchedMetrics;
