//! `rungd fleet`: the controllers behind a broker, as their edge nodes tell of them.
//!
//! A [`FleetView`] is a state machine without a clock or a socket: it is fed with messages and the
//! time, keeps each node's birth, values and alarms, and notices what is missing. `listen` is the
//! thin shell around it, a client of `mqtt`; `report` is what commands print; `expect` compares the
//! ladders that run with those of a folder. It reads: it writes no value anywhere. Two things are
//! sent on demand alone: a request for a birth, and the state of a host. Called by `cli::fleet`.

mod alarms;
mod ask;
mod expect;
mod heard;
mod host;
mod limits;
mod listen;
mod metrics;
mod news;
mod node;
pub(crate) mod report;
mod stop;
mod view;
mod watched;

#[cfg(test)]
mod tests;

pub(crate) use alarms::{CutAlarms, FleetAlarmList};
pub(crate) use expect::{ExpectedLadders, LadderVerdict};
pub use heard::{HeardMessage, NodeName};
pub use limits::FleetLimits;
pub(crate) use listen::{FleetHeard, FleetOptions, FleetWord, listen, now_ms};
pub(crate) use news::shown;
pub use news::{FleetChange, FleetNews};
pub use report::FleetReport;
pub(crate) use report::NodeReport;
pub use view::FleetView;
pub(crate) use watched::WatchedMetrics;
