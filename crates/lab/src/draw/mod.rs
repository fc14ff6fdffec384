//! A ladder for people: rungs as circuits, and the cross-reference. Pure: programs and settings in,
//! data and texts out.
//!
//! Called by `cli`. A rung becomes a `circuit`, `grid` places the circuit, `text` and `svg` draw
//! the grid, and `page` combines the drawings. The uses of a cell come from `observe`, so that
//! `rungd why` and these pages never differ.

pub mod circuit;
pub mod coverage;
pub mod difference;
mod face;
pub mod flow;
mod flow_drawing;
pub mod grid;
pub mod ladder;
pub mod listing;
pub mod live_svg;
pub mod page;
pub mod power;
#[cfg(test)]
mod power_tests;
#[cfg(test)]
mod read_back;
mod svg;
#[cfg(test)]
mod tests;
pub mod text;
mod wording;
pub mod xref;

pub use wording::instruction_text;
