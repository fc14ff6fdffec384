//! The parts of the controller's language, as data: address spaces, structures and their members,
//! the instruction table, durations.
//!
//! Used by nearly every other module; uses none of them. The resolver, the checks, `rungd explain`
//! and the reference pages read the instruction table, so a new instruction is added here first.

pub mod address;
pub mod address_text;
pub(crate) mod columns;
pub mod decimal_comma;
pub mod dialects;
pub mod duration;
pub mod foreign_place;
pub mod function;
pub mod instruction;
pub(crate) mod instruction_table;
pub(crate) mod maps;
pub mod notation;
pub(crate) mod number_ranges;
pub mod own_bits;
pub mod real;
pub(crate) mod role;
pub mod since;
pub(crate) mod space;
pub mod status;

pub use address::Flag;
pub use address::{Address, Bit, BlockId, DeviceId, ElementId, StageId, Structure, Word, WordBit};
pub use function::Function;
pub use instruction::Spec;
pub use instruction::{LegName, Mnemonic, OperandKind, OperandSpec};
pub use maps::{NumberMap, NumberSet};
pub use number_ranges::{NumberRange, NumberRanges};
pub use own_bits::{BlockBit, DeviceBit};
pub use real::{NearestReal, Real};
pub use role::OperandRole;
pub use space::{BitSpace, MemorySizes, Space, WordSpace};
