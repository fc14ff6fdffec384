//! The language server: an editor of the tests' own speaks with it, in memory.

mod client;
mod completion;
mod completion_shipped;
mod findings;
mod formatting;
mod navigation;
mod project;
mod renames;
mod typing;

/// A binary uses a part of what they share.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod case;
    pub mod run;
    pub mod table;
}
