//! OPCUA.toml: the settings of `rungd-opcua`, the OPC UA server of a controller.
//!
//! The server is a program of its own (the folder `opcua`), because its libraries are many. Its
//! file is read here, so that `rungd schema opcua` has the same keys.

mod keys;
mod settings;

pub use keys::{read_opcua, shape};
pub use settings::OpcUaSettings;
