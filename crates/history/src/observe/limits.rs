//! How far an answer of `why` explains. Callers set it, `inquiry` keeps to it.

/// The limits of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The number of steps from the operand to reasons of reasons; 0: only the write.
    pub depth: u32,
    /// The maximum number of operands that are explained.
    pub nodes: u32,
    /// Whether to search for the last change of the operand, and for edits that would change it.
    pub change: bool,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits { depth: 3, nodes: 60, change: true }
    }
}
