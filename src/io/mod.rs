//! Drivers: what moves inputs and takes outputs, written against the runtime's exchange alone.
//!
//! The daemon starts them with what the controller file says. A driver sees the scan through a
//! port (inputs in, batches of writes in, the last complete scan's image out) and knows nothing
//! of ladders, tags and modes but what an image shows. That no two drivers move one input was
//! seen to when the controller file was resolved.

pub(crate) mod caught;
pub mod device;
pub mod gpio;
pub mod modbus;
pub mod modbus_client;
pub mod plant;
