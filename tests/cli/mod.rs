//! The commands that need no controller, and the pages that show them.

mod addresses;
mod alarm_history;
mod check_fix;
mod commands;
mod differential;
mod docs_commands;
mod draw;
mod examples;
mod export;
mod fmt;
#[cfg(feature = "import")]
mod import;
mod init;
mod ladder_tests;
mod lsp;
mod man_and_completions;
mod mutate;
mod observers;
mod packaging;
mod plant_faults;
mod plants;
mod proofs;
mod prove;
mod record;
pub mod replay;
mod sim;
mod sim_controller;
mod upgrade;
mod waves;
mod why_reload;
mod xref;
