//! What an instruction does with an operand: a column of the instruction table.
//!
//! The legs of a rung are no operands, and the members that an instruction changes in its own
//! structure follow from `Owns`. How an instruction computes what it writes is not said here:
//! `lower` and the engine do that.

/// What an execution of an instruction does with one of its operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OperandRole {
    /// Reads the value, bit or array.
    Reads,
    /// Writes the bit ON and OFF at every execution, so that it drives the bit.
    Drives,
    /// Turns the bit ON while its rung is ON.
    TurnsOn,
    /// Turns the bit OFF while its rung is ON.
    TurnsOff,
    /// Writes any value while its rung is ON.
    Stores,
    /// Changes the bit or bits at an edge.
    Changes,
    /// Owns the structure: writes its members at every execution.
    Owns,
    /// Resets the structure of another instruction while its rung is ON.
    Resets,
    /// Starts the Program, or turns the Stage ON.
    Starts,
    /// Runs the Task, once or again and again.
    Enables,
    /// Executes the subroutine at once.
    Calls,
    /// Stops the block, or turns the Stage OFF.
    Stops,
    /// Turns the Stage ON, and leaves its own Stage or the awaited Stages.
    Enters,
    /// Waits until the Stage is ON, and turns it OFF when it enters another one.
    Awaits,
}

impl OperandRole {
    /// Whether it writes the bit, word or array that the operand names.
    pub fn writes(self) -> bool {
        match self {
            OperandRole::Drives
            | OperandRole::TurnsOn
            | OperandRole::TurnsOff
            | OperandRole::Stores
            | OperandRole::Changes => true,
            OperandRole::Reads
            | OperandRole::Owns
            | OperandRole::Resets
            | OperandRole::Starts
            | OperandRole::Enables
            | OperandRole::Calls
            | OperandRole::Stops
            | OperandRole::Enters
            | OperandRole::Awaits => false,
        }
    }
}
