//! What the controller's language is made of, as data: address spaces, structures and their
//! members, the instruction table, durations.
//!
//! Everything above reads this and nothing here reads anything above. The instruction table feeds
//! the parser, the checks, `rungd explain` and the reference pages, so that a new instruction is
//! added here first.

pub mod address;
pub mod address_text;
pub(crate) mod dialects;
pub mod duration;
pub mod instruction;
pub mod pages;
pub mod space;
pub mod status;

pub use address::{
    Address, Bit, BlockId, DeviceId, ElementId, Flag, Health, StageId, Structure, Word,
};
pub use instruction::{LegName, Mnemonic, Operand, OperandKind, Spec};
pub use space::{BitSpace, MemorySizes, Space, WordSpace};
