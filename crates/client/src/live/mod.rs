//! Follows a running controller from outside: its program, and every scan of the last minute with
//! the power of each contact.
//!
//! A read-only client of the operator's socket. [`ControllerFollower`] requests the newest part of
//! the scan log and keeps the last minute. Each look returns a [`LiveView`], which answers
//! questions without the controller; `web` and `monitor` show it. A [`ChangeFollower`] reports
//! every change of chosen cells once, and a [`ChangeHistory`] reports the changes of the past;
//! `edge` publishes them. A [`TrendPast`] has the values
//! of an operand over hours. Deliberately absent: threads and clocks.

mod change_follower;
mod change_history;
mod change_run;
mod events;
mod follower;
mod live_past;
mod log_event;
mod logged_program;
#[cfg(test)]
mod output_tests;
mod past_trend;
#[cfg(test)]
mod past_trend_tests;
mod program;
mod tag_type;
#[cfg(test)]
mod tests;
mod trend;
mod view;

pub use change_follower::ChangeFollower;
pub use change_history::{ChangeHistory, HistorySpan, recorded_folder};
pub use events::LiveEvent;
pub use follower::{ControllerFollower, LookFailure};
pub use log_event::{LogEvent, LogGap, LogPosition, LoggedChange};
pub use logged_program::{ChooseCells, LoggedProgram, NamedCell};
pub use past_trend::{NewestPiece, OpenedPast, PastGap, PastPiece, TimedValue, TrendPast};
pub use program::{LiveProgram, LiveTag};
pub use rungd_history::record::RecordedFolder;
pub use tag_type::TagType;
pub use trend::{Trend, TrendGap, TrendPoint};
pub use view::{LiveView, TagValue};
