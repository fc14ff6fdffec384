//! The language server: an editor of the tests' own speaks with it, in memory.

mod client;
mod commands;
mod completion;
mod completion_log;
mod completion_shipped;
mod completion_uses;
mod completion_written;
mod findings;
mod fixes;
mod formatting;
mod hover;
mod large;
mod large_texts;
mod live;
mod navigation;
mod neovim;
mod project;
mod renames;
mod typing;

/// A binary uses a part of what they share.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod calm;
    pub mod case;
    pub mod live;
    pub mod metronome;
    pub mod needs;
    pub mod page;
    pub mod run;
    pub mod table;
}
