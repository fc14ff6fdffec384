//! The simulator: virtual time, the real engine, no sleeping.
//!
//! `rungd sim` and tests hand in a resolved program, a [`Plan`] and a place to write; rows come
//! out. Scan k has the timestamp k × period. Nothing here reads a clock or a file, so the same
//! input always gives the same bytes.

mod run;
pub mod stimulus;
pub mod svg;
pub mod trace;

pub use run::{Plan, run};
