//! The engine: a memory image, operations on it, blocks, and the scan.
//!
//! `lower` builds a [`EngineProgram`]. The simulator and the scan thread own an [`Engine`] and
//! call, for each scan, `begin_scan`, then inputs and queued writes, then `execute`; after the last
//! scan, `terminate`. Time is an argument. The engine allocates nothing after [`Engine::new`], and
//! uses no clock, log, file or name.
//!
//! No instruction in a block's rungs is skipped: it executes with its power, ON or OFF. So a
//! block's own rungs, or a Stage, are a straight line of operations without branches. Two
//! operations may change places if neither writes a cell that the other reads or writes. `lower`
//! uses this to put operations of one kind next to each other, and the engine runs each such batch
//! in one loop over one table: no dispatch for each operation, no branches to predict, and operands
//! that stream from memory in order. Control instructions (RUN, JMP, EXIT …) are fences: no
//! operation moves past them. `lower_with(program, 1)` keeps file order, and tests compare both.
//!
//! Each loop is compiled three times (`reach`): for programs whose cells all have 16-bit numbers,
//! in memory of at least 2^16 cells, where the compiler sees that no number can be out of range and
//! omits the bounds checks; for larger programs; and for any program with forces.
//!
//! A MATH is steps, one for each operator (`steps`). MATHs whose steps differ only in their cells
//! are executed in columns, each step once for up to 64 of them (`columns`); the others one after
//! the other, with a dispatch for each operator (`rows`). An operator reads words in place,
//! integers as reals too. The newest integer and the newest real are in accumulators; other results
//! wait in slots, whose number is known at load. A formula's words and bits, its target and the
//! status bits are cells of the operation like any other, so the scheduler keeps MATHs and the
//! rungs that read `$Overflow` in order.
#![forbid(unsafe_code)]

mod array_places;
mod arrays;
mod blocks;
mod call;
mod columns;
mod control;
mod counters;
mod elements;
mod events;
mod eye;
mod image;
pub mod integer;
pub mod isa;
mod kept;
mod layout;
mod logic;
mod machine;
mod math;
mod memory;
mod mishap;
pub mod ops;
mod packing;
mod parts;
mod places;
mod power;
mod program;
mod reach;
pub mod real;
pub mod record;
mod resume_bits;
mod role;
mod rows;
mod scan;
mod sensaphone;
mod slice;
mod state;
mod state_bytes;
mod state_check;
mod step_reads;
mod steps;
mod termination;
mod timers;
mod transfer;
mod wiring;
mod word_bits;
mod written;

pub use call::EngineCall;
pub use events::{BlockEvent, Element, MathEvent};
pub use eye::{ScanObserver, ScanStep};
pub use image::{BitCell, Image, WordCell};
pub use layout::{Cell, Layout, WordBitCell};
pub use machine::{BlockState, StageState};
pub use mishap::Mishap;
pub use mishap::Mishaps;
pub use parts::MemoryCells;
pub use power::Power;
pub use program::EngineProgram;
pub use program::{Batch, BlockCode, BlockRole, ElementCode, PassStep, Tables};
pub use resume_bits::ResumeBits;
pub use scan::{Engine, ScanEnd, ScanTimes};
pub use slice::Slice;
pub use state::EngineState;
pub use state_check::TIME_END_NS;
pub use transfer::{KeptCells, StageRestart};
pub use transfer::{Renumbered, RenumberedCell, Transfer};
pub use wiring::SliceCells;
pub use written::Stretches;
