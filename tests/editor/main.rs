//! The language server: an editor of the tests' own speaks with it, in memory.

mod client;
mod commands;
mod findings;
mod live;
mod navigation;
mod project;

/// Each binary uses a part of this shared code.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod calm;
    pub mod live;
    pub mod metronome;
}
