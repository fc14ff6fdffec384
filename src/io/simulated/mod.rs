//! The simulated device: rules that move inputs by themselves, so that a program is alive
//! without hardware.
//!
//! [`Device`] is pure: it takes the time and a way to read bits, and says which inputs change.
//! Tests step it together with the engine in virtual time; [`Drive`] steps it against a running
//! controller, about every millisecond. What the rules mean is `docs/simulated-device.md`.

mod device;
mod drive;
mod follower;
pub mod settings;

pub use device::Device;
pub use drive::{Drive, Rules};
pub(in crate::io) use follower::Follower;
