//! The rules by which inputs move, as `controller` makes them of a controller file.

use crate::isa::Bit;
use crate::source::span::Span;

/// A rule by which one input moves.
#[derive(Clone, Debug)]
pub struct Rule {
    /// The number of the X bit.
    pub input: u32,
    /// How it moves.
    pub motion: Motion,
    /// It only moves while this bit is ON; else it is OFF.
    pub while_on: Option<Bit>,
    /// The input is ON where the rule says OFF.
    pub invert: bool,
    /// The place of the rule.
    pub span: Span,
}

/// How a simulated input moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// ON for `width_ms` in every `every_ms`, from `offset_ms` on.
    Pulse {
        /// How long it is ON; less than `every_ms`.
        width_ms: u32,
        /// How often.
        every_ms: u32,
        /// When the first one begins.
        offset_ms: u32,
    },
    /// As another bit, later.
    Follow {
        /// The bit.
        bit: Bit,
        /// How long the bit is ON before the input is.
        after_ms: u32,
        /// How long the bit is OFF before the input is.
        release_ms: u32,
    },
}
