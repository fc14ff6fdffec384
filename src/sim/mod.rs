//! The simulator: virtual time, the real engine, no sleeping.
//!
//! Called by `rungd sim` and tests, with an engine program, a [`Plan`] and a `Trace` for the
//! rows. Scan k has the timestamp k × period. Reads no clock and no file, so the same input always
//! gives the same bytes.

mod run;
pub mod stimulus;
pub(crate) mod svg;
pub mod trace;

pub use run::{Plan, run};
