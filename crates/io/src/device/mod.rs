//! Field devices beside the scan: each device has a task that exchanges and reports.
//!
//! The daemon makes a [`DeviceTask`] from a driver and a line to the scan, and runs it until the
//! end. A driver ([`Driver`]) has its points and reaches its peer. This module decides, for all
//! drivers, the times of exchanges, the reaction to trouble, the safe values and the log lines. The
//! scan thread itself exchanges with local devices; a [`DeviceKeeper`] only opens its device, and
//! opens it again after trouble.

mod driver;
mod health;
mod keeper;
mod retry;
mod task;

pub use driver::{Driver, Exchange, ExchangeExtent, ExchangeFailure, ExchangeReason};
pub use health::DeviceHealth;
pub use keeper::{DeviceKeeper, Opener};
pub(super) use retry::Retry;
pub use task::{DeviceParts, DeviceTask};
