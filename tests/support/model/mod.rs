//! The reference model: a second reading of the language and of its semantics, slow and
//! obvious; a generator of random programs; a shrinker for those that differ.

mod act;
mod arrays;
pub mod case;
pub mod clock;
mod contact;
mod counters;
mod drawn_arrays;
mod exec;
mod formulas;
pub mod generate;
mod instruction;
mod math;
mod math_read;
mod menu;
mod names;
mod parse;
mod place;
mod pool;
mod program;
mod reals;
pub mod rng;
pub mod shrink;
mod tables;
mod timers;
mod trace;
mod tree;

pub use trace::{Options, simulate};
