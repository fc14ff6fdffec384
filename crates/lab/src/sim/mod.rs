//! The simulator: runs the real engine in virtual time, without waiting.
//!
//! Called by `rungd sim` and tests, with an engine program, a [`Plan`] and a `Trace` for the
//! rows. `rungd replay` writes its rows with the same traces. Scan k has the timestamp
//! k × period. Reads no clock and no file, so the same input always gives the same bytes.

mod csv;
mod run;
pub mod stimulus;
pub mod svg;
mod svg_columns;
mod svg_wide;
pub mod trace;
pub mod vcd;

pub use run::fits;
pub use run::{Plan, run};
