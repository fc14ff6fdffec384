//! Drivers: they supply inputs and receive outputs. They depend only on the runtime's exchange.
//!
//! The daemon starts them with the controller file's settings. A driver reaches the scan through a
//! port: inputs and batches of writes go in, the image of the last complete scan comes out. The
//! only facts about ladders, tags and modes that a driver uses are the values in an image.
//! `controller` has made sure that no two drivers supply the same input.

pub mod caught;
pub mod device;
pub mod gpio;
pub mod ladder;
pub mod listening;
pub mod modbus;
pub mod modbus_client;
pub mod plant;
pub mod scaling;
pub mod seats;
