//! The events of blocks and Stages in one scan, for the log: a list of bounded length, cleared at
//! every scan.

use crate::isa::{BlockId, StageId};

/// A part of the program that executes and terminates as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    /// A block's own rungs.
    Block(BlockId),
    /// A Stage.
    Stage(StageId),
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

/// Maximum number of events kept of one scan; further events are only counted.
const CAPACITY: usize = 256;

/// The events of one scan.
#[derive(Debug)]
pub(super) struct Events {
    list: Vec<BlockEvent>,
    dropped: u32,
}

impl Events {
    pub fn new() -> Events {
        Events { list: Vec::with_capacity(CAPACITY), dropped: 0 }
    }

    pub fn clear(&mut self) {
        self.list.clear();
        self.dropped = 0;
    }

    pub fn push(&mut self, event: BlockEvent) {
        if self.list.len() < CAPACITY {
            self.list.push(event);
        } else {
            self.dropped += 1;
        }
    }

    pub fn list(&self) -> &[BlockEvent] {
        &self.list
    }

    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}
