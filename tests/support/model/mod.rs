//! The reference model: a second implementation of the language and of its semantics, slow and
//! obvious. Also a generator of random programs, and a shrinker for programs whose traces differ.

mod act;
mod arrays;
mod calls;
pub mod case;
pub mod clock;
mod contact;
mod counters;
mod drawn_arrays;
mod drawn_records;
mod drawn_stimulus;
mod drawn_templates;
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
mod records;
pub mod rng;
pub mod shrink;
#[cfg(test)]
mod tables;
mod templates;
mod timers;
mod trace;
mod tree;
mod word_bits;

pub use trace::{Options, simulate};
