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
pub mod status;

pub use address::{
    Address, Bit, BitSpace, BlockId, DeviceId, Flag, Health, MemorySizes, StageId, Structure, Word,
    WordSpace,
};
pub use instruction::{LegName, Mnemonic, Operand, OperandKind, Spec};
