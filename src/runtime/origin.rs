//! Where something comes from that changes memory from outside.
//!
//! A leaf module: the exchange numbers batches, the scanner tells the machine the origin of what it
//! hands on, and the tape keeps it.

use super::command::CommandId;

/// The number of an accepted batch: the first one of a process is 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticket(pub u64);

/// Where something comes from that changes memory from outside.
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
