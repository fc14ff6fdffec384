//! A controller that runs, followed from outside: its program, and every scan of the last while
//! with the power of each contact.
//!
//! A client of the operator's socket that only looks. [`Follower`] asks for the newest part of the
//! scan log and keeps the last minute; a [`LiveView`] is what it saw, and answers questions without
//! the controller. `web` and `monitor` show it. Deliberately absent: threads and clocks.

mod events;
mod follower;
mod program;
#[cfg(test)]
mod tests;
mod trend;
mod view;

pub use events::LiveEvent;
pub use follower::{Follower, LookFailure};
pub use program::{LiveProgram, LiveTag};
pub use trend::Trend;
pub use view::{LiveView, TagValue};
