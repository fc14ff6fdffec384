//! What latches hold, and what they become; plain data.

use super::number::Number;
use crate::aig::Literal;
use crate::events::ScanEvent;
use crate::gates::Held;
use rungd_engine::isa::BlockId;
use rungd_engine::{BitCell, Element, WordCell};

/// The time since the last execution of an element.
#[derive(Clone, Debug)]
pub(super) enum Elapsed {
    /// In scans.
    Scans(Number),
    /// In ms: behind a RETURN.
    Ms(Number),
}

/// A number of a block, Stage or subroutine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum OwnNumber {
    /// The interval of a recurrent Task, ms.
    Interval(BlockId),
    /// The time in the current interval of a recurrent Task, ms.
    Phase(BlockId),
    /// The number of scans since the last execution of an element.
    Age(Element),
}

impl OwnNumber {
    /// Whether it is one of a block's own rungs.
    pub fn is_of(self, block: BlockId) -> bool {
        match self {
            OwnNumber::Interval(id) | OwnNumber::Phase(id) => id == block,
            OwnNumber::Age(element) => element == Element::Block(block),
        }
    }

    pub fn held(self, bit: u8) -> Held {
        match self {
            OwnNumber::Interval(task) => Held::Interval(task, bit),
            OwnNumber::Phase(task) => Held::Phase(task, bit),
            OwnNumber::Age(Element::Block(block)) => Held::Age(block, bit),
            OwnNumber::Age(Element::Stage(stage)) => Held::StageAge(stage, bit),
        }
    }
}

/// The value of a latch in the next scan.
#[derive(Clone, Copy, Debug)]
pub(super) enum Next {
    /// That of the bit at the end of this scan.
    Bit(BitCell),
    /// A bit of the word.
    WordBit(WordCell, u8),
    /// The state.
    Own(Held),
    /// A bit of the number.
    OwnBit(OwnNumber, u8),
    /// A literal.
    Fixed(Literal),
}

/// An event of the model, and when it happens.
#[derive(Clone, Copy, Debug)]
pub(super) struct EventLiteral {
    pub event: ScanEvent,
    pub happens: Literal,
}

/// A latch that was made.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnedLatch {
    pub literal: Literal,
    pub next: Next,
    pub initial: bool,
    pub holds: Held,
}
