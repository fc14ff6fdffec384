//! The engine: a memory image, operations on it, blocks, and one scan.
//!
//! `lower` builds a [`Program`]; the simulator and the scan thread own an [`Engine`] and drive it:
//! `begin_scan`, inputs and queued writes, `execute`, and `terminate` behind the last scan. Time
//! is an argument. After [`Engine::new`] nothing is allocated, and nothing here knows a clock, a
//! log, a file or a name.
//!
//! The idea that is not obvious: nothing in a block's rungs is ever skipped (an instruction
//! executes with its power, OFF included), so a block's own rungs or a Stage are a straight line
//! of operations without branches. Operations that do not touch what the other writes may change
//! places unseen; `lower` uses that to lay operations of one kind next to each other, and the
//! engine runs each such batch in one loop.
#![forbid(unsafe_code)]

mod blocks;
mod control;
mod counters;
mod events;
mod image;
mod layout;
mod logic;
mod memory;
pub(crate) mod ops;
mod places;
mod power;
mod program;
mod reach;
mod record;
mod role;
mod scan;
mod sensaphone;
mod termination;
mod timers;
mod transfer;

pub use events::{BlockEvent, Element};
pub use image::{BitCell, Image, WordCell};
pub use layout::Cell;
pub use layout::Layout;
pub use program::{Batch, BlockCode, BlockRole, ElementCode, PassStep, Program, Tables};
pub use scan::{Engine, ScanEnd, ScanTimes};
pub use transfer::{Restage, Stretch, Transfer};
