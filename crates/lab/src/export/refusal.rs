//! What of a ladder has no faithful form in IEC 61131-3: each with its place and a remedy.

use rungd_language::source::span::Span;

/// A part of a ladder that is not exported.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportRefusal {
    /// Its place.
    pub span: Span,
    /// The part: `JMP`, `the Stages of the Program Mix`.
    pub what: String,
    /// What to do about it.
    pub remedy: &'static str,
}

impl ExportRefusal {
    pub(super) fn new(span: Span, what: impl Into<String>, remedy: &'static str) -> ExportRefusal {
        ExportRefusal { span, what: what.into(), remedy }
    }
}

/// The remedy for blocks that start and stop.
pub(super) const BLOCKS: &str =
    "put its rungs into a Program that always runs, with a bit of its own that says when they act";
/// The remedy for Stages.
pub(super) const STAGES: &str =
    "write each Stage as a bit that is SET and RST, and as a contact of its rungs";
/// The remedy for STOP.
pub(super) const STOP: &str = "\
    leave it out of what is exported: let a bit turn the outputs off, or stop the other \
    controller by its own switch";
/// The remedy for status bits.
pub(super) const STATUS: &str =
    "no other controller has it: leave it out, or write what it tells by rungs";
/// The remedy for large numbers.
pub(super) const BEYOND: &str =
    "split it into several MATHs: each stores its result within the limits of a word";
/// The remedy for long arrays.
pub(super) const LONG: &str = "an array with a moving index has at most 64 elements there";
/// The remedy for what a later version may export.
pub(super) const NOT_YET: &str =
    "write it with bits, MOVE, ADD, SUB and compares: rungd exports no other form of it yet";
