//! Stimuli and traces: the values that a simulation gets, and the rows that it gives.
//!
//! `rig::simulation` runs a simulation; `rungd replay` writes its rows with the same traces. This
//! module runs nothing, and reads no clock and no file.

mod csv;
pub mod stimulus;
pub mod svg;
mod svg_columns;
mod svg_wide;
pub mod trace;
pub mod vcd;
