//! The real process: its runs and ends, its watchdog, its commands, and its messages.

mod alarm_acks;
mod alarm_delays;
mod alarms;
mod bottling;
mod clocks;
mod endings;
mod events;
mod found_controller;
mod full_disk;
mod journal;
mod log_on_terminal;
mod log_settings;
#[cfg(feature = "monitor")]
mod monitor;
mod names;
mod no_descriptors;
mod operator_commands;
mod operator_hold;
mod operator_hostile;
mod operator_late;
mod operator_modes;
mod operator_sets;
mod operator_socket;
mod operator_storm;
mod operator_view;
mod posture;
mod questions;
mod reals;
mod restart_guard;
mod run_controller;
mod run_listeners;
mod shelves;
mod time_of_day;
mod value_texts;
mod watchdog_fault;
mod watches;
