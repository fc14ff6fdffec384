//! The parts of the controller's language, as data: address spaces, structures and their members,
//! the instruction table, durations.
//!
//! Used by nearly every other module; uses none of them. The resolver, the checks, `rungd explain`
//! and the reference pages read the instruction table, so a new instruction is added here first.

pub mod address;
pub mod address_text;
pub(crate) mod columns;
pub(crate) mod decimal_comma;
pub(crate) mod dialects;
pub mod duration;
pub(crate) mod function;
pub mod instruction;
pub(crate) mod instruction_table;
pub(crate) mod maps;
pub(crate) mod notation;
pub(crate) mod number_ranges;
pub(crate) mod real;
pub(crate) mod role;
pub(crate) mod since;
pub(crate) mod space;
pub mod status;

pub(crate) use address::Flag;
pub use address::{Address, Bit, BlockId, DeviceId, ElementId, Health, StageId, Structure, Word};
pub(crate) use function::Function;
pub use instruction::Spec;
pub(crate) use instruction::{LegName, Mnemonic, OperandKind, OperandSpec};
pub(crate) use maps::{NumberMap, NumberSet};
pub(crate) use number_ranges::NumberRanges;
pub use real::{NearestReal, Real};
pub(crate) use role::OperandRole;
pub use space::{BitSpace, MemorySizes, Space, WordSpace};
