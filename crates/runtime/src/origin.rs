//! The origin of a change of memory from outside.
//!
//! A leaf module: the exchange numbers batches, the scanner passes the origin of each change to the
//! machine, and the tape stores it.

use super::command::CommandId;

/// The number of an accepted batch: the first one of a process is 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticket(pub u64);

/// The origin of a change of memory from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The X inputs, as drivers without a wiring set them: simulated inputs, Modbus clients.
    Inputs,
    /// A field device, by its number.
    Device(u32),
    /// A batch of queued writes.
    Batch(Ticket),
    /// An operator's command.
    Command(CommandId),
}
