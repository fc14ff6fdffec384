//! Many controllers: the Sparkplug B edge node ([`edge`]), the controllers behind a broker
//! ([`fleet`]), metrics for a time-series database ([`metrics`]).
//!
//! Each is a program of its own (a subcommand) and a client of the operator's socket or of a
//! broker; none is part of the daemon.

pub mod edge;
pub mod fleet;
pub mod metrics;
