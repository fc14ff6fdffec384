//! Placeholder until the engine lands: the cells that the exchange is written in terms of.

/// A bit's place in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BitCell(pub u32);

/// A word's place in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct WordCell(pub u32);

/// The scan times that DST1..DST4 show, in microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct ScanTimes {
    pub mean_us: i32,
    pub min_us: i32,
    pub max_us: i32,
    pub last_us: i32,
}

/// An element of a termination pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Element {
    Block(crate::isa::BlockId),
    Stage(crate::isa::StageId),
}

/// What happened to a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum BlockEvent {
    Started(crate::isa::BlockId),
    Stopped(crate::isa::BlockId),
    Completed(crate::isa::BlockId),
    Terminated(Element),
    StageOn(crate::isa::StageId),
    StageOff(crate::isa::StageId),
}
