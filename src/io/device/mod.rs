//! Field devices beside the scan: one task a device, which exchanges and reports.
//!
//! The daemon makes a [`Device`] of a driver and a line to the scan, and runs it until the end. A
//! driver ([`Driver`]) knows how to reach its peer and what its points are; when to exchange, what
//! to do after trouble, safe values and the log are settled here, the same for all. Local lines
//! are exchanged by the scan thread itself; [`Keeper`] only opens them, again and again.

mod driver;
mod health;
mod keeper;
mod retry;
mod task;

pub use driver::{Done, Driver, Exchange, Occasion, Trouble};
pub use health::{Condition, Health};
pub use keeper::{Keeper, Opener};
pub(super) use retry::Retry;
pub use task::{Device, Parts};
