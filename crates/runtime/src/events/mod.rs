//! The catalogue of events: everything that the log can report, one row per event.
//!
//! Each row is a constant. A log line names it (`say!(ALARM_ON, …)`) and takes its level from it.
//! The log's writer takes the other fields: the stable code, the message ID (`journalctl -x` finds
//! the explanation by it), the limit of such lines, and whether a controller file may leave them
//! out. `rungd explain` and `docs/events.md` are made from the same rows. A code and an ID never
//! change: a test has a list of them (`events.txt`), and finds rows that no line uses.
//!
//! Deliberately absent: the texts of log lines, which are in the code that logs them, and tracing.

#[macro_use]
mod row;
mod audit;
mod controller;
mod device;
mod journal_catalog;
mod levels;
pub mod limit;
mod memory;
mod plant;
mod record;
mod reload;
mod table;
mod world;

pub use audit::{audited, is_audited};
pub use controller::*;
pub use device::*;
pub use journal_catalog::catalog;
pub use levels::EventLevels;
pub use limit::LineLimit;
pub use memory::*;
pub use plant::*;
pub use record::*;
pub use reload::*;
pub use row::Level;
pub use row::{Event, GROUPS, Silence};
pub use table::coded;
pub use table::{all, named};
pub use world::*;
