//! A ladder as people look at it: rungs as circuits, and the cross-reference. Pure: programs and
//! settings in, data and texts out.
//!
//! Called by `cli`. A rung becomes a `circuit`, a circuit gets its places on a `grid`, and `text`
//! and `svg` draw the grid; `page` puts them together. What touches a cell comes from `observe`, so
//! that `rungd why` and these pages never differ.

pub mod circuit;
pub mod coverage;
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
