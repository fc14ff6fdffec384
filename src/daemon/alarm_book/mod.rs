//! The book of alarms: which alarms are active, since when, in which order they rose, who
//! acknowledged them, who shelved them.
//!
//! Pure: times are arguments. `alarm_keeper` enters the alarms' changes that the scan thread
//! reports; `operator_server` reads the book, acknowledges and shelves alarms; `alarm_file` keeps a
//! part of it over a restart. The size of the book is bounded by the number of alarms. The states
//! are those of ISA-18.2: an alarm that went away unacknowledged stays in the list until somebody
//! acknowledges it.

mod book;
mod entry;
mod kept;
mod known;
mod pending;
mod shelf;
mod shelves;
#[cfg(test)]
pub(super) mod tests;
mod time;

pub(super) use book::AlarmBook;
pub(super) use entry::Acknowledgement;
pub(super) use kept::KeptAlarms;
#[cfg(test)]
pub(super) use known::AlarmSource;
pub(super) use known::KnownAlarm;
pub(super) use shelf::{EndedShelf, ShelfEnd, WantedShelf};
pub(super) use time::BookTime;
