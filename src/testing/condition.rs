//! A condition of a test: contacts as in a ladder, with arithmetic in compares.
//!
//! Evaluated on an image at the end of a scan. Its form is in `docs/testing.md`.

use crate::engine::{Cell, Image};

/// A condition with its operands.
#[derive(Clone, Debug)]
pub struct Condition {
    /// As it is written.
    pub text: String,
    /// Its operands, each once, in the order in which they are written: name and cell.
    pub operands: Vec<(String, Cell)>,
    /// The number of edges in it: `rise(…)`, `fall(…)`.
    pub edges: usize,
}

impl Condition {
    /// Whether it is true on an image. `edges`: what was inside each edge at the end of the scan
    /// before (OFF before the first scan after a start); afterwards, what is inside now.
    pub fn is_true(&self, image: &Image, edges: &mut [bool]) -> bool {
        let _ = (image, edges);
        false
    }
}
