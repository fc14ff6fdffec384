//! Placeholder until the engine lands: the cells that the exchange is written in terms of.

/// A bit's place in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BitCell(pub u32);

/// A word's place in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct WordCell(pub u32);
