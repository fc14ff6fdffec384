//! Drivers: what moves inputs and takes outputs, written against the runtime's exchange alone.
//!
//! The daemon starts them with what the controller file says. A driver sees the scan through a
//! port (inputs in, batches of writes in, the last complete scan's image out) and knows nothing
//! of ladders, tags and modes but what an image shows. [`claims`] keeps two of them from moving
//! one input.

pub mod claims;
pub mod modbus;
pub mod simulated;
