//! Drivers: they move inputs and take outputs. They depend on the runtime's exchange alone.
//!
//! The daemon starts them with the controller file's settings. A driver sees the scan through a
//! port (inputs in, batches of writes in, the last complete scan's image out). It knows of ladders,
//! tags and modes only the values in an image. `controller` has made sure that no two drivers move
//! one input.

pub(crate) mod caught;
pub mod device;
pub mod gpio;
pub mod modbus;
pub mod modbus_client;
pub mod plant;
pub mod scaling;
