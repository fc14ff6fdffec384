//! Drivers: what moves inputs and takes outputs, written against the runtime's exchange alone.
pub mod modbus;
