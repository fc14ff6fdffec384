//! The daemon: a thin shell of tokio around the scan thread.
//!
//! `rungd run` makes a [`ProcessHost`] and calls [`log::init`], [`config::settle`] and [`run`], in
//! this order. The daemon contains the signals, systemd, the drivers' tasks and the log. `runtime`
//! contains the scan thread, and depends on none of these. Nothing here can make a scan wait.

mod alarm_book;
mod alarm_file;
mod alarm_keeper;
mod allowance;
mod bit_alarms;
mod chain_start;
pub mod config;
mod devices;
mod failure;
pub mod guard;
mod journal;
pub(crate) mod local_time;
pub mod log;
pub(crate) mod log_chain;
mod log_channel;
mod log_form;
mod log_queue;
pub(crate) mod log_reading;
mod log_rules;
mod log_screen;
mod log_writer;
mod look_pace;
mod modbus_start;
mod narration;
mod operator_server;
mod posture;
mod record;
mod record_disk;
mod record_stall;
mod record_thread;
mod reload;
mod retain;
mod retain_thread;
mod shell;
mod signals;
mod start_parts;
mod start_wait;
mod systemd;
mod told_statistics;
mod turns;
mod watch_log;
mod watch_reasons;
mod watches;

pub use failure::StartFailure;
pub use shell::{ControllerEnd, ShellOptions, run};
pub use signals::ProcessHost;
pub use start_wait::StartPart;
