//! A controller that runs, followed from outside: its program, and every scan of the last while
//! with the power of each contact.
//!
//! A client of the operator's socket that only looks. [`Follower`] asks for the newest part of the
//! scan log and keeps the last minute; a [`LiveView`] is what it saw, and answers questions without
//! the controller. `web` and `monitor` show it. A [`ChangeFollower`] tells every change of chosen
//! cells, each once, and a [`ChangeHistory`] those of the past: `edge` publishes them. Deliberately
//! absent: threads and clocks.

mod change_follower;
mod change_history;
mod change_run;
#[cfg(test)]
mod change_tests;
mod events;
mod follower;
mod log_event;
mod logged_program;
mod program;
#[cfg(test)]
mod tests;
mod trend;
mod view;

pub use change_follower::ChangeFollower;
pub use change_history::{ChangeHistory, HistorySpan, RecordedFolder};
pub use events::LiveEvent;
pub use follower::{Follower, LookFailure};
pub use log_event::{LogEvent, LogGap, LogPosition, LoggedChange};
pub use logged_program::{ChooseCells, LoggedProgram, NamedCell};
pub use program::{LiveProgram, LiveTag};
pub use trend::Trend;
pub use view::{LiveView, TagValue};
