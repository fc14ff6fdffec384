//! Small parts without a room of their own: bytes, dates, files, locks, random numbers.
//!
//! Every other crate may use this one, and it uses none of them. It never logs, and knows neither
//! ladders nor controllers.

pub mod byte_source;
pub mod calendar;
pub mod directories;
pub mod duration_text;
pub mod faults;
pub mod locked;
pub mod progress;
pub mod random;
pub mod regular_file;
pub mod scan_period;
pub mod variants;
pub mod wall_clock;
pub mod whole_file;
