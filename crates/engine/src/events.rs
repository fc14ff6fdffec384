//! The events of blocks, Stages and MATHs in one scan, for the log: lists of bounded length,
//! cleared at every scan.

use super::mishap::Mishaps;
use crate::isa::{BlockId, ElementId, StageId};

/// A part of the program that executes and terminates as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Element {
    /// A block's own rungs, or a subroutine.
    Block(BlockId),
    /// A Stage.
    Stage(StageId),
}

impl From<ElementId> for Element {
    fn from(element: ElementId) -> Element {
        element.stage.map_or(Element::Block(element.block), Element::Stage)
    }
}

/// One event of a block or Stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockEvent {
    /// RUN, RESTART or ENTASK started it.
    Started(BlockId),
    /// It was halted, exited or disabled.
    Stopped(BlockId),
    /// A run-once Task has executed.
    Completed(BlockId),
    /// A termination pass ran over it.
    Terminated(Element),
    /// A Stage came ON.
    StageOn(StageId),
    /// A Stage went OFF.
    StageOff(StageId),
}

/// A MATH that had a mishap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MathEvent {
    /// Its number in the program.
    pub math: u32,
    /// What happened.
    pub mishaps: Mishaps,
}

/// Maximum number of MATHs with a mishap that are kept for one scan; further MATHs are only
/// counted.
const MATHS_MAX: usize = 16;

/// Maximum number of events that are kept for one scan; further events are only counted.
const CAPACITY: usize = 256;

/// The events of one scan.
#[derive(Debug)]
pub(super) struct Events {
    list: Vec<BlockEvent>,
    maths: Vec<MathEvent>,
    dropped: u32,
}

impl Events {
    pub fn new() -> Events {
        let (list, maths) = (Vec::with_capacity(CAPACITY), Vec::with_capacity(MATHS_MAX));
        Events { list, maths, dropped: 0 }
    }

    pub fn clear(&mut self) {
        self.list.clear();
        self.maths.clear();
        self.dropped = 0;
    }

    pub fn push(&mut self, event: BlockEvent) {
        if self.list.len() < CAPACITY {
            self.list.push(event);
        } else {
            self.dropped += 1;
        }
    }

    pub fn push_math(&mut self, event: MathEvent) {
        if self.maths.len() < MATHS_MAX {
            self.maths.push(event);
        } else {
            self.dropped += 1;
        }
    }

    /// Inserts a MATH among the events from index `from` on, in the order of the MATHs' numbers.
    pub fn insert_math(&mut self, event: MathEvent, from: usize) {
        let at = from + self.maths[from..].partition_point(|told| told.math < event.math);
        if self.maths.len() == MATHS_MAX {
            self.dropped += 1;
            if at == MATHS_MAX {
                return;
            }
            self.maths.pop();
        }
        self.maths.insert(at, event);
    }

    pub fn maths(&self) -> &[MathEvent] {
        &self.maths
    }

    pub fn list(&self) -> &[BlockEvent] {
        &self.list
    }

    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}
