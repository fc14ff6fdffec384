//! The commands that need no controller, and the pages that show them.

mod addresses;
mod commands;
mod differential;
mod docs_commands;
mod draw;
mod examples;
mod fmt;
mod init;
mod ladder_tests;
mod lsp;
mod man_and_completions;
mod packaging;
mod plants;
mod record;
mod replay;
mod sim;
mod sim_controller;
mod waves;
mod xref;

/// Each binary uses a part of this shared code.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod calm;
    pub mod masked;
    pub mod model;
    pub mod needs;
    pub mod setting;
    pub mod shown;
}
