//! Tests of ladders: so far, a test made of what happened.
//!
//! `cli` hands over sections of a recording; the result is the text of a test file. No file, no
//! clock.

mod happened;
mod scenario;

pub use scenario::{ScenarioOf, scenario};
